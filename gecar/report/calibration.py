"""A calibration in words, and as a table for JSON."""

from __future__ import annotations

from typing import Any

from gecar.reality.calibrate.calibration import Calibration, FittedConstant
from gecar.reality.calibrate.identifiability import BLIND
from gecar.reality.verdict import Misfit


def calibration_lines(result: Calibration) -> list[str]:
    """Say what was fitted, what the recordings cannot determine, and the misfit on held-out recordings."""
    lines = [fitted_line(fitted) for fitted in result.fitted]
    lines += [
        f"{u.constant.name} stays {_number(u.nominal, u.constant.unit)}: {u.why}."
        for u in result.unknown
        if u.why != BLIND
    ]
    blind = ", ".join(u.constant.name for u in result.unknown if u.why == BLIND)
    if blind:
        lines.append(f"Not identifiable, {BLIND.replace(' it', ' them')}: {blind}.")
    if result.channels:
        where = (
            "the held-out part" if result.by_time else f"the held-out recordings ({', '.join(result.held)})"
        )
        lines.append(f"NRMSE on {where}, before and after: {channels_words(result)}.")
    if result.worse:
        lines.append(
            f"There the new constants are worse in {', '.join(result.worse)}: check them before use."
        )
    if result.unexplained:
        lines.append(
            f"Constants do not explain the misfit in {', '.join(result.unexplained)}: the simulation lacks "
            "physics that these constants do not describe. `gecar discover` searches for it."
        )
    return lines


def fitted_line(fitted: FittedConstant) -> str:
    """Return a constant's old and new value, with the 95 % interval."""
    unit = fitted.constant.unit
    interval = f"{fitted.rounded(fitted.low)} to {fitted.rounded(fitted.high)}"
    return (
        f"{fitted.constant.name}: {_number(fitted.nominal, unit)} -> "
        f"{fitted.rounded(fitted.value)}{_of(unit)} (95 %: {interval})"
    )


def channels_words(result: Calibration) -> str:
    """Return the misfits on the held-out recordings, column by column."""
    return ", ".join(f"{name} {m.before:.4f} -> {m.after:.4f}" for name, m in result.channels.items())


def _number(value: float, unit: str) -> str:
    return f"{value:g}{_of(unit)}"


def _of(unit: str) -> str:
    return "" if unit == "-" else f" {unit}"


def calibration_table(result: Calibration) -> dict[str, Any]:
    """Return a calibration's figures, ready for JSON."""
    return {
        "case": result.case,
        "robot": result.robot.name,
        "fitted_on": list(result.fitted_on),
        "constants": {
            f.constant.name: {
                "nominal": f.nominal, "value": f.value, "low": f.low, "high": f.high, "unit": f.constant.unit,
            }
            for f in result.fitted
        },
        "not_identifiable": {
            u.constant.name: {"nominal": u.nominal, "unit": u.constant.unit, "why": u.why} for u in result.unknown
        },
        "holdout": {
            "recordings": list(result.held),
            "by_time": result.by_time,
            "channels": {name: _misfit(m) for name, m in result.channels.items()},
            "worse": list(result.worse), "unexplained": list(result.unexplained),
        },
        "recordings": {
            name: {column: _misfit(m) for column, m in columns.items()} for name, columns in result.recordings.items()
        },
    }  # fmt: skip


def _misfit(misfit: Misfit) -> dict[str, float]:
    return {"before": misfit.before, "after": misfit.after, "floor": misfit.floor}
