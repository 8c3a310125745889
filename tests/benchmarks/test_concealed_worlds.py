"""The truth worlds beside each other: that they agree on the nominal robot, and feel what is concealed alike."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MUJOCO IS MISSING: worlds are not compared (pip install gecar[test])")

from support.concealed_worlds import HERE

from benchmarks.concealed import cases, commands
from benchmarks.concealed.__main__ import main
from benchmarks.concealed.cases import Manner, draw_case
from benchmarks.concealed.effects import EFFECTS
from benchmarks.concealed.history import replayed
from benchmarks.concealed.judging import judge
from benchmarks.concealed.kinds.sealed import SEALED
from benchmarks.concealed.plan import Counts, outside_kinds, plan
from benchmarks.concealed.recording import CHANNELS
from benchmarks.concealed.rehearsal import tuned
from benchmarks.concealed.robot import LARGE, NEUTRAL, Concealed
from benchmarks.concealed.settings import Setting
from benchmarks.concealed.sizes import is_material, size
from benchmarks.concealed.worlds import truth
from gecar.world.robot import read_robot

ANY, LESS, MORE = 0, -1, 1  # how the way, or the turn, differs from the nominal robot's
LEFT = 0

# Fields of `Concealed`, and how the way straight ahead (or the turn counter-clockwise) changes.
WAY = [
    ({"coulomb_friction": 0.04}, LESS),
    ({"viscous_friction": 0.005}, LESS),
    ({"static_friction": 0.05, "stribeck_speed": 2.0}, LESS),
    ({"friction_ratio": 0.6}, LESS),
    ({"direction_gain": 0.05}, MORE),
    ({"backlash_deg": 8.0}, ANY),
    ({"dead_band_pct": 15.0}, LESS),
    ({"dead_band_pct": 75.0, "dead_band_is_threshold": True}, LESS),
    ({"inertia_scale": 1.5}, ANY),
    ({"actuation_delay": 0.1}, LESS),
    ({"command_slew": 150.0}, LESS),
    ({"supply_scale": 0.9}, LESS),
    ({"battery_resistance": 2.0}, LESS),
    ({"battery_drain": 0.5}, LESS),
    ({"ripple_torque": 0.05, "ripple_cycles": 2}, ANY),
    ({"speed_limit": 6.0}, LESS),
    ({"radius_scale": 1.05}, MORE),
    ({"tyre_friction": 0.1}, LESS),
    ({"patch": (0.0, 0.0, 1.0, 0.1)}, LESS),
    ({"caster_friction": 0.8}, LESS),
    ({"rolling_resistance": 0.1}, LESS),
    ({"tilt": (0.05, 0.0)}, MORE),
    ({"tilt": (-0.05, 0.0), "waves": (0.001, 0.3, 0.0, 0.0)}, LESS),
    ({"clock_skew": 0.05}, LESS),
    ({"off_centre": (0.004, 0.0, 0.0)}, ANY),
    ({"oval": (0.002, 0.0, 0.0)}, ANY),
    ({"tether": (5.0, 0.0, 0.5)}, MORE),
    ({"magnet": (1.0, 0.0, 0.3, 2.0)}, MORE),
    ({"waves": (0.1, 0.3, 0.0, 0.0)}, ANY),
    ({"gusts": ((0.0, 1.0, 1.5, 0.0),)}, MORE),
    ({"air_drag": 20.0}, LESS),
    ({"bump": (0.003, 0.1, 0.0)}, ANY),
    ({"dropouts": ((0.3, 0.2),)}, LESS),
    ({"loosening": (0.3, LEFT)}, ANY),
    ({"duty_step_pct": 50.0}, LESS),
    ({"shared_drop": 0.1}, LESS),
    ({"current_limit": 0.25}, LESS),
    ({"coasting": 0.8}, MORE),
    ({"dust": (0.95, 0.05)}, ANY),
    ({"pile": (1.0, math.pi)}, LESS),
]
TURN = [
    ({"gain_difference": 0.1}, MORE),
    ({"radius_difference": 0.05}, MORE),
    ({"heat": (0.3, 0.3, LEFT)}, MORE),
    ({"tooth": (0.2, 0.5, LEFT, 0.0)}, MORE),
    ({"rubber_band": (0.006, LEFT)}, MORE),
    ({"hop": (0.98, 1.0, LEFT)}, ANY),
    ({"yaw_pull": 0.05}, MORE),
]
ARC = [
    ({"track_scale": 1.1}, MORE),
    ({"com_ahead": -0.06}, ANY),
    ({"com_height": 0.01}, ANY),
    ({"swivel": (0.5, 0.01)}, ANY),
]


def driven(world, concealed, duties):
    """Drive for 0.7 s, then stop: way along x at the end [m], and turn before the stop [rad]."""
    history = truth(world, concealed).run(
        (0.0, 0.6, 0.0), lambda time_s, _: duties if time_s < 0.7 else (0, 0), 1.0
    )
    return history.pose[-1, 0], history.pose[700, 2]


def holds(world, fields):
    try:
        truth(world, Concealed(**fields))
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("world", HERE)
@pytest.mark.parametrize(
    ("duties", "measure", "table"),
    [((70, 70), 0, WAY), ((70, 70), 1, TURN), ((80, -20), 1, ARC)],
    ids=("way", "turn", "arc"),
)
def test_each_thing_concealed_moves_the_robot_as_it_should(world, duties, measure, table):
    nominal = driven(world, NEUTRAL, duties)[measure]
    for fields, wanted in table:
        if not holds(world, fields):
            continue
        change = driven(world, Concealed(**fields), duties)[measure] - nominal
        assert abs(change) > 1e-6, fields
        assert wanted == ANY or math.copysign(1.0, change) == wanted, fields


@pytest.mark.parametrize(("world", "most_mm", "most_deg"), [("continuous", 5.0, 1.5), ("bullet", 8.0, 2.0)])
def test_worlds_agree_on_the_nominal_robot(world, most_mm, most_deg):
    if world == "bullet":
        pytest.importorskip("pybullet")
    for kind in ("holds", "sines"):
        start, duties = commands.script(kind, np.random.default_rng(1))
        here, there = (
            truth(name, NEUTRAL).run(start, replayed(duties), 6.0).pose for name in (world, "mujoco")
        )
        assert 1e3 * np.hypot(*(here - there)[:, :2].T).max() < most_mm
        assert np.degrees(np.abs(here - there)[:, 2]).max() < most_deg


@pytest.mark.parametrize("world", HERE)
def test_worlds_run_again_to_the_same_bits(world):
    first, again = (
        truth(world, Concealed(backlash_deg=3.0)).run((1.0, 0.6, 0.3), lambda _, __: (70, 40), 0.5)
        for _ in range(2)
    )
    for name, array in vars(first).items():
        np.testing.assert_array_equal(array, vars(again)[name])


def test_worlds_refuse_what_they_have_no_law_for():
    with pytest.raises(ValueError, match="bullet world has no law for: oval"):
        truth("bullet", Concealed(oval=(0.002, 0.0, 0.0)))
    with pytest.raises(ValueError, match="loosening"):
        truth("mujoco", Concealed(loosening=(0.01, 0)))
    assert "oval_wheels" not in outside_kinds(Manner("bullet", background=True), "last")


def test_half_of_the_new_kinds_wait_for_the_last_examination():
    last = {name for name, kind in SEALED.items() if kind.last}
    assert len(last) >= 6
    assert len(SEALED) - len(last) >= 6
    manner = Manner("continuous", background=True)
    assert not last & set(outside_kinds(manner))
    assert last <= set(outside_kinds(manner, "last"))


def test_plan_of_several_worlds_has_counts_for_each():
    counts = {"mujoco": Counts(1, 2, 0, 0), "continuous": Counts(0, 3, 1, 2, 1, 1)}
    planned = plan(3, counts, background=True)
    worlds = [case.manner.world for case in planned]
    assert (worlds.count("mujoco"), worlds.count("continuous")) == (3, 8)
    assert {len(case.effects) for case in planned if case.kind == "triple"} == {3}
    mixed = next(case for case in planned if case.kind == "mixed")
    assert [effect in EFFECTS for effect in mixed.effects] == [True, False]


def test_a_world_with_counts_of_its_own_has_no_other_kinds(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr("benchmarks.concealed.plan.draw_all", lambda cases, out, workers: drawn.extend(cases))
    counts = ["--world", "continuous:none=2,single=1", "--world", "bullet:none=1"]
    assert main(["plan", "--seed", "3", *counts, "--double", "1", "--out", str(tmp_path)]) == 0
    kinds = sorted((case.manner.world, case.kind) for case in drawn)
    assert kinds == [
        ("bullet", "double"), ("bullet", "none"),
        ("continuous", "double"), ("continuous", "none"), ("continuous", "none"), ("continuous", "single"),
    ]  # fmt: skip


def test_faster_recordings_of_a_slow_case_are_sealed(tmp_path):
    draw_case("slow", "single", ("viscous_friction",), (7,), tmp_path, Manner("continuous", pace=0.5))

    def most(path):
        columns = np.genfromtxt(path, delimiter=",", names=True)
        return max(np.abs(columns["left_duty_pct"]).max(), np.abs(columns["right_duty_pct"]).max())

    slow = tmp_path / "cases" / "slow" / "run_07_reversals.csv"
    fast = tmp_path / "sealed" / "slow" / "faster" / "run_07_reversals.csv"
    assert most(slow) <= 40.0 < most(fast) <= 80.0
    assert not list((tmp_path / "cases").rglob("faster"))


def test_strengths_are_found_for_a_visibility():
    assert 40.0 * 12.0 ** (tuned(lambda share: 40.0 * 12.0**share, 100.0)) == pytest.approx(100.0, rel=0.2)
    limit = tuned(lambda share: 0.0 if share < 0.8 else 500.0 * share, 30.0)
    assert limit >= 0.8


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Draw twice a mixed case of the continuous world, of 3 s recordings."""
    out = tmp_path_factory.mktemp("worlds")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "SECONDS", 3.0)
        patch.setattr(cases, "draw_setting", lambda *_: Setting(LARGE, ("holds", "line"), 20.0, 3))
        for name in ("first", "again"):
            mixed = ("viscous_friction", "carpet_pile")
            draw_case("m", "mixed", mixed, (5,), out / name, Manner("continuous", background=True))
    return out


