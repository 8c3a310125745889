"""Runs of a study, each whole in one worker: N workers are N runs side by side, and a run is serial inside.

A run gives what ``gecar evolve`` gives with the same settings and seed, whichever worker performs it.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from functools import partial
from typing import Any

from gecar.errors import InputError
from gecar.results.config import Config
from gecar.results.provenance import versions
from gecar.results.running import load_task, verified_on_pymunk
from gecar.results.study import Planned, StudyFolder
from gecar.search.batches import MAX_DEATHS, Batches
from gecar.search.evolution import Evolution, run
from gecar.search.executors import open_executor, side_by_side
from gecar.search.history import Generation


def perform(config: Config) -> dict[str, Any]:
    """Run an evolution from beginning to end, here and now.

    Returns
    -------
    dict
        What a run's result.json says, its history by column, and the versions of what computed it.
    """
    task = load_task(config)
    evolution = task.evolution()
    with Batches(task.evaluator) as batches:
        run(evolution, batches)
    return {
        **outcome_of(evolution),
        "verified_on_pymunk": verified_on_pymunk(task, evolution),
        "configuration": task.configuration,
        "versions": versions(),
        "config": config.identity,
        "history": dict(
            zip(Generation._fields, map(list, zip(*evolution.history, strict=True)), strict=True)
        ),
    }


def outcome_of(evolution: Evolution) -> dict[str, Any]:
    """Return what a finished evolution came to."""
    best, last = evolution.best, evolution.history[-1]
    return {
        "fitness_s": best.fitness_s,
        "solved": best.solved,
        "program": str(best.program or ""),
        "found_in_generation": best.generation,
        "generations": evolution.generation,
        "evaluations": last.evaluations,
        "distinct_evaluations": last.simulated,
        "simulated_steps": last.steps,
        "wall_s": round(last.wall_s, 3),
        "seed": evolution.seed,
        "genome": best.genome.tolist(),
    }


@dataclass(frozen=True)
class Workplace:
    """Where whole runs are performed.

    Attributes
    ----------
    open
        Makes the executor, and makes it again after a worker died.
    workers
        How many runs go side by side.
    """

    open: Callable[[], Executor]
    workers: int

    @classmethod
    def of(cls, kind: str, workers: int, scheduler: str = "") -> Workplace:
        """Return an executor by kind; see `gecar.search.executors.open_executor`.

        Raises
        ------
        InputError
            If there is no such kind, no worker, or Dask does not answer.
        """
        return cls(partial(open_executor, kind, workers, scheduler), side_by_side(kind, workers, scheduler))


def perform_all(
    runs: Sequence[Planned], folder: StudyFolder, place: Workplace, after: Callable[[Planned], None]
) -> None:
    """Perform runs and keep each as soon as it is finished.

    Parameters
    ----------
    runs
        What is still to do.
    folder
        Where they are kept.
    place
        Where they are performed.
    after
        Called with each, once it is kept.

    Raises
    ------
    InputError
        If a file can not be written, or workers die again and again.
    KeyboardInterrupt
        On Ctrl-C, when the workers are gone; what was finished is kept.
    """
    left, deaths = list(runs), 0
    while left:
        before = len(left)
        executor = place.open()
        try:
            _attempt(left, folder, executor, place.workers, after)
        except BrokenExecutor:
            deaths = 1 if len(left) < before else deaths + 1
            _say_death(deaths)
        except BaseException:
            _stop_workers()
            raise
        finally:
            executor.shutdown(wait=False, cancel_futures=True)


def _attempt(
    left: list[Planned],
    folder: StudyFolder,
    executor: Executor,
    side_by_side: int,
    after: Callable[[Planned], None],
) -> None:
    """Perform runs until none is left or a worker dies; those kept are taken off ``left``."""
    waiting = iter(list(left))
    going: dict[Future[dict[str, Any]], Planned] = {}
    while left:
        while len(going) < side_by_side and (planned := next(waiting, None)) is not None:
            going[executor.submit(perform, planned.config)] = planned
        for future in wait(going, return_when=FIRST_COMPLETED).done:
            planned = going.pop(future)
            folder.keep(planned, future.result())
            left.remove(planned)
            after(planned)


def _say_death(deaths: int) -> None:
    if deaths > MAX_DEATHS:
        raise InputError(
            f"workers: found that they died {deaths} times in a row (killed, or out of memory), "
            "expected them to live; fewer workers need less memory"
        )
    print("a worker died; started new ones, and its run begins again", file=sys.stderr, flush=True)


def _stop_workers() -> None:
    """End this process's workers at once: nobody wants what they are in the middle of."""
    for worker in multiprocessing.active_children():
        worker.terminate()
