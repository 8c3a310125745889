"""What a law's variables were while recordings were made: as the simulated robot had them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.kernel import (
    AHEAD,
    ASIDE,
    BATTERY,
    HEADING,
    LEFT_ANGLE,
    LEFT_SPEED,
    RIGHT_ANGLE,
    RIGHT_SPEED,
    YAW_RATE,
    X,
    Y,
)
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]


def states(run: RecordingResiduals, physics: Physics, term: Term) -> dict[str, Array]:
    """Return the variables of laws at every row, of the left and the right wheel, shape (rows, 2) each.

    ``load`` is the static one, ``slip`` 0: a replay does not keep them.
    """
    rows, t, p = run.replayer.play(physics).rows, run.replayer.t, physics[0]

    def both(values: Any) -> Array:
        return np.broadcast_to(np.asarray(values, float).reshape(len(t), -1), (len(t), 2)).copy()

    speed, angle = rows[:, [LEFT_SPEED, RIGHT_SPEED]], rows[:, [LEFT_ANGLE, RIGHT_ANGLE]]
    cap = run.recording.setup.duty_cap or float(p["duty_cap"])
    command = np.clip(run.recording.commands, -cap, cap)
    volts = both(rows[:, BATTERY])
    found = {
        "time": both(t), "command": command, "voltage": volts, "angle": angle, "speed": speed,
        "current": (command * volts - p["back_emf_constant"] * speed) / p["resistance"],
        "load": both(np.full(len(t), 0.5 * p["mass"] * 9.81 * (1.0 - p["com_ahead"] / p["caster_ahead"]))),
        "slip": np.zeros_like(speed), "other_angle": angle[:, ::-1], "other_speed": speed[:, ::-1],
        "other_command": command[:, ::-1], "side": np.tile((-1.0, 1.0), (len(t), 1)),
        "ahead": both(rows[:, AHEAD]), "aside": both(rows[:, ASIDE]),
        "turn_rate": both(rows[:, YAW_RATE]), "x": both(rows[:, X]), "y": both(rows[:, Y]),
        "heading": both(rows[:, HEADING]),
    }  # fmt: skip
    found["draw"] = both(np.sum(np.maximum(command * found["current"], 0.0), axis=1))
    reading = run.recording.reflection_pct
    found["reading"] = both(np.where(np.isnan(reading), 0.0, reading))
    at = term.constants.get("at_x", 0.0), term.constants.get("at_y", 0.0)
    found["distance"] = np.hypot(found["x"] - at[0], found["y"] - at[1])
    found["store"] = _filled(term, found, t)
    return found


def _filled(term: Term, found: Mapping[str, Array], t: Array) -> Array:
    from scipy.signal import lfilter  # noqa: PLC0415  a quarter of a second of a command's start

    if not term.store:
        return np.zeros((len(t), 2))
    filling = Term(**{**term.as_table(), "law": term.store, "side": "both"})
    step_s = float(np.median(np.diff(t)))
    if not term.of_itself:
        keep = float(np.exp(-step_s / term.store_s))
        out: Array = lfilter([1.0 - keep], [1.0, -keep], filling.value(found), axis=0)
        return out
    stored, share = np.zeros((len(t) + 1, 2)), min(step_s / term.store_s, 1.0)
    for k in range(len(t)):
        row = {name: values[k] for name, values in found.items()}
        stored[k + 1] = stored[k] + share * (filling.value({**row, "store": stored[k]}) - stored[k])
    return stored[1:]


def ranges(
    term: Term, runs: Sequence[RecordingResiduals], physics: Physics
) -> dict[str, tuple[float, float]]:
    """Return from where to where each variable of a law went in the recordings."""
    tables = [states(run, physics, term) for run in runs]
    return {
        name: (min(float(t[name].min()) for t in tables), max(float(t[name].max()) for t in tables))
        for name in term.parsed.variables
    }