def test_equal_seeds_give_equal_bytes_with_a_background(drawn):
    for path in sorted(path for path in (drawn / "first").rglob("*") if path.is_file()):
        assert path.read_bytes() == (drawn / "again" / path.relative_to(drawn / "first")).read_bytes()


def test_label_says_world_setting_and_sizes_and_the_background_is_small(drawn):
    label = json.loads((drawn / "first" / "sealed" / "m" / "label.json").read_text())
    assert label["world"] == "continuous"
    assert label["setting"] == {"robot": "large", "recordings": 2, "log_hz": 20.0, "encoder_step_deg": 3}
    assert set(label["d_prime"]) == {"viscous_friction", "carpet_pile"}
    assert set(label["size"]) == {"viscous_friction", "carpet_pile", "background"}
    assert label["size"]["background"]["mm_drive"] < 7.0
    assert label["size_repeatedly"]["background"]["mm_drive"] <= label["size"]["background"]["mm_drive"]
    assert label["size"]["background"]["deg_drive"] < 1.5


def test_another_robot_has_its_file_beside_coarse_and_slow_recordings(drawn):
    folder = drawn / "first" / "cases" / "m"
    assert read_robot(folder / "robot.toml").body.track_width == 0.160
    assert 'robot = "robot.toml"' in (folder / "run_01_holds.toml").read_text()
    header, *rows = (line.split(",") for line in (folder / "run_01_holds.csv").read_text().splitlines())
    assert 55 < len(rows) <= 61
    if "left_angle_deg" in header:
        assert all(int(row[header.index("left_angle_deg")]) % 3 == 0 for row in rows)


