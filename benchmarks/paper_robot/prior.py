"""What the paper leaves open about its robot, as a prior: draws, and the constants each stands for.

Known, and so no part of the prior: the course (Figs 3, 4), the program (Fig. 6), and that the robot starts on white
floor and turns four times (section 3.3). Assumed: courses/paper.toml's START tile, and 28 mm wheels, which only scale
the motors' speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gecar.world.robot import load_robot

Floats = npt.NDArray[np.float64]

SPOTS_M = np.arange(0.002, 0.0161, 0.002)  # a spot's average of the course is made once each
NOMINAL = load_robot("ev3")
CAP = NOMINAL.drive.duty_cap
LINE_X_M, START_Y_M = 0.15, 0.75  # courses/paper.toml: the line's middle, and START's


@dataclass(frozen=True)
class Unknown:
    """One thing the paper does not say.

    Attributes
    ----------
    name, unit
        As shown; values are shown times ``scale``.
    low, high
        Bounds of the prior, SI.
    scale
        Shown units in an SI unit.
    logarithmic
        Whether the prior is uniform in the logarithm.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: float = 1.0
    logarithmic: bool = False


UNKNOWNS = (
    Unknown("track_width", "mm", 0.100, 0.130, 1e3),
    Unknown("sensor_ahead", "mm", 0.040, 0.140, 1e3),
    Unknown("sensor_left", "mm", -0.008, 0.008, 1e3),  # a stud either way
    Unknown("spot_diameter", "mm", 0.001, 0.017, 1e3),  # rounded to SPOTS_M
    Unknown(
        "speed", "deg/s", math.radians(500.0), math.radians(850.0), math.degrees(1.0)
    ),  # at a command of 80
    Unknown("time_constant", "ms", 0.001, 0.150, 1e3, logarithmic=True),
    Unknown("mass", "kg", 0.05, 1.2, logarithmic=True),
    Unknown("grip", "-", 0.4, 1.2),
    Unknown("regulated", "-", 0.0, 1.0),  # speed from 0.5, duty below
    Unknown("start_right", "mm", 0.0, 0.060, 1e3),  # of the line's middle
    Unknown("start_ahead", "mm", -0.150, 0.150, 1e3),  # of START's middle
)
NAMES = tuple(each.name for each in UNKNOWNS)
LOW, HIGH = (np.array([getattr(u, end) for u in UNKNOWNS]) for end in ("low", "high"))
LOG = np.array([u.logarithmic for u in UNKNOWNS])


def from_unit(cube: Floats) -> Floats:
    """Return draws of the prior from draws of the unit cube, shape (n, unknowns)."""
    straight = LOW + cube * (HIGH - LOW)
    bent = np.exp(
        np.log(np.where(LOG, LOW, 1.0)) + cube * np.log(np.where(LOG, HIGH / np.where(LOG, LOW, 1.0), 1.0))
    )
    return np.where(LOG, bent, straight)


def constants(draw: Floats) -> dict[str, float]:
    """Return the fields of the kernel's record that a draw sets; the others are the nominal robot's."""
    d = dict(zip(NAMES, map(float, draw), strict=True))
    motor = NOMINAL.motor
    regulated = d["regulated"] >= 0.5
    # J = tau Kt Ke / R
    inertia = d["time_constant"] * motor.torque_constant * motor.back_emf_constant / motor.resistance
    return {
        **{name: d[name] for name in ("track_width", "sensor_ahead", "sensor_left", "mass")},
        "spot_diameter": float(SPOTS_M[np.argmin(np.abs(SPOTS_M - d["spot_diameter"]))]),
        "tyre_friction": d["grip"],
        "yaw_inertia": NOMINAL.body.yaw_inertia * d["mass"] / NOMINAL.body.mass,
        "inertia": inertia,
        "coulomb_friction": 0.0,  # the speed is that of a motor without load
        "regulated": float(regulated),
        # A regulator holds 1000 deg/s times the command, so the cap sets its highest speed; open loop the supply does.
        "duty_cap": math.degrees(d["speed"]) / 1000.0 if regulated else CAP,
        "voltage": NOMINAL.battery.voltage if regulated else d["speed"] * motor.back_emf_constant / CAP,
    }


def start_of(draw: Floats) -> Floats:
    """Return the start pose of a draw [m, m, rad], in courses/paper.toml's START tile."""
    right, ahead = draw[NAMES.index("start_right")], draw[NAMES.index("start_ahead")]
    return np.array([LINE_X_M + right, START_Y_M + ahead, 0.5 * math.pi])
