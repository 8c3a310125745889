"""What the compiled replay reads of a recording, and what it keeps of its robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class KernelInput(NamedTuple):
    """A recording as the kernel reads it.

    Attributes
    ----------
    t
        Time of each row from the start of the simulation [s], shape (rows,).
    command_t, commands
        From when on commands are held [s], shape (commands,), and duty of both motors, before the cap, (commands, 2).
    measured
        Left angle, right angle [rad], battery [V], yaw rate [rad/s]; nan where absent, shape (rows, 4).
    pose_t, pose
        Time of each pose [s], shape (poses,), and x, y [m], heading [rad], nan where absent, shape (poses, 3).
    sd
        Noise: one encoder's [rad], battery [V], yaw rate [rad/s], x and y [m], heading [rad], shape (5,).
    walk
        Process noise of the pose, a random walk: position [m/sqrt(s)], heading [rad/sqrt(s)], shape (2,).
    memory
        Over which wheel angles are re-based [s]; inf: never, and neither is the pose.
    anew, pose_anew
        At which rows and poses all that was measured before is forgotten, shapes (rows,) and (poses,).
    bench
        Whether the wheels are in the air.
    camera
        The point on the floor below the camera, about which it may see lengths larger or smaller: x, y [m], shape (2,).
    rolls
        Whether the wheels turn as the encoders say, whatever commands make of motors.
    """

    t: Array
    command_t: Array
    commands: Array
    measured: Array
    pose_t: Array
    pose: Array
    sd: Array
    walk: Array
    memory: float
    anew: Mask
    pose_anew: Mask
    bench: bool
    camera: Array
    rolls: bool = False


class Kept(NamedTuple):
    """What is kept of replays by several robots.

    Attributes
    ----------
    rows, row_errors
        Predictions at every row, shape (rows, ROW_COLUMNS, robots), none if they are not wanted, and normalised
        residuals, shape (rows, 4, robots).
    poses, pose_errors
        The same at every pose, shape (poses, 3, robots) each.
    """

    rows: Array
    row_errors: Array
    poses: Array
    pose_errors: Array
