"""Valleys: on a bench supply, viscous friction and inertia do nearly the same, and motors of one kind differ in all."""

from __future__ import annotations

from functools import cache

import numpy as np
from support.concealing import EV3, motion_of

from gecar.reality.advise.notes import notes_on_findings
from gecar.reality.fitting.model import Model
from gecar.reality.recordings.recording import Case, Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.recordings.split import hold_out
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.selection.observability import observable
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.uncertainty.intervals import intervals
from gecar.reality.uncertainty.valleys import along_valleys, valleys
from gecar.reality.verdict import Interval
from gecar.world.effects import CATALOGUE
from gecar.world.robot import Robot

VISCOUS, SUPPLY, INERTIA = "viscous_friction", "supply_voltage", "rotor_inertia"
SETUP = Setup(rig="bench", course="none", duty_cap=1.0)


def step(robot: Robot, level: float, rng: np.random.Generator) -> Recording:
    t = np.arange(0.0, 1.5, 0.01)
    columns = {"t_s": t, "left_duty_pct": np.where(t < 0.1, 0.0, level)}
    angle = replayer_of(make_recording("made", columns, SETUP)).play(robot.physics).rows[:, 0]
    columns["left_angle_deg"] = np.round(np.degrees(angle) + rng.normal(0.0, 0.2, len(t)))
    return make_recording(f"step_{level:.0f}", columns, SETUP)


@cache
def one_of_its_kind(seed: int) -> tuple[Problem, dict[str, dict[str, float]]]:
    """A motor off in friction, supply, inertia and start, and what it is off by."""
    rng = np.random.default_rng(seed)
    truth = {
        VISCOUS: {"coefficient_nms": rng.uniform(0.001, 0.005)},
        SUPPLY: {"scale": 1.0 + rng.normal(0.0, 0.08)},
        INERTIA: {"scale": 1.0 + rng.uniform(-0.05, 0.05)},
        "coulomb_friction": {"torque_nm": 0.0165 + rng.uniform(-0.002, 0.002)},
        "start_latency": {"time_s": rng.uniform(0.0, 0.005)},
    }
    runs = [step(EV3.with_effects(truth), level, rng) for level in (60.0, 80.0, 100.0)]
    residuals = motion_of(runs)
    return problem_of(residuals, EV3, observable(CATALOGUE, residuals)), truth


def fitted(seed: int, *effects: str) -> tuple[Problem, Model, float]:
    problem, truth = one_of_its_kind(seed)
    return problem, problem.estimator.fit(effects, truth), truth[VISCOUS]["coefficient_nms"]


def holds(spans: dict[str, dict[str, Interval]], truth: float) -> bool:
    found = spans[VISCOUS]["coefficient_nms"]
    return found.low <= truth <= found.high


def test_intervals_reach_along_a_valley_whichever_of_its_effects_were_named() -> None:
    plain, long = [], []
    for seed in range(4):
        for named in ((VISCOUS,), (VISCOUS, SUPPLY)):
            problem, model, truth = fitted(seed, *named)
            spans = intervals(problem.estimator, model)
            plain.append(holds(spans, truth))
            long.append(holds(along_valleys(problem, model, spans), truth))
    assert np.mean(plain) < 0.5
    assert np.mean(long) > 0.8


def test_the_effects_of_a_valley_are_given_as_a_set_and_in_a_note() -> None:
    problem, model, _ = fitted(0, VISCOUS)
    (together,) = valleys(problem, model)
    assert {VISCOUS, SUPPLY, INERTIA} <= set(together)
    split = hold_out(Case("made", problem.recordings))
    notes = notes_on_findings(split, EV3, alike=[together])
    assert "supply_voltage and viscous_friction apart" in " ".join(notes)
