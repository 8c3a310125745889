"""An evolution as a film: programs that were the best so far drive round the course, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from matplotlib.ticker import MaxNLocator

from gecar.language.program import Program
from gecar.plots.drives.animation import BETWEEN_S, LAST_FRAME_S, Scene, film_of
from gecar.plots.runs.convergence import UNSOLVED
from gecar.plots.style import FAINT, INK
from gecar.world.rollout import Drive, World

PACE, FASTEST = 12.0, 100.0
"""Seconds of driving in a second of film: usually, and at most."""
MOST_SHOWN = 8
"""Drives in a film."""
LONGEST_S = 29.0
"""Length of a film [s]."""

Series = npt.NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True)
class Champion:
    """The best program so far, or the one a run chose.

    Attributes
    ----------
    generation
        That brought it.
    program, drive
        The drive holds its trace.
    title
        What to write above it.
    """

    generation: int
    program: Program
    drive: Drive
    title: str


def film_evolution(
    world: World, champions: Sequence[Champion], history: Mapping[str, Series], path: Path
) -> Path:
    """Film an evolution.

    Parameters
    ----------
    world
        Where they drive.
    champions
        In the order they came, for example those that `choose_shown` returns.
    history
        Columns of ``history.csv``, each (generations,): generation, best [s].
    path
        Where to write it; ``.gif`` or ``.mp4``.

    Raises
    ------
    InputError
        If the ending is another, or an MP4 is wanted where there is no ffmpeg.
    """
    scenes = [partial(EvolutionScene, world, champion, history) for champion in champions]
    return film_of(scenes, path, pace=pace_of([champion.drive.time_s for champion in champions]))


def choose_shown(champions: Sequence[T]) -> list[T]:
    """Return the first, the last, and others evenly between, in order, at most `MOST_SHOWN`."""
    count = min(len(champions), MOST_SHOWN)
    return [champions[k] for k in np.linspace(0, len(champions) - 1, count).round().astype(int)]


def pace_of(times_s: Sequence[float]) -> float:
    """Return the pace at which drives of these times [s] make a film of at most `LONGEST_S`."""
    held_s = BETWEEN_S * (len(times_s) - 1) + LAST_FRAME_S
    return min(max(PACE, sum(times_s) / (LONGEST_S - held_s)), FASTEST)


class EvolutionScene(Scene):
    """A champion on the course, and below it the best time of each generation up to its own."""

    def __init__(self, world: World, champion: Champion, history: Mapping[str, Series]) -> None:
        self.champion, self.history = champion, history
        super().__init__(world, champion.program, champion.drive, champion.title)

    def _draw_below(self) -> None:
        generation, best = self.history["generation"], np.minimum.accumulate(self.history["best"])
        times = np.where(best < UNSOLVED, best, np.nan)
        now = self.champion.generation
        self.below.step(generation, times, where="post", color=FAINT)
        self.below.step(generation[: now + 1], times[: now + 1], where="post", color=INK, linewidth=2.0)
        self.below.plot(generation[now], times[now], "o", color=INK, markersize=5)
        self.below.set(xlabel="generation", ylabel="best [s]", xlim=(0.0, max(generation[-1], 1.0)))
        self.below.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
        self.cursor = self.below.axvline(now, color=INK, linewidth=1.0, linestyle=":")

    def _mark(self, sample: int) -> None:
        """Leave the generation marked."""
