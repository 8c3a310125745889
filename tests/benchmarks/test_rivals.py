"""What other methods learn acts inside the simulation, and they learn from what is truly left over."""

from __future__ import annotations

import numpy as np
import pytest
from support.concealing import EV3, recorded

from benchmarks.concealed.comparators.sparse import even, leftover_torques
from benchmarks.rivals.acting import acting
from benchmarks.rivals.methods import Lesson, sindy
from gecar.reality.replay.replayer import replayer_of
from gecar.world.terms import Term

WEAK = EV3.with_terms([Term(port="motor_torque", law="-a * command", a=0.02)])


def nothing(seen):
    return np.zeros(len(seen))


def test_a_torque_that_was_learned_moves_a_replay_as_a_law_does():
    replayer = replayer_of(recorded(EV3, 3))
    plain, wanted = (replayer.play(robot.physics) for robot in (EV3, WEAK))
    found, poses = acting(lambda seen: -0.02 * seen[:, 0], nothing, nothing, EV3)(
        replayer, plain.rows, plain.poses
    )
    apart = np.abs(wanted.rows - plain.rows).max(axis=0)
    assert np.all(np.abs(found - wanted.rows).max(axis=0)[[0, 1, 4, 5, 6]] < 0.02 * apart[[0, 1, 4, 5, 6]])
    assert poses.shape == plain.poses.shape


@pytest.mark.parametrize(("robot", "slope"), [(EV3, 0.0), (WEAK, -0.02)], ids=["nominal", "weak"])
def test_what_is_left_over_is_what_the_robot_lacks(robot, slope):
    run = recorded(robot, 1)
    angles = np.column_stack([even(run.t_s, a) for a in (run.left_angle_rad, run.right_angle_rad)])
    duty = np.column_stack([np.interp(even(run.t_s, run.t_s), run.t_s, u) for u in run.commands.T])
    left = leftover_torques(angles + 300.0, duty, EV3)[20:-20]
    assert np.polyfit(duty[20:-20].ravel(), left.ravel(), 1) == pytest.approx([slope, 0.0], abs=0.003)


def test_sparse_regression_learns_a_law_and_forgets_what_is_none():
    pytest.importorskip("pysindy")
    rng = np.random.default_rng(0)
    seen = rng.normal(size=(900, 3))
    left = 0.3 * seen[:, 0] - 0.1 * seen[:, 1] ** 2
    model = sindy(Lesson(seen, left + 0.02 * rng.normal(size=900), np.repeat(np.arange(3), 300)))
    fresh = rng.normal(size=(50, 3))
    assert model(fresh) == pytest.approx(0.3 * fresh[:, 0] - 0.1 * fresh[:, 1] ** 2, abs=0.05)
