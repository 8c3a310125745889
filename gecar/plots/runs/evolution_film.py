"""An evolution as a film: the best program of each generation that brought a better one drives round the course."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.ticker import MaxNLocator

from gecar.language.program import Program
from gecar.plots.drives.animation import Scene, film_of
from gecar.plots.runs.convergence import UNSOLVED
from gecar.plots.style import BLUE, FAINT
from gecar.world.rollout import Drive, World

PACE = 12.0
"""Seconds of driving in a second of film."""

Series = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Champion:
    """The best program so far.

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
        In the order they came.
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
    return film_of(scenes, path, pace=PACE)


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
        self.below.step(generation[: now + 1], times[: now + 1], where="post", color=BLUE, linewidth=2.0)
        self.below.plot(generation[now], times[now], "o", color=BLUE, markersize=5)
        self.below.set(xlabel="generation", ylabel="best [s]", xlim=(0.0, max(generation[-1], 1.0)))
        self.below.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
        self.cursor = self.below.axvline(now, color=BLUE, linewidth=1.0, linestyle=":")

    def _mark(self, sample: int) -> None:
        """Leave the generation marked."""
