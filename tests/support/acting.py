"""Effects large enough that each acts."""

from __future__ import annotations

import numpy as np

from gecar.world.effects import Effect
from gecar.world.robot import load_robot

EV3 = load_robot("ev3")
# Shaped so that each effect acts, at half of its bounds or where a robot would have it.
STRONG = {
    "command_slew": {"rate_pct_s": 300.0},
    "speed_limit": {"speed_rad_s": 9.0},
    "static_friction": {"extra_torque_nm": 0.03, "speed_rad_s": 1.0},
    "slippery_patch": {"radius_m": 0.4, "x_m": 0.3, "y_m": 0.9, "coefficient": 0.1},
    "com_offset": {"ahead_m": -0.05},
}


def strong(effect: Effect) -> dict[str, float]:
    """Return values of an effect's parameters at which it acts on the EV3."""
    first = effect.parameters[0]
    neutral = EV3.nominal(first)
    high = first.high if np.isfinite(first.high) else first.low + 1.0
    return STRONG.get(effect.id, {first.label: 0.5 * (neutral + (high if high != neutral else first.low))})
