"""Winners in other engines: that robots and floors there are right, independent of gecar, and judged fairly."""

from __future__ import annotations

import ast
import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the transfer benchmark is not tested (pip install gecar[test])"
)

from benchmarks.concealed import program as concealed
from benchmarks.concealed.colour_sensor import line_share
from benchmarks.transfer import __main__ as command
from benchmarks.transfer import drives as keeping
from benchmarks.transfer.drives import ENGINES, robot_class
from benchmarks.transfer.driving import Drive, Eye, Interpreter, drive
from benchmarks.transfer.floor import load_floor
from benchmarks.transfer.sealing import Winner, find_winners, seal
from benchmarks.transfer.table import score, table
from benchmarks.transfer.variations import NOMINAL, Variation, draw
from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.world.course.course import load_course

SOURCES = sorted((Path(__file__).parents[2] / "benchmarks" / "transfer").glob("*.py"))
COURSES = ("paper", "chicane", "figure_eight", "gaps", "hairpin", "maze", "s_bends")
NESTED = """
if(SensorValue < 20) { motor_until(7,8,50,SensorValue > 80) }
else { if(SensorValue > 90) { motor(4,4,2) } else { motor(2,2,1) } }
motor(0,0,0)
"""
FOLLOWER = "if(SensorValue > 50) { motor(50,70,10) } else { motor(60,-50,10) }"


@pytest.fixture(scope="module", params=list(ENGINES))
def engine(request):
    """An engine's name; PyBullet is in the extra `bench`."""
    if request.param == "pybullet":
        pytest.importorskip("pybullet", reason="PYBULLET IS MISSING: its robot is not tested (gecar[bench])")
    return request.param


@pytest.fixture(scope="module")
def robot(engine):
    made = robot_class(engine)(NOMINAL)
    yield made
    made.close()


def rows(text):
    return parse_program(text).opcodes.tolist()


def held(robot, *commands):
    """Poses after each ``(left, right, milliseconds)``, from rest at the origin."""
    robot.place(0.0, 0.0, 0.0)
    poses = []
    for left, right, time in commands:
        for _ in range(time):
            robot.advance((left, right))
        poses.append(robot.pose())
    return np.array(poses)


def run_folder(folder, text=FOLLOWER, course="paper", robot="ev3", **changes):
    """A run's folder, as far as the benchmark reads it."""
    folder.mkdir()
    result = {"program": text, "fitness_s": 20.0, "solved": True, **changes}
    (folder / "result.json").write_text(json.dumps(result))
    lines = f'course = "{course}"\nrobot = "{robot}"\ntime_limit_s = 60.0\nstep_s = 0.002\n'
    (folder / "config.toml").write_text(lines)
    return folder


def winner(name="a", promised_s=10.0, text=FOLLOWER):
    return Winner(name, "", "paper", 60.0, {}, text, "0" * 64, promised_s, promised_s)


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_robots_floor_and_rules_share_no_physics_with_gecar(source):
    text, physics = ast.parse(source.read_text(encoding="utf-8")), ("gecar.world", "gecar.reality")
    names = {node.module or "" for node in ast.walk(text) if isinstance(node, ast.ImportFrom)}
    names |= {alias.name for node in ast.walk(text) if isinstance(node, ast.Import) for alias in node.names}
    found = {name for name in names if name.startswith(physics)}
    assert found == (
        {"gecar.world.rollout"} if source.stem == "sealing" else set()
    )  # it asks for the promise
    if source.stem in ("driving", "variations", "bullet_robot", "mujoco_robot"):
        assert not {name for name in names if name.split(".")[0] == "gecar"}


@pytest.mark.parametrize("name", COURSES)
def test_floor_has_the_course_s_line_start_and_order(name):
    floor, course = load_floor(name), load_course(name)
    assert [x + y * floor.size[0] for x, y in floor.checkpoints] == [int(k) for k in course.checkpoints]
    assert floor.start == pytest.approx((course.start.x_m, course.start.y_m, course.start.heading_rad))
    raster, pitch = np.asarray(course.raster(), float) / 255.0, course.pitch_m
    rng, window = np.random.default_rng(1), 4
    for x, y in rng.uniform((0.02, 0.02), np.array(floor.size) * floor.tile_m - 0.02, (200, 2)):
        j, i = int(x / pitch), int(y / pitch)
        around = raster[i - window : i + window, j - window : j + window]
        share = floor.line_share(j * pitch, i * pitch)
        assert abs(share - (1.0 - around.mean())) < 0.12  # a square of 8 mm for the round spot


def test_line_under_the_spot_is_what_closed_forms_say():
    floor, rng = load_floor("paper"), np.random.default_rng(2)
    sides = rng.uniform((0.13, 0.13), (0.17, 1.07), (300, 2))
    corners = rng.uniform((0.13, 1.03), (0.17, 1.07), (300, 2))
    found = [floor.line_share(x, y) for x, y in (*sides, *corners)]
    expected = [line_share(x, y, 0.008) for x, y in (*sides, *corners)]
    assert np.abs(np.subtract(found, expected)).max() < 0.004  # the spot is a polygon of 64 sides
    assert 0.1 < np.mean(found) < 0.9


