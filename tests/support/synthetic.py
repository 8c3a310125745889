"""A recording made without gecar's own physics: motors that lag, wheels that roll, a camera with noise."""

import numpy as np

from gecar.reality.recordings.recording import make_recording

RADIUS, TRACK = 0.028, 0.120


def drive(seed=0, seconds=12.0, camera_hz=33.0):
    """Return a recording of random commands, each held for half a second or so, on a blank floor."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 0.01)
    holds = np.repeat(rng.integers(-8, 9, (len(t), 2)) * 10.0, rng.integers(20, 80, len(t)), axis=0)[: len(t)]
    speed = np.zeros((len(t), 2))
    for k in range(1, len(t)):
        speed[k] = speed[k - 1] + (9.0 * holds[k - 1] - speed[k - 1]) * 0.01 / 0.1
    angle = np.cumsum(speed, axis=0) * 0.01
    wheels = np.deg2rad(speed) * RADIUS
    heading = np.cumsum(wheels[:, 1] - wheels[:, 0]) * 0.01 / TRACK + 1.0
    forward = wheels.mean(axis=1) * 0.01
    x, y = 1.2 + np.cumsum(forward * np.cos(heading)), 0.6 + np.cumsum(forward * np.sin(heading))
    unseen = np.arange(len(t)) % max(1, round(100 / camera_hz)) != 0

    def seen(values, noise):
        return np.where(unseen, np.nan, values + rng.normal(0, noise, len(t)))

    columns = {
        "t_s": t,
        "left_duty_pct": holds[:, 0],
        "right_duty_pct": holds[:, 1],
        "left_angle_deg": np.floor(angle[:, 0]),
        "right_angle_deg": np.floor(angle[:, 1]),
        "reflection_pct": np.round(50 + 49 * np.sin(9 * x)),
        "x_m": seen(x, 0.001),
        "y_m": seen(y, 0.001),
        "heading_deg": seen(np.rad2deg(heading), 0.3),
        "battery_v": np.round(8.0 + rng.normal(0, 0.01, len(t)), 3),
    }
    return make_recording("synthetic", columns)