def test_mixed_case_is_right_when_the_effect_is_named_and_the_rest_is_not():
    label = {
        "case": "x",
        "kind": "mixed",
        "runs": [],
        "effects": [{"id": "p", "parameters": {}}],
        "outside": {"id": "o"},
    }
    label |= {"world": "continuous", "size": {"p": {"mm_1m": 12.0, "deg_1m": 0.0, "reading_pct": 0.0}}}
    seen = {"d_prime": {"p": 90.0, "o": 90.0}, "groups": {}, "timeline": []}
    said = {
        "verdict": "missing_and_unexplained",
        "effects": [{"id": "p"}],
        "minor": [{"id": "q"}],
        "limits": {},
    }
    judged = judge(label, said, seen)
    assert judged.right
    assert judged.material
    assert not judge(label, {**said, "verdict": "missing"}, seen).right
    assert judge(label, {**said, "verdict": "missing_and_invented"}, seen).right


def test_outside_physics_that_gets_a_law_is_no_wrong_name():
    label = {"case": "x", "kind": "outside", "runs": [], "effects": [], "outside": {"id": "o"}}
    label |= {"world": "continuous", "size": {"o": {"mm_1m": 12.0, "deg_1m": 0.0, "reading_pct": 0.0}}}
    seen = {"d_prime": {"o": 90.0}, "groups": {}, "timeline": []}
    words = {"invented": True, "unexplained": True, "nothing": False, "missing": False}
    for word, right in words.items():
        named = [{"id": "p"}] if word == "missing" else []
        assert judge(label, {"verdict": word, "effects": named}, seen).right == right
    assert judge(label, {"verdict": "nothing", "effects": []}, seen).all_material


def test_what_one_of_eight_recordings_shows_is_not_material_repeatedly():
    way = np.linspace(0.0, 2.0, 201)
    straight = np.zeros((201, len(CHANNELS)))
    straight[:, CHANNELS.index("x_m")] = way
    aside = straight.copy()
    aside[:, CHANNELS.index("y_m")] = 0.03 * way
    once, twice = ([(aside, straight)] * k + [(straight, straight)] * (8 - k) for k in (1, 2))
    assert size(once)["mm_1m"] == pytest.approx(30.0)
    assert not is_material(size(once, repeatedly=True))
    assert is_material(size(twice, repeatedly=True))
    assert is_material(size(once[:1], repeatedly=True))
