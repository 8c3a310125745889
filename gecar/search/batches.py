"""Programs cut into batches, run on an executor, and run again where a worker died."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import suppress
from types import TracebackType
from typing import Self

import numpy as np

from gecar.errors import InputError
from gecar.evolution.scores import Scores
from gecar.evolution.state import Candidate
from gecar.language.opcodes import N_COLUMNS
from gecar.language.program import Program
from gecar.parallel.executors import MAX_DEATHS, QUIET_S, SerialExecutor
from gecar.parallel.pickled import pickled
from gecar.parallel.run_parallel import stop_workers
from gecar.search.evaluation import Batch, Evaluator, Scored, score_batch

LONGEST_S = 0.1
"""Longest batch aimed at: long enough that sending it costs nothing, short enough to share work evenly."""
SHORTEST_S = 0.002
"""Shortest batch aimed at: sending one through a process pool costs about 0.2 ms."""

_EMPTY = np.zeros((0, N_COLUMNS), np.int32)


class Batches:
    """Scores programs on an executor. The scores depend on the programs alone, not on how they are cut or run.

    Parameters
    ----------
    evaluator
        What scores a program.
    open_executor
        Makes the executor, and makes it again after a worker died.
    workers
        How many batches the executor runs side by side.
    shortest_s
        Shortest batch aimed at [s].
    """

    def __init__(
        self,
        evaluator: Evaluator,
        open_executor: Callable[[], Executor] = SerialExecutor,
        workers: int = 1,
        shortest_s: float = SHORTEST_S,
    ) -> None:
        self.workers = workers
        self.busy_s = 0.0
        self._evaluator = pickled(evaluator)
        self._open = open_executor
        self._executor: Executor | None = None
        self._shortest_s = shortest_s
        self._each_s = 0.001  # a guess, until the first batch has been timed

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            stop_workers()  # one that a Ctrl-C ended as it started may hold what another waits for
        self.close()

    def warm(self) -> None:
        """Start the workers and let each load what it needs, before the clock runs."""
        self._run([Batch([_EMPTY], [0])] * self.workers)

    def __call__(self, candidates: Sequence[Candidate[Program]]) -> Scores:
        """Return a score for each candidate.

        Raises
        ------
        InputError
            If workers die again and again.
        """
        done = self._run([_batch(candidates[piece]) for piece in self._cut(len(candidates))])
        seconds = sum(scored.seconds for scored in done)
        self.busy_s += seconds
        if candidates:
            self._each_s = max(seconds / len(candidates), 1e-6)
        return np.concatenate([scored.scores for scored in done])

    def close(self) -> None:
        """Let the workers go; what they still do is dropped."""
        if self._executor is not None:
            self._executor.shutdown(wait=False)
            self._executor = None

    def _cut(self, n: int) -> list[slice]:
        """Cut n programs: large batches first and small ones last, so that all workers finish together."""
        if self.workers == 1 or n == 0:
            return [slice(0, n)]
        smallest = max(1, round(self._shortest_s / self._each_s))
        largest = max(1, int(LONGEST_S / self._each_s))
        pieces, begin = [], 0
        while begin < n:
            share = math.ceil((n - begin) / (1.5 * self.workers))
            end = min(begin + min(max(share, smallest), largest), n)
            pieces.append(slice(begin, end))
            begin = end
        return pieces

    def _run(self, batches: list[Batch]) -> list[Scored]:
        """Run the batches, those that were lost with their worker again; in the order given."""
        done: dict[int, Scored] = {}
        deaths = 0
        while len(done) < len(batches):
            lost = [k for k in range(len(batches)) if k not in done]
            finished = self._attempt({k: batches[k] for k in lost})
            done |= finished
            if len(done) < len(batches):
                deaths = 1 if finished else deaths + 1
                self._recover(len(batches) - len(done), deaths)
        return [done[k] for k in range(len(batches))]

    def _attempt(self, batches: dict[int, Batch]) -> dict[int, Scored]:
        """Run batches; return those whose worker lived."""
        if self._executor is None:
            self._executor = self._open()
        futures: dict[int, Future[Scored]] = {}
        done: dict[int, Scored] = {}
        with suppress(BrokenExecutor):  # batches not sent are lost like those of the worker that died
            for k, batch in batches.items():
                futures[k] = self._executor.submit(score_batch, self._evaluator, batch)
        try:
            for k, future in futures.items():
                with suppress(BrokenExecutor):
                    done[k] = self._await(future)
        finally:
            for future in futures.values():  # after Ctrl-C nobody wants the rest; those done do not mind
                future.cancel()
        return done

    def _await(self, future: Future[Scored]) -> Scored:
        """Wait for a batch; say so, once, if nobody is there to run it."""
        told = False
        while not future.done():
            wait([future], timeout=QUIET_S)
            why = "" if told or future.done() else getattr(self._executor, "why_waiting", str)()
            if why:
                told = True
                print(why, file=sys.stderr, flush=True)
        return future.result()

    def _recover(self, lost: int, deaths: int) -> None:
        self.close()
        if deaths > MAX_DEATHS:
            raise InputError(
                f"workers: found that they died {deaths} times in a row (killed, or out of memory), "
                "expected them to keep running; fewer workers need less memory"
            )
        batches = "batch" if lost == 1 else "batches"
        print(
            f"a worker died; new ones were started, and {lost} lost {batches} run again",
            file=sys.stderr,
            flush=True,
        )


def _batch(candidates: Sequence[Candidate[Program]]) -> Batch:
    """Pack candidates; those of one generation have the same merit to beat."""
    to_beat_s, generation = (candidates[0].to_beat, candidates[0].generation) if candidates else (math.inf, 0)
    return Batch([c.program.opcodes for c in candidates], [c.seed for c in candidates], to_beat_s, generation)
