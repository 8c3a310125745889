"""Sizes in millimetres and degrees, and the size from which something is material."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Size:
    """How far two drives under the same commands part.

    Attributes
    ----------
    mm_1m, deg_1m
        In place [mm] and heading [deg], over one metre, root mean square.
    mm_drive, deg_drive
        The same, over a whole recording.
    reading_pct
        In the colour sensor's reading along the same path, root mean square [%].
    arrival_s
        In the time at which a given program arrives [s]; None: no program was given, or one does not arrive.
    """

    mm_1m: float = 0.0
    deg_1m: float = 0.0
    mm_drive: float = 0.0
    deg_drive: float = 0.0
    reading_pct: float = 0.0
    arrival_s: float | None = None

    def or_more(self, other: Size) -> Size:
        """Return the larger of two, number by number."""
        return combined([self, other])


def combined(sizes: Sequence[Size], of: Callable[[list[float]], float] = max) -> Size:
    """Return the largest of each number of several sizes, or their median, say; `arrival_s` is left out."""
    if not sizes:
        return Size()
    names = [f.name for f in fields(Size) if f.name != "arrival_s"]
    return Size(**{name: float(of([getattr(size, name) for size in sizes])) for name in names})


MM_A_DEGREE, MM_A_PERCENT = 5.0, 2.0  # as far off
DRIVE = 4.0  # a drive of 12 s is about 4 m


@dataclass(frozen=True)
class Material:
    """From what size on something is material.

    A robot whose constants are known to half a percent is 5 mm off after a metre, no more than wear makes. So the
    default is 5 mm over a metre; or 1 degree, which is as far again 0.3 m later; or 2.5 % of a reading.

    Attributes
    ----------
    mm
        Over one metre [mm]; over a whole drive `DRIVE` times as much.
    """

    mm: float = 5.0

    @property
    def deg(self) -> float:
        """Over one metre [deg]."""
        return self.mm / MM_A_DEGREE

    @property
    def reading_pct(self) -> float:
        """Of a reading, root mean square [%]."""
        return self.mm / MM_A_PERCENT

    def times(self, size: Size) -> float:
        """Return how many times the line a size is."""
        motion = max(size.mm_1m, size.mm_drive / DRIVE) / self.mm
        turning = max(size.deg_1m, size.deg_drive / DRIVE) / self.deg
        return max(motion, turning, size.reading_pct / self.reading_pct)


DEFAULT = Material()
