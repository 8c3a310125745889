"""Two ways of doing the same, timed in turn."""

from __future__ import annotations

import time
from collections.abc import Callable


def times_longer(one: Callable[[], object], other: Callable[[], object], repeats: int) -> float:
    """Return how many times longer one way takes than the other: shortest times of many, taken in turn."""
    shortest = [float("inf"), float("inf")]
    for _ in range(repeats):
        for which, way in enumerate((one, other)):
            start = time.perf_counter()
            way()
            shortest[which] = min(shortest[which], time.perf_counter() - start)
    return shortest[0] / shortest[1]
