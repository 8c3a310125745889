"""The columns of a recording: their names and units in the file, and the fields and SI units they become."""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

Series = npt.NDArray[np.float64]

# Column of the file -> (field of Recording, factor to the field's unit).
COLUMNS = MappingProxyType({
    "t_s": ("t_s", 1.0),
    "left_duty_pct": ("left_duty", 0.01),
    "right_duty_pct": ("right_duty", 0.01),
    "left_angle_deg": ("left_angle_rad", math.pi / 180.0),
    "right_angle_deg": ("right_angle_rad", math.pi / 180.0),
    "reflection_pct": ("reflection_pct", 1.0),
    "x_m": ("x_m", 1.0),
    "y_m": ("y_m", 1.0),
    "heading_deg": ("heading_rad", math.pi / 180.0),
    "battery_v": ("battery_v", 1.0),
    "yaw_rate_dps": ("yaw_rate_rad_s", math.pi / 180.0),
})  # fmt: skip
POSE_FIELDS = ("x_m", "y_m", "heading_rad")
