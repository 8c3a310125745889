"""Random streams for kernels: seeded, without state outside the kernel, the same on every machine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled, kernel


@kernel
def uniform(holder: Any) -> float:
    """Return the next number in (0, 1): SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), the top 53 bits.

    ``holder`` is a record with the stream's state in its field ``stream`` (uint64).
    """
    holder.stream += np.uint64(0x9E3779B97F4A7C15)
    z = holder.stream
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return (np.float64(z >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)


@kernel
def normal(holder: Any) -> float:
    """Return the next standard normal number, by Box and Muller."""
    radius = math.sqrt(-2.0 * math.log(uniform(holder)))
    return radius * math.cos(2.0 * math.pi * uniform(holder))


STREAM = np.dtype([("stream", np.uint64)])
Streams = npt.NDArray[np.void]


def spawn(seed: int, generation: int, attempt: int, n: int) -> Streams:
    """Return the streams of n individuals.

    Parameters
    ----------
    seed
        The run's seed.
    generation
        Generation they are bred for.
    attempt
        How often the generation was bred before.
    n
        How many; the first ones are the same for any n.

    Returns
    -------
    numpy.ndarray
        Dtype `STREAM`, shape (n,): starting points of SplitMix64, spread by NumPy's SeedSequence.
    """
    words = np.random.SeedSequence([seed, generation, attempt]).generate_state(n, np.uint64)
    return words.view(STREAM)


@compiled
def below(holder: Any, n: int) -> int:
    """Return a whole number 0..n-1 from a stream, each as likely as the others to 2**-53 n."""
    return int(uniform(holder) * n)
