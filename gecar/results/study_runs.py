"""Runs of a study, each whole in one worker: N workers are N runs side by side, and a run is serial inside.

A run gives what ``gecar evolve`` gives with the same settings and seed, whichever worker performs it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from gecar.evolution.ask_tell import run
from gecar.evolution.history import Generation
from gecar.parallel.run_parallel import Workplace, perform_each
from gecar.results.config import Config
from gecar.results.folder import outcome_of
from gecar.results.provenance import versions
from gecar.results.run import choose, load_task, measured
from gecar.results.study import Planned, StudyFolder
from gecar.search.batches import Batches


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
    choose(task, evolution)
    return {
        **outcome_of(evolution),
        **measured(task, evolution),
        "configuration": task.configuration,
        "versions": versions(),
        "config": config.identity,
        "history": dict(
            zip(Generation._fields, map(list, zip(*evolution.history, strict=True)), strict=True)
        ),
    }


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
        If a file cannot be written, or workers die again and again.
    KeyboardInterrupt
        On Ctrl-C, when the workers are gone; what was finished is kept.
    """

    def keep(planned: Planned, future: Future[dict[str, Any]]) -> None:
        folder.keep(planned, future.result())
        after(planned)

    perform_each(place, perform, [(planned, planned.config) for planned in runs], keep)
