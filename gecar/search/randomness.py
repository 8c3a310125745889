"""Random streams, one for each individual: what is drawn for one never depends on another, or on workers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.world.randomness import uniform

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
