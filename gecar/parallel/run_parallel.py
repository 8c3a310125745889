"""Whole calls side by side on an executor: runs of a study, cases to discover, cases of an examination.

This module imports nothing slow.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import TypeVar

from gecar.errors import InputError
from gecar.parallel.executors import MAX_DEATHS, QUIET_S, open_executor, side_by_side
from gecar.parallel.signals import raise_if_interrupted

Key = TypeVar("Key")
Argument = TypeVar("Argument")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Workplace:
    """Where whole calls are performed.

    Attributes
    ----------
    open
        Makes the executor, and makes it again after a worker died.
    workers
        How many calls go side by side.
    """

    open: Callable[[], Executor]
    workers: int

    @classmethod
    def of(cls, kind: str, workers: int, scheduler: str = "") -> Workplace:
        """Return an executor by kind; see `gecar.parallel.executors.open_executor`.

        Raises
        ------
        InputError
            If there is no such kind, no worker, or Dask does not answer.
        """
        return cls(partial(open_executor, kind, workers, scheduler), side_by_side(kind, workers, scheduler))


def as_they_end(
    executor: Executor,
    function: Callable[[Argument], Result],
    jobs: Iterable[tuple[Key, Argument]],
    workers: int,
    going: dict[Future[Result], Key] | None = None,
) -> Iterator[tuple[Key, Future[Result]]]:
    """Call a function for each job; never more are under way than can be worked on, so that none is begun in vain.

    Parameters
    ----------
    executor
        Where.
    function
        What; for other processes it must be one that pickle finds by its name.
    jobs
        Names of calls, and the argument of each; asked for the next when a worker is free for it.
    workers
        How many calls go side by side.
    going
        Receives what is under way, for whoever must know when he stops before the end.

    Yields
    ------
    tuple
        A call's name, and its finished future.
    """
    waiting, told = iter(jobs), False
    going = {} if going is None else going
    while True:
        for key, argument in islice(waiting, workers - len(going)):
            going[executor.submit(function, argument)] = key
        if not going:
            return
        raise_if_interrupted()
        done = wait(going, QUIET_S, FIRST_COMPLETED).done
        why = "" if told or done else getattr(executor, "why_waiting", str)()
        if why:
            told = True
            print(why, file=sys.stderr, flush=True)
        for future in done:
            yield going.pop(future), future


def perform_each(
    place: Workplace,
    function: Callable[[Argument], Result],
    jobs: Sequence[tuple[Key, Argument]],
    keep: Callable[[Key, Future[Result]], None],
) -> None:
    """Call a function for each job, those whose worker died again.

    Parameters
    ----------
    place
        Where.
    function, jobs
        As `as_they_end`.
    keep
        Called with each name and finished future; has to ask for its result, and to let `BrokenExecutor` through.

    Raises
    ------
    InputError
        If workers die again and again.
    KeyboardInterrupt
        On Ctrl-C, when the workers are gone.
    """
    left, deaths = dict(enumerate(jobs)), 0
    while left:
        before, executor = len(left), place.open()
        try:
            numbered = [(k, argument) for k, (_, argument) in left.items()]
            for k, future in as_they_end(executor, function, numbered, place.workers):
                keep(left[k][0], future)
                del left[k]
        except BrokenExecutor:
            deaths = 1 if len(left) < before else deaths + 1
            _say_death(deaths)
        except BaseException:
            stop_workers()
            raise
        finally:
            # Futures end with their workers; cancelled just then, one would print a traceback.
            executor.shutdown(wait=False)


def _say_death(deaths: int) -> None:
    if deaths > MAX_DEATHS:
        raise InputError(
            f"workers: found that they died {deaths} times in a row (killed, or out of memory), "
            "expected them to keep running; fewer workers need less memory"
        )
    print("a worker died; new ones were started, and their work is repeated", file=sys.stderr, flush=True)


def stop_workers() -> None:
    """End this process's workers at once: nobody wants what they are in the middle of."""
    for worker in multiprocessing.active_children():
        worker.terminate()
