"""Drives kept as recordings: under a list of commands, open loop, as brick and camera would have logged them."""

import numpy as np
import pytest

from gecar.reality.recordings.synthetic import exercise
from gecar.reality.replay.replayer import replay
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World

EV3, PAPER = load_robot("ev3"), load_course("paper")
COMMANDS = ((0.0, 40.0, 40.0), (0.5, -40.0, 20.0), (1.0, 0.0, 0.0))


def test_an_exercise_holds_its_commands_and_ends_half_a_second_after_the_last():
    recording = exercise(World(EV3, PAPER), COMMANDS, "there_and_back")
    assert recording.t_s[-1] == pytest.approx(1.49)
    assert recording.left_duty[[0, 49, 50, 100]] == pytest.approx([0.4, 0.4, -0.4, 0.0])
    assert np.isfinite(recording.x_m).sum() == 50


def test_an_exercise_is_what_its_replay_says():
    recording = exercise(World(EV3, PAPER), COMMANDS, "there_and_back")
    again = replay(recording, EV3)
    assert np.degrees(again.left_angle_rad) == pytest.approx(np.degrees(recording.left_angle_rad), abs=1.0)
    seen = np.isfinite(recording.x_m)
    assert again.y_m[seen] == pytest.approx(recording.y_m[seen], abs=5e-4)


def test_noise_comes_from_the_seed():
    noisy = World(EV3, PAPER, noise=Noise(2.0, 0.02))
    one, same, other = (exercise(noisy, COMMANDS, "a", seed) for seed in (1, 1, 2))
    assert np.array_equal(one.reflection_pct, same.reflection_pct)
    assert not np.array_equal(one.reflection_pct, other.reflection_pct)
