"""A small random stream for kernels: seeded, without state outside the kernel, the same on every machine."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled


@compiled
def uniform(stream: npt.NDArray[np.uint64]) -> float:
    """Return the next number in (0, 1): SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), the top 53 bits."""
    stream[0] += np.uint64(0x9E3779B97F4A7C15)
    z = stream[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return (np.float64(z >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)  # type: ignore[no-any-return]


@compiled
def normal(stream: npt.NDArray[np.uint64]) -> float:
    """Return the next standard normal number, by Box and Muller."""
    radius = math.sqrt(-2.0 * math.log(uniform(stream)))
    return radius * math.cos(2.0 * math.pi * uniform(stream))
