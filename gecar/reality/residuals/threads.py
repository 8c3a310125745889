"""Threads over recordings: kernels release the interpreter's lock.

Linear algebra runs on one thread beside them. Its matrices are small, and its own threads wait in busy loops: where
other work shared two cores, a discovery took 212 s of processor time with them and 15 s without.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import Self, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

CORES = os.cpu_count() or 1

Item = TypeVar("Item")
Result = TypeVar("Result")


class Threads:
    """Maps a function over recordings: on threads inside a ``with`` block, one after the other outside.

    One thread would only wait for another: handing over took 6 % of a discovery's processor time.

    Parameters
    ----------
    workers
        Number of threads; None: one a core.
    """

    def __init__(self, workers: int | None = None) -> None:
        self._workers = workers or CORES
        self._pool: ThreadPoolExecutor | None = None
        self._limits: threadpool_limits | None = None

    def __enter__(self) -> Self:
        self._pool = ThreadPoolExecutor(self._workers) if self._workers > 1 else None
        self._limits = threadpool_limits(1)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._limits is not None
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
        self._limits.restore_original_limits()
        self._pool = self._limits = None

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Return the function's results, in the order of the items."""
        return list((self._pool.map if self._pool is not None else map)(function, items))
