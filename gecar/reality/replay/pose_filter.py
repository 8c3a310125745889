"""A Kalman filter on a replayed robot's pose: its normalised innovations are the whitened residual.

Source: extended Kalman filter with sequential scalar updates, Bar-Shalom, Li, Kirubarajan, Estimation with Applications
(2001), ch. 5 and 10.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gecar.compiled import kernel

_FILTER = "before_x before_y shift_x shift_y shift_heading xx xy xh yx yy yh hx hy hh"
FILTER = np.dtype([(field, np.float64) for field in _FILTER.split()])
"""The last pose as corrected, how far this one has been moved, and the pose's covariance, row by row."""

_POSE = "x_error y_error heading_error x y heading x_off y_off heading_off"
POSE = np.dtype([(field, np.float64) for field in _POSE.split()])
"""Normalised residuals of a pose, the pose predicted, and what terms add to it."""

UNKNOWN = 0.01  # a pose known to 0.1 m and 6 degrees: to nothing, beside what follows


@kernel
def begin_filter(f: Any, x: float, y: float) -> None:
    """Begin at a start place [m]."""
    f.before_x, f.before_y = x, y
    f.xy = f.xh = f.yx = f.yh = f.hx = f.hy = 0.0
    f.xx = f.yy = f.hh = UNKNOWN


@kernel
def predict_pose(s: Any, p: Any, back: float, r: Any) -> None:
    """Predict where the axle's centre was some time ago [s]."""
    r.x = s.x - p.com_ahead * s.cos - (s.vx + s.yaw_rate * p.com_ahead * s.sin) * back
    r.y = s.y - p.com_ahead * s.sin - (s.vy - s.yaw_rate * p.com_ahead * s.cos) * back
    r.heading = s.heading - s.yaw_rate * back


@kernel
def grow(f: Any, r: Any, place: float, turn: float) -> None:
    """Let the covariance P grow over the way from the last pose to this one, and by variances of place and heading.

    d(x, y) follows the heading's error turned a quarter: F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]];
    P becomes F P F' + Q.
    """
    dx, dy = r.x - f.before_x, r.y - f.before_y
    f.xx -= dy * f.hx
    f.xy -= dy * f.hy
    f.xh -= dy * f.hh
    f.yx += dx * f.hx
    f.yy += dx * f.hy
    f.yh += dx * f.hh
    f.xx -= dy * f.xh
    f.yx -= dy * f.yh
    f.hx -= dy * f.hh
    f.xy += dx * f.xh
    f.yy += dx * f.yh
    f.hy += dx * f.hh
    f.xx += place
    f.yy += place
    f.hh += turn


@kernel
def correct(f: Any, r: Any, x: float, y: float, heading: float, place_sd: float, turn_sd: float) -> None:
    """Take in a measured pose with its noise, and set its normalised innovations."""
    f.shift_x = f.shift_y = f.shift_heading = 0.0
    r.x_error = _take_in(f, x - r.x, place_sd, f.xx, f.xx, f.yx, f.hx, f.xx, f.xy, f.xh)
    r.y_error = _take_in(f, y - r.y - f.shift_y, place_sd, f.yy, f.xy, f.yy, f.hy, f.yx, f.yy, f.yh)
    turned = heading - r.heading - f.shift_heading
    r.heading_error = _take_in(f, turned, turn_sd, f.hh, f.xh, f.yh, f.hh, f.hx, f.hy, f.hh)
    f.before_x, f.before_y = r.x + f.shift_x, r.y + f.shift_y


@kernel
def _take_in(
    f: Any, innovation: float, sd: float, variance: float, of_x: float, of_y: float, of_heading: float,
    row_x: float, row_y: float, row_heading: float,
) -> float:  # fmt: skip
    """Take in one measured coordinate, given its variance, column and row of the covariance; return its residual."""
    total = variance + sd**2
    if not math.isnan(innovation):
        gain_x, gain_y, gain_h = of_x / total, of_y / total, of_heading / total
        f.shift_x += gain_x * innovation
        f.shift_y += gain_y * innovation
        f.shift_heading += gain_h * innovation
        f.xx -= gain_x * row_x
        f.xy -= gain_x * row_y
        f.xh -= gain_x * row_heading
        f.yx -= gain_y * row_x
        f.yy -= gain_y * row_y
        f.yh -= gain_y * row_heading
        f.hx -= gain_h * row_x
        f.hy -= gain_h * row_y
        f.hh -= gain_h * row_heading
    return innovation / math.sqrt(total)


@kernel
def rebase(s: Any, p: Any, f: Any) -> None:
    """Move the robot by the filter's correction."""
    move(s, p, f.shift_x, f.shift_y, f.shift_heading)


@kernel
def move(s: Any, p: Any, shift_x: float, shift_y: float, turn: float) -> None:
    """Move the robot's axle by so much [m], and turn the robot about it [rad]; its velocity turns with it."""
    x = s.x - p.com_ahead * s.cos + shift_x
    y = s.y - p.com_ahead * s.sin + shift_y
    ahead = s.vx * s.cos + s.vy * s.sin
    aside = s.vy * s.cos - s.vx * s.sin
    s.heading += turn
    s.cos = math.cos(s.heading)
    s.sin = math.sin(s.heading)
    s.x = x + p.com_ahead * s.cos
    s.y = y + p.com_ahead * s.sin
    s.vx = ahead * s.cos - aside * s.sin
    s.vy = ahead * s.sin + aside * s.cos
