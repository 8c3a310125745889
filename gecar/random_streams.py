"""Random streams for kernels: seeded, without state outside the kernel, the same on every machine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled, kernel

LARGEST_NORMAL = 8.3
"""No `normal` number is larger or below its negative: uniform ones are half of 2^-53 away from 0 and 1 or more."""

_STRIDE = np.uint64(0x9E3779B97F4A7C15)


@kernel
def uniform(holder: Any) -> float:
    """Return the next number in (0, 1): SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), the top 53 bits.

    ``holder`` is a record with the stream's state in its field ``stream`` (uint64).
    """
    holder.stream += _STRIDE
    z = holder.stream
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return (np.float64(z >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)


@kernel
def normal(holder: Any) -> float:
    """Return the next standard normal number: the normal distribution's inverse, of one uniform number."""
    return normal_quantile(uniform(holder))


@kernel
def normal_bound(u: float) -> float:
    """Return a number that `normal_quantile` of u does not exceed, nor pass below where it is negative."""
    most = 3.2 if 0.0007 < u < 0.9993 else LARGEST_NORMAL
    return most if u > 0.5 else -most


@kernel
def normal_quantile(u: float) -> float:
    """Return the number below which a standard normal one lies with probability u, 0 < u < 1, to 1e-15.

    Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37(3), 1988; seven draws in eight need no library call.
    """
    q = u - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        above = 3.3430575583588128105e4 + r * 2.5090809287301226727e3
        above = 4.5921953931549871457e4 + r * (6.7265770927008700853e4 + r * above)
        above = 1.9715909503065514427e3 + r * (1.3731693765509461125e4 + r * above)
        above = 3.3871328727963666080e0 + r * (1.3314166789178437745e2 + r * above)
        below = 2.8729085735721942674e4 + r * 5.2264952788528545610e3
        below = 2.1213794301586595867e4 + r * (3.9307895800092710610e4 + r * below)
        below = 6.8718700749205790830e2 + r * (5.3941960214247511077e3 + r * below)
        below = 1.0 + r * (4.2313330701600911252e1 + r * below)
        return q * above / below
    r = math.sqrt(-math.log(min(u, 1.0 - u)))
    if r <= 5.0:
        r -= 1.6
        above = 2.27238449892691845833e-2 + r * 7.74545014278341407640e-4
        above = 1.27045825245236838258e0 + r * (2.41780725177450611770e-1 + r * above)
        above = 5.76949722146069140550e0 + r * (3.64784832476320460504e0 + r * above)
        above = 1.42343711074968357734e0 + r * (4.63033784615654529590e0 + r * above)
        below = 5.47593808499534494600e-4 + r * 1.05075007164441684324e-9
        below = 1.48103976427480074590e-1 + r * (1.51986665636164571966e-2 + r * below)
        below = 1.67638483018380384940e0 + r * (6.89767334985100004550e-1 + r * below)
        below = 1.0 + r * (2.05319162663775882187e0 + r * below)
    else:
        r -= 5.0
        above = 2.71155556874348757815e-5 + r * 2.01033439929228813265e-7
        above = 2.65321895265761230930e-2 + r * (1.24266094738807843860e-3 + r * above)
        above = 1.78482653991729133580e0 + r * (2.96560571828504891230e-1 + r * above)
        above = 6.65790464350110377720e0 + r * (5.46378491116411436990e0 + r * above)
        below = 1.42151175831644588870e-7 + r * 2.04426310338993978564e-15
        below = 7.86869131145613259100e-4 + r * (1.84631831751005468180e-5 + r * below)
        below = 1.36929880922735805310e-1 + r * (1.48753612908506148525e-2 + r * below)
        below = 1.0 + r * (5.99832206555887937690e-1 + r * below)
    tail = above / below
    return -tail if q < 0.0 else tail


STREAM = np.dtype([("stream", np.uint64)])
Streams = npt.NDArray[np.void]


def spawn(seed: int, generation: int, attempt: int, n: int) -> Streams:
    """Return the streams of n individuals.

    Parameters
    ----------
    seed
        The run's seed.
    generation
        Number of the generation.
    attempt
        How often the generation was drawn before.
    n
        How many; the first ones are the same for any n.

    Returns
    -------
    numpy.ndarray
        Dtype `STREAM`, shape (n,): starting points of SplitMix64, spread by NumPy's SeedSequence.
    """
    words = np.random.SeedSequence([seed, generation, attempt]).generate_state(n, np.uint64)
    return words.view(STREAM)


def generators(streams: Streams) -> list[np.random.Generator]:
    """Return a NumPy generator from each stream; the streams go on, so that the next call gives others."""
    with np.errstate(over="ignore"):
        streams["stream"] += _STRIDE
    return [np.random.default_rng(state) for state in streams["stream"].tolist()]


@compiled
def below(holder: Any, n: int) -> int:
    """Return a whole number 0..n-1 from a stream, each as likely as the others to 2**-53 n."""
    return int(uniform(holder) * n)
