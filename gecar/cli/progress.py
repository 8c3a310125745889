"""How a run or a discovery goes, while it goes: one live line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gecar.evolution.history import Generation, pace
from gecar.evolution.scores import UNSOLVED

PLAIN_EVERY_S = 15.0
"""Shortest time between two lines of progress where there is no terminal [s]."""


class _LiveLine:
    """A line of progress, shown inside a ``with`` block; ``live`` is None where there is no terminal."""

    live: Progress | None

    def __enter__(self) -> Self:
        if self.live:
            self.live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.live:
            self.live.stop()


class Watch(_LiveLine):
    """Shows a run's generations on stderr as they come.

    Parameters
    ----------
    history
        The run's; it grows while the run goes on.
    generations
        Number of the last generation.
    quiet
        Whether to show nothing.
    """

    def __init__(self, history: Sequence[Generation], generations: int, quiet: bool = False) -> None:
        self.history, self.generations, self.quiet = history, generations, quiet
        console = Console(stderr=True, highlight=False)
        self.console = console
        self.live = None
        self._said = time.monotonic()
        if console.is_terminal and not quiet:
            columns = (BarColumn(bar_width=16), TextColumn("{task.description}"))
            self.live = Progress(*columns, console=console, transient=True)
            self.task = self.live.add_task("starting ...", total=generations + 1)

    def __call__(self, generation: Generation) -> None:
        """Show a generation that has just been scored."""
        if self.live:
            words = line(self.history, self.generations)
            self.live.update(self.task, completed=generation.generation + 1, description=words)
        elif not self.quiet and time.monotonic() - self._said > PLAIN_EVERY_S:
            self._said = time.monotonic()
            self.console.print(line(self.history, self.generations), soft_wrap=True)


class Steps(_LiveLine):
    """Shows what a long command does: on a terminal in one line, with the time since it began.

    Parameters
    ----------
    say
        What prints a step where there is no terminal: the first, and then one in `PLAIN_EVERY_S` at most.
    console
        Where the line is shown; default: stderr.
    within_s
        By when it has usually ended [s]; 0: nobody knows.
    """

    def __init__(
        self, say: Callable[[str], None], console: Console | None = None, within_s: float = 0.0
    ) -> None:
        self.say = say
        self.live = None
        self._said = -math.inf
        self._begun = time.monotonic()
        self._ahead = f"usually done by {_minutes(within_s)}  " if within_s else ""
        console = console or Console(stderr=True, highlight=False)
        if console.is_terminal:
            columns = (
                SpinnerColumn(),
                TimeElapsedColumn(),
                TextColumn("{task.description}", style="dim", markup=False),
            )
            shown = sys.stdout.isatty()  # else what is said on stdout would go to the terminal
            self.live = Progress(*columns, console=console, transient=True, redirect_stdout=shown)
            self.task = self.live.add_task("starting ...", total=None)

    def __call__(self, step: str) -> None:
        """Show a step that begins or has ended."""
        if self.live:
            self.live.update(self.task, description=f"{self._ahead}{step.strip()}")
        elif time.monotonic() - self._said > PLAIN_EVERY_S:
            self._said = time.monotonic()
            self.say(step)

    def ended(self, done: int, of: int) -> None:
        """Take the number of cases that have ended; the line then shows how long the others take at the same pace."""
        left_s = (time.monotonic() - self._begun) * (of - done) / done
        self._ahead = f"{done} of {of}, {_minutes(left_s)} left  "
        if self.live:
            self.live.update(self.task, description=self._ahead)


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def line(history: Sequence[Generation], generations: int) -> str:
    """Put a run's state in one line.

    Parameters
    ----------
    history
        All generations so far, at least one.
    generations
        Number of the last.
    """
    last, speed = history[-1], pace(history, generations)
    best_s = min(generation.best for generation in history)
    best = f"best {best_s:.2f} s" if best_s < UNSOLVED else "no program at GOAL"
    left = round(speed.left_s)
    return (
        f"{last.generation}/{generations}  {best}  mean {last.mean:.0f}  valid {100 * last.valid:.0f} %  "
        f"distinct {100 * last.distinct:.0f} %  {speed.evaluations_per_s:,.0f}/s  {left // 60}:{left % 60:02d} left"
    )
