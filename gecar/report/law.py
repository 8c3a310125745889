"""An invented law in words, and typeset."""

from __future__ import annotations

from gecar.reality.verdict import Invented
from gecar.world.ports import BY_PORT, VARIABLES

_UNITS = {variable.id: variable.unit for variable in VARIABLES}


def law_sentence(law: Invented) -> str:
    """Return a law in words: what it resembles, its formula, where it is known, and its alternatives."""
    words = f"{law.looks_like[0].upper()}{law.looks_like[1:]}: {law.term.typeset}"
    words += f" ({_constants(law)}). It moves the robot by {_moved(law)}."
    known = ", ".join(
        f"{name} from {low:.3g} to {high:.3g}{_unit(name)}" for name, (low, high) in law.range.items()
    )
    if known:
        words += f" It was tested for {known}; beyond that it is an extrapolation."
    if law.alternatives:
        others = " or ".join(dict.fromkeys(f"{BY_PORT[t.port].title}, {t.typeset}" for t in law.alternatives))
        words += f" These recordings cannot distinguish it from {others}."
    return words


def _constants(law: Invented) -> str:
    return ", ".join(f"{i.value:.3g} within {i.low:.3g} to {i.high:.3g}" for i in law.parameters.values())


def _moved(law: Invented) -> str:
    size = law.size
    if size.reading_pct and not size.mm_1m:
        return f"{size.reading_pct:.1f} % of a reading"
    return f"{size.mm_1m:.1f} mm and {size.deg_1m:.1f} degrees over a metre"


def _unit(variable: str) -> str:
    return "" if _UNITS[variable] == "-" else f" {_UNITS[variable]}"
