"""The worlds of the concealed cases that can be tested here."""

import importlib.util
import json
import math

import pytest

from benchmarks.concealed import cases
from benchmarks.concealed.robot import EV3, NEUTRAL, Concealed
from benchmarks.concealed.settings import Setting
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


def changes(world, felt):
    """How each thing concealed changes the last pose; ``felt`` as in `assert_felt_alike`."""
    return [driven(world, Concealed(**f), duties) - driven(world, NEUTRAL, duties) for f, duties, *_ in felt]


def assert_felt_alike(world, felt, elsewhere):
    """Each thing must move the robot as it should, and as far as elsewhere.

    ``felt``: what is concealed, the duties, and how which part of the last pose differs from nominal.
    """
    for (fields, _, part, wanted), here, there in zip(felt, changes(world, felt), elsewhere, strict=True):
        assert abs(here[part]) > 1e-3, fields
        assert math.copysign(1.0, here[part]) == wanted, fields
        assert here[part] == pytest.approx(there[part], rel=0.15), fields


def label_of(kind, folder, monkeypatch):
    """Draw a short case of two recordings that conceals one kind outside the catalogue; its sealed label."""
    monkeypatch.setattr(cases, "SECONDS", 3.0)
    monkeypatch.setattr(cases, "draw_setting", lambda *_: Setting(EV3, ("holds", "line"), 100.0, 1))
    manner = cases.Manner("continuous", background=True, material=True)
    cases.draw_case("c", "outside", (kind,), (4,), folder, manner)
    return json.loads((folder / "sealed" / "c" / "label.json").read_text())
