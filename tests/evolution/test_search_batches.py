"""Batches on executors: the same scores whoever computes them, and whoever dies meanwhile."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.searching import MAPPER, SMALL, Toy, fingerprint, generations, new_evolution, toy_scores

from gecar.errors import InputError
from gecar.evolution.ask_tell import run
from gecar.evolution.scores import UNSOLVED, Scores
from gecar.evolution.state import Candidate
from gecar.language.program import parse_program
from gecar.parallel.executors import SerialExecutor, check_workers, open_executor
from gecar.parallel.pickled import pickled, unpickled
from gecar.search import batches as batches_module
from gecar.search.batches import Batches
from gecar.search.evaluation import DriveEvaluator, Opcodes
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World, simulate

PROCESSES = partial(open_executor, "process", 2)
WORLD = World(load_robot("ev3"), load_course("paper"), time_limit_s=4.0)
FIG_6 = "if(SensorValue > 80):\n    motor(80,80,50)\nelse:\n    motor(80,0,160)"


@dataclass(frozen=True)
class Mortal:
    """A toy evaluator that kills its process, once or always."""

    mark: Path
    always: bool = False

    def __call__(
        self, programs: Sequence[Opcodes], _seeds: Sequence[int], _to_beat_s: float, _generation: int
    ) -> Scores:
        if programs and (self.always or not self.mark.exists()):
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return toy_scores(programs)


@dataclass(frozen=True)
class Faulty:
    """An evaluator with a fault."""

    def __call__(
        self, _programs: Sequence[Opcodes], _seeds: Sequence[int], _to_beat_s: float, _generation: int
    ) -> Scores:
        raise ZeroDivisionError


@pytest.fixture(scope="module")
def processes() -> Iterator[Batches]:
    """Two processes that drive, once for all tests here."""
    with Batches(DriveEvaluator(WORLD), PROCESSES, 2) as batches:
        yield batches


def evolved(score: Batches | Toy) -> tuple[object, ...]:
    evolution = new_evolution(SMALL.model_copy(update={"codons": 200}), MAPPER)
    run(evolution, score)
    return fingerprint(evolution)


def test_processes_threads_and_the_serial_path_evolve_the_same(processes: Batches) -> None:
    with Batches(DriveEvaluator(WORLD), partial(ThreadPoolExecutor, 3), 3) as threads:
        assert evolved(Batches(DriveEvaluator(WORLD))) == evolved(processes) == evolved(threads)


def test_noise_goes_by_run_and_program_not_by_worker() -> None:
    noisy = DriveEvaluator(World(WORLD.robot, WORLD.course, time_limit_s=4.0, noise=Noise(5.0, 0.1)))
    with Batches(noisy, partial(ThreadPoolExecutor, 2), 2, shortest_s=0.0) as threads:
        assert evolved(Batches(noisy)) == evolved(threads) != evolved(Batches(DriveEvaluator(WORLD)))


def test_a_killed_worker_is_replaced_and_its_batches_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Batches(Mortal(tmp_path / "mark"), PROCESSES, 2) as batches:
        assert evolved(batches) == evolved(Toy())
    words = capsys.readouterr().err
    assert words.startswith("a worker died; new ones were started, and ")
    assert words.count("\n") == 1


def test_workers_that_die_again_and_again_end_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batches_module, "MAX_DEATHS", 1)
    with (
        Batches(Mortal(tmp_path / "mark", always=True), PROCESSES, 2) as batches,
        pytest.raises(InputError) as error,
    ):
        evolved(batches)
    assert str(error.value).startswith("workers: found that they died 2 times in a row")


def test_only_lost_batches_run_again() -> None:
    calls: list[int] = []

    class Breaking(SerialExecutor):
        def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
            calls.append(len(args[1].programs))
            if len(calls) == 3:
                raise BrokenExecutor
            return super().submit(fn, *args, **kwargs)

    asked = new_evolution(SMALL, MAPPER).ask()
    with Batches(toy_scores, Breaking, 2) as batches:
        pieces = len(batches._cut(len(asked)))
        assert np.array_equal(batches(asked), toy_scores([c.program.opcodes for c in asked]))
    assert pieces > 3
    assert len(calls) - 3 == pieces - 2  # the two before the third were sent once
    assert sum(calls) - calls[2] == len(asked)


def test_an_error_in_an_evaluation_is_not_taken_for_a_death() -> None:
    with Batches(Faulty()) as batches, pytest.raises(ZeroDivisionError):
        evolved(batches)


@given(st.integers(0, 2_000), st.integers(1, 64), st.floats(1e-6, 10.0))
@settings(deadline=None, max_examples=100)
def test_programs_are_cut_without_gap_into_batches_worth_sending(n: int, workers: int, each_s: float) -> None:
    batches = Batches(toy_scores, workers=workers)
    batches._each_s = each_s
    pieces = batches._cut(n)
    assert [i for piece in pieces for i in range(n)[piece]] == list(range(n))
    sizes = [len(range(n)[piece]) for piece in pieces]
    assert workers == 1 or max(sizes) == 1 or max(sizes) * each_s <= 0.1 + 1e-9
    assert sizes[:-1] == sorted(sizes[:-1], reverse=True)


def test_scores_are_those_of_the_drive_and_of_eq_1() -> None:
    solved, failed = (parse_program(text).opcodes for text in (FIG_6, "motor(50,50,100)"))
    world = World(WORLD.robot, WORLD.course)
    scores = DriveEvaluator(world, keep_arrivals=True)([solved, failed], [0, 0])
    drives = [simulate(world, opcodes) for opcodes in (solved, failed)]
    assert scores["fitness_s"].tolist() == [
        drives[0].time_s if drives[0].outcome == 1 else UNSOLVED,
        UNSOLVED,
    ]
    assert scores["checkpoints"].tolist() == [drive.checkpoints for drive in drives]
    assert np.array_equal(scores["arrival_s"], [drive.arrival_s for drive in drives], equal_nan=True)
    assert 0.0 <= scores["share"][1] < scores["share"][0] <= 1.0


def test_a_world_travels_without_its_raster_and_drives_the_same() -> None:
    evaluator = DriveEvaluator(WORLD)
    opcodes = parse_program(FIG_6).opcodes
    score = evaluator([opcodes], [0])
    packed = pickled(evaluator)
    assert len(packed.content) < 20_000
    assert np.array_equal(unpickled(packed)([opcodes], [0]), score)
    assert unpickled(packed) is unpickled(packed)


@pytest.mark.parametrize("workers", [0, -1, 100_000])
def test_no_workers_and_too_many_are_refused(workers: int) -> None:
    with pytest.raises(InputError, match=f"workers: found {workers}, expected a whole number from 1 to 1024"):
        check_workers(workers)


def test_an_unknown_executor_is_refused() -> None:
    with pytest.raises(InputError, match="executor: found 'cloud', expected process, thread, serial or dask"):
        open_executor("cloud", 2)


def test_a_candidate_is_a_program_and_a_seed_below_two_to_the_64() -> None:
    candidates: list[Candidate] = generations(new_evolution(SMALL, MAPPER), 1).ask()
    assert all(0 <= candidate.seed < 2**64 for candidate in candidates)
    assert len({candidate.seed for candidate in candidates}) == len(candidates)


def test_that_nobody_is_left_to_run_a_batch_is_told_once(monkeypatch, capsys) -> None:  # type: ignore[no-untyped-def]
    class Deserted(SerialExecutor):
        def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
            self.result, self.answer = super().submit(fn, *args, **kwargs).result(), Future()
            return self.answer

        def why_waiting(self) -> str:
            threading.Timer(0.1, self.answer.set_result, [self.result]).start()
            return "no worker is left"

    monkeypatch.setattr(batches_module, "QUIET_S", 0.02)
    asked = new_evolution(SMALL, MAPPER).ask()
    scores = Batches(toy_scores, Deserted)(asked)
    assert np.array_equal(scores, toy_scores([c.program.opcodes for c in asked]))
    assert capsys.readouterr().err == "no worker is left\n"
