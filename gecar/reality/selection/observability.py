"""Which effects of the catalogue a set of recordings can show at all, by what each needs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gecar.reality.residuals.of_case import Residuals
from gecar.world.effects import Effect
from gecar.world.kernel.motor import FULL_DUTY


def observable(catalogue: Sequence[Effect], residuals: Residuals) -> tuple[str, ...]:
    """Return the effects that residuals of motion, or of the colour sensor, can show.

    Where a start pose was found from the readings themselves, a shifted line is another start: it needs a pose.
    """
    there = _available(residuals)
    return tuple(
        effect.id
        for effect in catalogue
        if effect.of_sensor == residuals.sensor
        and there.issuperset(effect.needs)
        and not (residuals.follow_encoders and _turns_wheels(effect))
    )


def _turns_wheels(effect: Effect) -> bool:
    """Whether an effect changes how the wheels turn, which says nothing where they turn as the encoders say."""
    return "motor" in effect.channels or "pose" not in effect.channels


def _available(residuals: Residuals) -> set[str]:
    """Return what recordings have of what effects may need (`Effect.needs`)."""
    recordings = [r.recording for r in residuals.recordings]
    duties = np.concatenate([r.commands.ravel() for r in recordings])
    found = {
        "floor": any(r.setup.rig != "bench" for r in recordings),
        "bench": all(r.setup.rig == "bench" for r in recordings),
        "pose": any(r.replayer.has_poses for r in residuals.recordings),
        "two motors": any(
            not np.isnan(r.left_duty).all() and not np.isnan(r.right_duty).all() for r in recordings
        ),
        "both directions": bool(duties.min() < 0.0 < duties.max()),
        "full duty": bool(np.abs(duties).max() >= FULL_DUTY),
    }
    return {name for name, there in found.items() if there}
