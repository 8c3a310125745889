"""A small random stream for kernels: seeded, without state outside the kernel, the same on every machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from gecar.compiled import kernel

_MEAN = 8 * 127.5  # of eight bytes' sum, whose variance is 8 (256^2 - 1) / 12
_SCALE = (8 * (256**2 - 1) / 12) ** -0.5


@kernel
def bits(holder: Any) -> Any:
    """Return the next 64 random bits: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).

    ``holder`` is a record with the stream's state in its field ``stream`` (uint64).
    """
    holder.stream += np.uint64(0x9E3779B97F4A7C15)
    z = holder.stream
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def uniform(holder: Any) -> float:
    """Return the next number in (0, 1), from the top 53 bits."""
    return (np.float64(bits(holder) >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)


@kernel
def normal(holder: Any) -> float:
    """Return the next number of mean 0 and variance 1, nearly normal: the sum of eight random bytes.

    By the central limit theorem; its kurtosis is 2.85 and it never exceeds 4.9. No library call, so that a reading with
    noise costs hardly more than one without, and is the same on every machine.
    """
    z = bits(holder)
    pairs = (z & np.uint64(0x00FF00FF00FF00FF)) + ((z >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF))
    total = (pairs * np.uint64(0x0001000100010001)) >> np.uint64(
        48
    )  # of the four sums, in the upper sixteen bits
    return (np.float64(total) - _MEAN) * _SCALE