def test_course_with_obstacles_is_refused():
    with pytest.raises(InputError, match="walls"):
        load_floor("obstacles")


@pytest.mark.parametrize(
    "text",
    [
        "if(SensorValue > 50) { motor(1,2,10) } else { motor(3,4,25) }",
        "motor(9,9,7) if(SensorValue > 30) { if(SensorValue < 70) { motor(1,2,10) } motor(5,6,3) }",
        "motor_until(7,8,100,SensorValue < 40) motor_until(3,3,20,SensorValue > 60) motor(1,1,5)",
        NESTED,
    ],
)
def test_two_interpreters_do_the_same(text):
    readings = np.random.default_rng(3).integers(0, 101, 2000).repeat(3).tolist()
    ours, others = Interpreter(rows(text)), concealed.interpret(rows(text))
    for tick, reading in enumerate(readings):
        assert ours.turn(tick, lambda reading=reading: reading) == others(tick / 1000.0, reading)


def test_program_that_takes_no_time_polls_and_an_empty_one_gives_no_command():
    polls = Interpreter(rows("if(SensorValue > 50) { motor(1,1,0) }"))
    assert [polls.turn(tick, lambda seen=seen: seen) for tick, seen in enumerate((20, 80, 20))] == [
        (0, 0),
        (1, 1),
        (1, 1),
    ]
    assert Interpreter([]).turn(0, lambda: 80) is None


def test_nominal_robot_drives_as_mechanics_says(robot):
    pytest.importorskip("pybullet", reason="PYBULLET IS MISSING: robots are not compared with mechanics")
    from benchmarks.transfer.checks import steady, stopping

    early, late, stopped = held(robot, (80, 80, 1500), (80, 80, 500), (0, 0, 600))
    assert (late - early)[0] / 0.5 == pytest.approx(steady((80, 80))[0], rel=1e-3)
    assert (stopped - late)[0] == pytest.approx(stopping()[0], rel=0.02)
    early, late = held(robot, (60, -60, 1500), (60, -60, 100))
    assert (late - early)[2] / 0.1 == pytest.approx(steady((60, -60))[1], rel=1e-3)


def test_engines_agree_on_a_hard_drive():
    pytest.importorskip("pybullet", reason="PYBULLET IS MISSING: the engines are not compared")
    commands = ((80, 80, 400), (-60, 60, 300), (80, -30, 300), (40, 80, 300), (-80, -80, 400))
    one, other = (held(robot_class(name)(NOMINAL), *commands) for name in ENGINES)
    assert np.hypot(*(one - other)[:, :2].T).max() < 0.004
    assert np.degrees(np.abs((one - other)[:, 2]).max()) < 1.0


@pytest.mark.parametrize(
    ("change", "moves"),
    [
        ({"battery": 1.1}, lambda varied, nominal: varied[0] > 1.08 * nominal[0]),
        ({"dry_friction": 2.0}, lambda varied, nominal: varied[0] < 0.99 * nominal[0]),
        ({"motor_difference": 0.02}, lambda varied, nominal: varied[2] > 0.02),
        ({"grip": 0.1}, lambda varied, nominal: varied[0] < 0.9 * nominal[0]),
    ],
)
def test_each_variation_is_felt(engine, robot, change, moves):
    assert moves(
        held(robot_class(engine)(Variation(**change)), (80, 80, 700))[0], held(robot, (80, 80, 700))[0]
    )


def test_sensor_reads_between_its_own_black_and_white():
    floor, levels = load_floor("paper"), Variation(white_pct=90.0, black_pct=5.0)
    on_line, on_floor = (0.15, 0.75 - 0.081, math.pi / 2), (0.30, 0.30, 0.0)
    assert [Eye(floor, seen).read(0, on_line) for seen in (NOMINAL, levels)] == [0, 5]
    assert [Eye(floor, seen).read(0, on_floor) for seen in (NOMINAL, levels)] == [100, 90]
    edge = (0.1375, 0.669, math.pi / 2)
    noisy = [Eye(floor, Variation(noise_pct=1.0, seed=k)).read(0, edge) for k in range(50)]
    assert 0.5 < np.std(noisy) < 2.0


def test_variations_are_drawn_once_for_all():
    assert draw(10)[:3] == draw(3)
    many = draw(400)
    assert np.std([one.battery for one in many]) == pytest.approx(0.04, rel=0.15)
    assert {0.6 <= one.grip <= 0.9 and 0.6 <= one.dry_friction <= 1.6 for one in many} == {True}


