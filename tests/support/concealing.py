"""Recordings made by the simulation itself, with an effect concealed or none, and what is discovered in them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from gecar.reality.discovery import discover
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.recordings.recording import Case, Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.residuals.of_case import Residuals, motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.reality.verdict import Verdict
from gecar.world.robot import Robot, load_robot

EV3 = load_robot("ev3")
MEMORY_S = 1.0


def recorded(robot: Robot, seed: int, seconds: float = 8.0, rig: str = "floor", most: int = 7) -> Recording:
    """Held duties drawn by chance, encoders in whole degrees, a camera at 33 Hz with 1 mm and 0.3 degrees of noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.01)
    duty = np.repeat(rng.integers(-most, most + 1, (2, int(seconds / 0.8) + 1)) * 10, 80, axis=1)[
        :, : len(t)
    ].astype(float)
    columns = {"t_s": t, "left_duty_pct": duty[0], "right_duty_pct": duty[1]}
    setup = Setup(rig=rig, course="none", duty_cap=1.0)
    rows = replayer_of(make_recording("made", columns, setup)).play(robot.physics, np.array([1.0, 0.5, 0.3]))[
        0
    ]
    columns |= {
        "left_angle_deg": np.round(np.degrees(rows[:, 0])),
        "right_angle_deg": np.round(np.degrees(rows[:, 1])),
    }
    if rig == "floor":
        frames = np.where(np.arange(len(t)) % 3 == 0, 0.0, np.nan)
        columns["x_m"] = rows[:, 4] + rng.normal(0, 0.001, len(t)) + frames
        columns["y_m"] = rows[:, 5] + rng.normal(0, 0.001, len(t)) + frames
        columns["heading_deg"] = np.degrees(rows[:, 6]) + rng.normal(0, 0.3, len(t)) + frames
    return make_recording(f"run_{seed}", columns, setup)


def motion_of(runs: Sequence[Recording]) -> Residuals:
    """Residuals of an EV3's motion, with the noise that the recordings tell."""
    return motion_residuals(runs, estimate_noise(runs, EV3.physics, MEMORY_S), MEMORY_S, Threads(1))


@cache
def verdict_on(effect: str = "", label: str = "", value: float = 0.0, rig: str = "floor") -> Verdict:
    robot = EV3.with_effects({effect: {label: value}}) if effect else EV3
    return discover(Case("made", tuple(recorded(robot, seed, rig=rig) for seed in range(5))))
