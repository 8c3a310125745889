"""Sine, cosine and exponential by series: no library call in a kernel's inner loop, and the same bits everywhere.

Compilers can run such functions for several lanes at once, which they cannot do with a call.
"""

from __future__ import annotations

import math

from gecar.compiled import kernel

_PI_HIGH = 3.141592653589793  # pi as a double, and what that leaves out
_PI_LOW = 1.2246467991473532e-16


@kernel
def small_sine(angle: float) -> float:
    """Return the sine of an angle [rad] under 0.1, with an error below 1e-16."""
    a2 = angle * angle
    return angle * (1.0 + a2 * (-1.0 / 6.0 + a2 * (1.0 / 120.0 + a2 * (-1.0 / 5040.0))))


@kernel
def small_cosine(angle: float) -> float:
    """Return the cosine of an angle [rad] under 0.1, with an error below 1e-16."""
    a2 = angle * angle
    return 1.0 + a2 * (-1.0 / 2.0 + a2 * (1.0 / 24.0 + a2 * (-1.0 / 720.0 + a2 * (1.0 / 40320.0))))


@kernel
def sine(angle: float) -> float:
    """Return the sine of any angle [rad] under 1e6, with an error below 1e-15 for those under 100.

    The angle less a multiple of pi, and Taylor's series to the 19th power.
    """
    turns = math.floor(angle * (1.0 / math.pi) + 0.5)
    a = (angle - turns * _PI_HIGH) - turns * _PI_LOW
    a2 = a * a
    total = -1.0 / 121645100408832000.0
    total = total * a2 + 1.0 / 355687428096000.0
    total = total * a2 - 1.0 / 1307674368000.0
    total = total * a2 + 1.0 / 6227020800.0
    total = total * a2 - 1.0 / 39916800.0
    total = total * a2 + 1.0 / 362880.0
    total = total * a2 - 1.0 / 5040.0
    total = total * a2 + 1.0 / 120.0
    total = total * a2 - 1.0 / 6.0
    value = a + a * a2 * total
    return value if turns == 2.0 * math.floor(0.5 * turns) else -value


@kernel
def decay(x: float) -> float:
    """Return exp(-x) for x >= 0, with a relative error below 1e-14; 0 beyond x = 40.

    Taylor's series at x / 64, to the 13th power, squared six times.
    """
    a = -min(x, 40.0) * (1.0 / 64.0)
    total = 1.0 + a * (1.0 / 13.0)
    total = 1.0 + a * (1.0 / 12.0) * total
    total = 1.0 + a * (1.0 / 11.0) * total
    total = 1.0 + a * (1.0 / 10.0) * total
    total = 1.0 + a * (1.0 / 9.0) * total
    total = 1.0 + a * (1.0 / 8.0) * total
    total = 1.0 + a * (1.0 / 7.0) * total
    total = 1.0 + a * (1.0 / 6.0) * total
    total = 1.0 + a * (1.0 / 5.0) * total
    total = 1.0 + a * (1.0 / 4.0) * total
    total = 1.0 + a * (1.0 / 3.0) * total
    total = 1.0 + a * (1.0 / 2.0) * total
    total = 1.0 + a * total
    total *= total
    total *= total
    total *= total
    total *= total
    total *= total
    total *= total
    return total if x <= 40.0 else 0.0
