"""gecar beside its peers, in one go on one core: `python -m benchmarks.peers` prints a table and draws docs/peers.png.

Simulation: the same robot, motors, colour sensor and control loop in PyBullet, MuJoCo and plain pymunk, each driven
from Python as their users drive them. Mapping: Table 3's grammar in grape-bds, alogos and finchge. A peer that is not
installed is left out, loudly. Times are of the processor, not of the clock, so that what else the machine does counts
as little as possible.
"""

from __future__ import annotations


def rows() -> list[tuple[str, str, str]]:
    """Measure; each row is a figure, its value and its goal."""
    from benchmarks.peers.measuring import measure  # noqa: PLC0415  `python -m benchmarks` must not load peers to list

    return measure().rows()
