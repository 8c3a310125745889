"""The worlds of the concealed cases that can be tested here."""

import importlib.util

import pytest

from benchmarks.concealed.worlds import WORLDS, truth

HERE = [
    pytest.param(
        world,
        marks=pytest.mark.skipif(
            world == "bullet" and importlib.util.find_spec("pybullet") is None,
            reason="PYBULLET IS MISSING: its world is not tested (pip install gecar[bench])",
        ),
    )
    for world in WORLDS
]


def driven(world, concealed, duties):
    """Drive for 0.5 s with each pair of duties; the pose at the end."""
    most = len(duties) - 1
    robot = truth(world, concealed)
    history = robot.run(
        (0.0, 0.6, 0.0), lambda time_s, _: duties[min(int(time_s / 0.5), most)], 0.5 * len(duties)
    )
    return history.pose[-1]
