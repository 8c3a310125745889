"""The worlds of the concealed cases that can be tested here."""

import importlib.util
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed import cases
from benchmarks.concealed.kinds import SETS
from benchmarks.concealed.plan import outside_kinds
from benchmarks.concealed.recording import channels
from benchmarks.concealed.rehearsal import along, stacked
from benchmarks.concealed.robot import EV3, NEUTRAL, Concealed
from benchmarks.concealed.settings import Setting
from benchmarks.concealed.sizes import is_material, size
from benchmarks.concealed.worlds import WORLDS, holds, truth

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


def crossed(world, robot, start):
    """Weave across the lower line for more than a metre."""
    held = ((60, 75), (75, 45), (0, 0), (75, 75), (45, 75), (75, 50), (-30, 30), (75, 45), (60, 60))
    return truth(world, robot).run(start, lambda time_s, _: held[min(int(time_s / 0.5), 8)], 4.5)


def assert_material(nominal, moved, robot):
    """A robot must move, or read, materially otherwise than the nominal one, motion and sensor apart."""
    moved = replace(moved, light=along(nominal, robot))
    sizes = size([(stacked(channels(moved, robot)), stacked(channels(nominal, NEUTRAL)))])
    assert is_material(sizes), sizes


def assert_nothing(world, nothing):
    """At no strength each thing, by field, must leave a recording as it is."""

    def recorded(robot):
        history = truth(world, robot).run((0.175, 0.6, 1.5), lambda time_s, _: (60, 20), 0.3)
        return stacked(channels(history, robot))

    nominal = recorded(NEUTRAL)
    for field, none in nothing.items():
        if holds(world, [field]):
            np.testing.assert_array_equal(recorded(Concealed(**{field: none})), nominal, err_msg=field)


def assert_drawn_alone(name, least):
    """Kinds of a set are drawn with no others, and by no set before; ``least``: how many of them by world."""
    before = list(SETS)[: list(SETS).index(name)]
    for world, count in least.items():
        manner = cases.Manner(world, background=True)
        drawable = outside_kinds(manner, name)
        assert len(drawable) >= count
        assert set(drawable) <= set(SETS[name])
        for kinds in before:
            assert not set(SETS[name]) & set(outside_kinds(manner, kinds))


def label_of(kind, folder, monkeypatch):
    """Draw a short case of two recordings that conceals one kind outside the catalogue; its sealed label."""
    monkeypatch.setattr(cases, "SECONDS", 3.0)
    monkeypatch.setattr(cases, "draw_setting", lambda *_: Setting(EV3, ("holds", "line"), 100.0, 1))
    manner = cases.Manner("continuous", background=True, material=True)
    cases.draw_case("c", "outside", (kind,), (4,), folder, manner)
    return json.loads((folder / "sealed" / "c" / "label.json").read_text())