@pytest.mark.parametrize(
    ("text", "limit_s", "outcome"),
    [
        ("motor(80,80,100)", 5.0, "off_course"),
        ("motor(-80,-80,100)", 5.0, "missed_checkpoint"),
        ("motor(30,-30,100)", 0.3, "out_of_time"),
        ("if(SensorValue > 200) { motor(1,1,1) }", 0.3, "out_of_time"),
        ("motor(80,80,0)", 5.0, "off_course"),
    ],
)
def test_drives_end_by_the_course_s_rules(robot, text, limit_s, outcome):
    assert drive(robot, rows(text), load_floor("paper"), NOMINAL, limit_s).outcome == outcome


def test_slow_follower_arrives_when_gecar_promises(tmp_path, engine, monkeypatch, capsys):
    corner = tmp_path / "corner.toml"
    start = '[start]\ntile = [0, 0]\nheading = "up"\nleft_m = -0.025\n'
    corner.write_text(f'map = """\nF---\n|###\n"""\ngoal = [3, 1]\n{start}')
    run, out = run_folder(tmp_path / "slow", course=str(corner)), tmp_path / "out"
    asked = [str(run), "--out", str(out), "--variations", "1", "--engines", engine, "--no-pictures"]
    assert command.main(asked) == 0
    assert "1/1 within 3 %" in capsys.readouterr().out
    monkeypatch.setattr(keeping, "drive", lambda *_: pytest.fail("a kept drive was driven again"))
    assert command.main(asked) == 0
    if engine == "mujoco":
        assert command.main(asked[:-1]) == 0
        assert all(0 < (out / name).stat().st_size < 5e6 for name in ("transfer.png", "transfer.gif"))


def test_drive_by_another_instrument_is_made_again(tmp_path, monkeypatch):
    monkeypatch.setattr(keeping, "drive", lambda *_: Drive("goal", 7.0, []))
    monkeypatch.setattr(keeping, "instrument", lambda _: "old")
    kept, one = keeping.Drives(tmp_path, 0), winner()
    kept.plan([one], ["mujoco"])
    assert kept.perform(one, "mujoco", 0).time_s == 7.0
    monkeypatch.setattr(keeping, "drive", lambda *_: Drive("goal", 8.0, []))
    assert kept.perform(one, "mujoco", 0).time_s == 7.0
    monkeypatch.setattr(keeping, "instrument", lambda _: "new")
    assert kept.perform(one, "mujoco", 0).time_s == 8.0


def test_other_programs_in_a_sealed_folder_are_refused(tmp_path):
    seals = [seal([winner("a")], tmp_path), seal([winner("a")], tmp_path)]
    assert seals[0] == seals[1]
    with pytest.raises(InputError, match="other programs"):
        seal([winner("a", text="motor(1,1,1)")], tmp_path)


@pytest.mark.parametrize(
    ("change", "wanted"),
    [({"robot": "mine.toml"}, "'ev3'"), ({"solved": False}, "GOAL"), ({"course": "nowhere"}, "nowhere")],
)
def test_run_that_can_not_be_judged_is_named(tmp_path, change, wanted, capsys):
    run = run_folder(tmp_path / "run", **change)
    assert command.main([str(run), "--out", str(tmp_path / "out")]) == 2
    assert wanted in capsys.readouterr().err


def test_records_of_a_study_are_winners_too(tmp_path):
    config = {"course": "paper", "robot": "ev3", "time_limit_s": 60.0, "step_s": 0.002}
    record = {"program": FOLLOWER, "fitness_s": 20.0, "solved": True, "config": config}
    (tmp_path / "runs").mkdir()
    for seed in (1, 2):
        (tmp_path / "runs" / f"seed{seed}.json").write_text(json.dumps(record))
    found = find_winners([tmp_path])
    assert [each.name for each in found] == ["seed1", "seed2"]
    assert found[0].promised_s == pytest.approx(22.8, abs=0.5)


def test_table_counts_who_came_and_who_was_in_time():
    winners = [winner("late"), winner("lost"), winner("good")]
    outcomes = {"late": ("goal", 10.4), "lost": ("off_course", 9.9), "good": ("goal", 9.8)}
    made = {(name, "mujoco", k): Drive(*outcomes[name], []) for name in outcomes for k in (0, 1)}
    counted = score(winners, made, "mujoco")
    assert (counted.at_goal, counted.near, counted.varied_at_goal, counted.varied) == (2, 1, 2, 3)
    text = table(winners, made, ["mujoco"], "f" * 64)
    assert all(
        words in text for words in ("off the course at 9.90", "+4.0 %", "2/3 at GOAL", "1/3 within 3 %")
    )


def test_path_is_kept_every_20_ms(robot):
    path = drive(robot, rows("motor(40,40,10)"), load_floor("paper"), NOMINAL, 0.5).path
    assert len(path) == 25
    assert all(late[0] - early[0] == pytest.approx(0.02) for early, late in pairwise(path))
