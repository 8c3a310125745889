"""Kinds of physics that no row of the catalogue describes, in sets by who may have met them."""

from __future__ import annotations

from benchmarks.concealed.kinds.final import FINAL
from benchmarks.concealed.kinds.fresh import FRESH
from benchmarks.concealed.kinds.outside import OUTSIDE, Outside
from benchmarks.concealed.kinds.sealed import SEALED
from benchmarks.concealed.kinds.seventh import SEVENTH
from benchmarks.concealed.kinds.sixth import SIXTH
from benchmarks.concealed.kinds.unmet import UNMET

ALL_OUTSIDE: dict[str, Outside] = {**OUTSIDE, **SEALED, **FINAL, **UNMET, **FRESH, **SIXTH, **SEVENTH}

MET = "met"
_KNOWN = {name: kind for name, kind in SEALED.items() if not kind.last}
# Which an examination with a background draws from. Without one, the first two are the kinds met first.
SETS: dict[str, dict[str, Outside]] = {
    MET: {**OUTSIDE, **_KNOWN},
    "last": {**OUTSIDE, **SEALED},  # also those kept for a last examination
    "final": FINAL,  # and no other: had they joined the rest, no seed would draw what it drew before
    "unmet": UNMET,
    "fresh": FRESH,
    "sixth": SIXTH,
    "seventh": SEVENTH,
}
