"""Import of logs in the forms of public data sets: Arduino serial, Neato, EMPS and QUARC, ROS, EV3 Python, Excel."""

import numpy as np
import pytest
from scipy.io import savemat
from support.foreign_logs import (
    BRICK,
    assert_same,
    brick_log,
    camera_log,
    import_all,
    import_texts,
    pose_errors,
)
from support.synthetic import RADIUS, drive

from gecar.errors import InputError
from gecar.reality.recordings.importing.command_formula import command_of
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.importing.meaning import parse_said
from gecar.reality.recordings.recording import make_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.robot import load_robot

WHEELS = ("t_s", "left_duty_pct", "right_duty_pct", "left_angle_deg", "right_angle_deg")
BENCH = Setup(rig="bench", course="none")


def column(recording, name, scale=1.0):
    return np.rad2deg(getattr(recording, name)) * scale


def duties(run):
    return 100.0 * run.left_duty, 100.0 * run.right_duty


def text_of(names, columns, separator=",", head=""):
    rows = zip(*columns, strict=True)
    lines = [separator.join(v if isinstance(v, str) else f"{v:.10g}" for v in row) for row in rows]
    return head + separator.join(names) + "\n" + "\n".join(lines) + "\n"


def step(duty, seconds=2.0, dps_per_pct=9.0, first_deg=0.0):
    """Return times, angles [deg] of a motor that lags by 0.1 s."""
    t = np.arange(0.0, seconds, 0.01)
    return t, first_deg + np.floor(dps_per_pct * duty * (t - 0.1 * (1.0 - np.exp(-t / 0.1))))


# Arduino: a micromouse's serial monitor, with time stamps of the IDE, labels, counts, a mode, PWM of 255


def serial_monitor(run, most_pwm):
    """Return what an Arduino prints: ``12:30:01.020 -> t:20,pwmL:120,...``, counts that do not begin at zero."""
    scale = most_pwm / 80.0
    left, right = (np.round(scale * duty) for duty in duties(run))
    counts = [
        np.round(5210 + column(run, f"{side}_angle_rad") * 3000.0 / 360.0) for side in ("left", "right")
    ]
    rows = zip(1000 * run.t_s, left, right, *counts, run.t_s // 3, strict=True)
    return "".join(
        f"12:30:{t / 1000:06.3f} -> t:{t:.0f},pwmL:{a:.0f},pwmR:{b:.0f},encL:{c:.0f},encR:{d:.0f},modeL:{m:.0f}\r\n"
        for t, a, b, c, d, m in rows
    )


def test_serial_monitor_of_a_micromouse(bring_in, run):
    text = serial_monitor(run, 204.0)
    with pytest.raises(InputError, match=r"'encL': turns .* --counts N"):
        bring_in(text)
    imported = bring_in(text, counts=3000.0)
    assert_same(imported, run, WHEELS, atol=0.02)
    said = "\n".join(imported.guesses + imported.repairs)
    assert "'pwmL' is left_duty_pct, in pwm255 (at most 204, named pwm)" in said
    assert "'encL': begins at 625.2 deg: counted from there" in said
    assert "passed over 'modeL'" in said


def test_pwm_below_100_asks_of_what(bring_in, run):
    text = serial_monitor(run, 66.0)
    with pytest.raises(InputError, match="pwmL, pwmR: at most 66, of 100 or of 255"):
        bring_in(text, counts=3000.0)
    said = parse_said(["pwmL=left_duty_pct:pwm255", "pwmR=right_duty_pct:pwm255"])
    imported = bring_in(text, counts=3000.0, said=said)
    assert np.nanmax(imported.recording.left_duty) == pytest.approx(66 / 255, abs=1e-6)


def test_modes_are_no_duties(bring_in):
    t, angle = step(60.0)
    columns = (t, np.full(len(t), 2.0), angle)
    with pytest.raises(InputError, match="cmd: holds only 2: a mode"):
        bring_in(text_of(("t", "cmd", "angle"), columns), setup=BENCH)
    imported = bring_in(
        text_of(("t", "left_mode", "angle"), columns),
        setup=BENCH,
        commands={"left_duty_pct": command_of("60")},
    )
    assert "passed over 'left_mode'" in "\n".join(imported.guesses)


def test_numpy_names_in_a_remark_and_units_on_a_line_of_their_own(bring_in, run):
    text = brick_log(run)
    assert_same(bring_in("# " + text), run, atol=1e-8)
    head, rest = text.split("\n", 1)
    assert_same(bring_in(f"{head}\ns,%,%,deg,deg,%,V\n{rest}"), run, atol=1e-8)


# Neato: wheels as distances, commands as speeds; a Roomba: speeds alone


def neato(speed_mode=True):
    robot = load_robot("ev3")
    mode = "speed" if speed_mode else "duty"
    return robot.model_copy(update={"drive": robot.drive.model_copy(update={"mode": mode, "duty_cap": 1.0})})


def test_wheels_as_distances_and_commands_as_speeds(tmp_path, run):
    mm = 1000.0 * RADIUS
    wheels = [4200.0 + mm * run.left_angle_rad, 4100.0 + mm * run.right_angle_rad]
    commands = [10.0 * np.deg2rad(duty) * mm for duty in duties(run)]
    names = (
        "Time",
        "LeftWheel_CommandInMM/s",
        "RightWheel_CommandInMM/s",
        "LeftWheel_PositionInMM",
        "RightWheel_PositionInMM",
    )
    path = tmp_path / "neato.csv"
    path.write_text(text_of(names, (run.t_s, *commands, *wheels)))
    (imported,) = import_logs([path], neato(), Setup(), ImportOptions())
    assert_same(imported, run, WHEELS, atol=1e-6)
    with pytest.raises(InputError, match="a command in mm_s is a speed, and robot ev3 takes a duty"):
        import_logs([path], neato(speed_mode=False), Setup(), ImportOptions())


@pytest.mark.parametrize(("unit", "factor"), [("deg/s", 1.0), ("rpm", 1 / 6), ("m/s", np.deg2rad(RADIUS))])
def test_wheel_speeds_add_up_to_angles(bring_in, run, unit, factor):
    speeds = [np.gradient(column(run, f"{side}_angle_rad"), run.t_s) * factor for side in ("left", "right")]
    names = ("time", "left duty", "right duty", f"left speed [{unit}]", f"right speed [{unit}]")
    imported = bring_in(text_of(names, (run.t_s, *duties(run), *speeds)))
    assert_same(imported, run, WHEELS[3:], atol=np.deg2rad(3.0))
    assert any("speeds added up to left_angle_deg" in line for line in imported.repairs)


def test_setpoints_and_currents_are_passed_over(bring_in, run):
    names = (*BRICK, "left_target", "left_current", "right speed_sp", "left_speed")
    extra = [np.arange(len(run.t_s)) % 7.0] * 4
    columns = [np.array([float(v) for v in row.split(",")]) for row in brick_log(run).strip().split("\n")[1:]]
    imported = bring_in(text_of(names, (*np.array(columns).T, *extra)))
    assert_same(imported, run, atol=1e-8)
    assert "passed over 'left_target', 'left_current', 'right speed_sp', 'left_speed'" in imported.guesses[-1]


# EV3 under Python: semicolons, names with points


def test_ev3dev_log(bring_in, run):
    names = ("time", "left.duty_cycle_sp", "right.duty_cycle_sp", "left.position", "right.position")
    text = text_of(
        names, (run.t_s, *duties(run), *(column(run, f"{s}_angle_rad") for s in ("left", "right"))), ";"
    )
    assert_same(bring_in(text), run, WHEELS, atol=1e-8)


def test_times_of_day(bring_in, run):
    stamps = [f"2026-11-21 12:{int(t // 60):02d}:{t % 60:06.3f}" for t in run.t_s]
    imported = bring_in(text_of(("timestamp", "left duty", "right duty"), (stamps, *duties(run))))
    assert_same(imported, run, WHEELS[:3], atol=1e-4)


@pytest.mark.parametrize("first", [0.0, 3412.0, -77.0])
def test_encoders_are_counted_from_where_they_began(bring_in, first):
    t, angle = step(60.0, first_deg=first)
    imported = bring_in(text_of(("t", "duty", "angle"), (t, np.full(len(t), 60.0), angle)), setup=BENCH)
    assert imported.recording.left_angle_rad[0] == 0.0
    columns = {"t_s": t, "left_duty_pct": np.full(len(t), 60.0), "left_angle_deg": angle}
    np.testing.assert_allclose(
        make_recording("r", columns, BENCH).left_angle_rad, imported.recording.left_angle_rad
    )


def test_what_a_wheel_turned_before_the_first_row_stays():
    t, angle = step(60.0)
    columns = {"t_s": t[5:], "left_duty_pct": np.full(len(t) - 5, 60.0), "left_angle_deg": angle[5:]}
    assert np.rad2deg(make_recording("late", columns, BENCH).left_angle_rad[0]) == pytest.approx(angle[5])


# ROS


def odometry(run, style):
    """Return poses as ``rostopic echo -p`` writes them, or as bagpy does."""
    seen = ~np.isnan(run.x_m)
    half = run.heading_rad[seen] / 2
    where, around = ("field.", "%time") if style == "echo" else ("", "Time")
    names = [around, f"{where}header.seq", f"{where}header.frame_id"]
    names += [f"{where}pose.pose.position.{axis}" for axis in "xyz"]
    names += [f"{where}pose.pose.orientation.{axis}" for axis in "xyzw"]
    names += [f"{where}twist.twist.linear.x", f"{where}twist.twist.angular.z"]
    time = 1.7e9 + run.t_s[seen]
    times = [f"{1e9 * t:.0f}" for t in time] if style == "echo" else [f"{t:.6f}" for t in time]
    zero = np.zeros(seen.sum())
    columns = (times, np.arange(seen.sum()), ["odom"] * len(time), run.x_m[seen], run.y_m[seen], zero, zero, zero,
               np.sin(half), np.cos(half), zero + 0.1, zero)  # fmt: skip
    return text_of(names, columns)


@pytest.mark.parametrize("style", ["echo", "bagpy"])
def test_ros_odometry_beside_the_robots_log(bring_in, run, style):
    imported = bring_in(brick_log(run), odometry(run, style))
    errors = pose_errors(imported, run)
    assert max(np.std(e) for e in errors[:2]) < 0.002
    assert np.std(np.angle(np.exp(1j * errors[2]))) < 0.02


def test_topics_of_one_bag_are_joined_by_their_clock(tmp_path, run):
    stamp = [f"{1e9 * (1.7e9 + t):.0f}" for t in run.t_s]
    commands = text_of(("%time", "field.left_duty", "field.right_duty"), (stamp, *duties(run)))
    angles = [run.left_angle_rad, run.right_angle_rad]
    wheels = text_of(("%time", "field.left_position", "field.right_position"), (stamp, *angles))
    with pytest.raises(InputError, match=r"file1.txt: neither commands nor x and y.*--one-clock"):
        import_all(tmp_path, commands, wheels)
    said = parse_said(["field.left_position=left_angle_deg:rad", "field.right_position=right_angle_deg:rad"])
    imported = import_texts(tmp_path, commands, wheels, odometry(run, "echo"), one_clock=True, said=said)
    found = imported.recording
    seen = ~np.isnan(found.left_angle_rad)
    np.testing.assert_allclose(found.left_angle_rad[seen], run.left_angle_rad, atol=1e-6)
    assert np.isfinite(found.x_m).sum() == np.isfinite(run.x_m).sum()


def test_a_ros_bag_itself_is_refused_with_what_to_do(tmp_path):
    (tmp_path / "run.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(InputError, match="expected its topics as CSV: rostopic echo -b"):
        import_logs([tmp_path / "run.bag"], load_robot("ev3"), Setup(), ImportOptions())


# Several runs, several files


def test_a_column_that_counts_runs_parts_them(tmp_path, run):
    half = len(run.t_s) // 2
    number = np.r_[np.full(half, 1.0), np.full(len(run.t_s) - half, 2.0)]
    names = ("trial", "t", "left duty", "right duty")
    found = import_all(tmp_path, text_of(names, (number, run.t_s, *duties(run))))
    assert [len(each.recording.t_s) for each in found] == [half, len(run.t_s) - half]


def test_cameras_go_to_their_runs_in_order(tmp_path, run):
    other = drive(4)
    found = import_all(
        tmp_path, brick_log(run), brick_log(other), camera_log(run), camera_log(other, shift=2.0)
    )
    assert [each.recording.name for each in found] == ["file0", "file1"]
    for each, true in zip(found, (run, other), strict=True):
        assert max(np.std(e) for e in pose_errors(each, true)[:2]) < 0.002


# MATLAB and Excel


def matlab(folder, **variables):
    savemat(folder / "log.mat", variables, do_compression=True)
    return folder / "log.mat"


def from_file(path, setup=None, robot="ev3", **options):
    return import_logs([path], load_robot(robot), setup or Setup(), ImportOptions(**options))


def test_matlab_vectors_with_a_motors_voltage(tmp_path, run):
    volts = 0.01 * load_robot("ev3").battery.voltage
    left, right = (volts * duty[:, None] for duty in duties(run))
    angles = {f"{side}_enc": column(run, f"{side}_angle_rad") for side in ("left", "right")}
    voltages = {"left_voltage": left, "right_voltage": right}
    path = matlab(tmp_path, t=run.t_s[:, None], **voltages, **angles, gain=3.0, words="EMPS")
    (imported,) = from_file(path)
    assert_same(imported, run, WHEELS, atol=1e-6)
    assert "log.mat: MATLAB file, 1200 rows" in imported.guesses


def test_simulink_structure_with_time_and_an_array_of_runs(tmp_path, run):
    def signal(label, values):
        return {"values": values, "label": label}

    signals = [signal("left_duty", duties(run)[0]), signal("right_duty", duties(run)[1])]
    (imported,) = from_file(matlab(tmp_path, out={"time": run.t_s, "signals": signals}))
    assert_same(imported, run, WHEELS[:3], atol=1e-8)
    each = {"t": run.t_s, "left_duty": duties(run)[0], "right_duty": duties(run)[1]}
    found = from_file(matlab(tmp_path, runs=[each, each]))
    assert [one.recording.name for one in found] == ["log_1", "log_2"]


def test_quarc_matrix_takes_its_first_row_for_time(tmp_path, run):
    path = matlab(tmp_path, data_log=np.vstack([run.t_s, *duties(run)]))
    said = parse_said(["data_log_b=left_duty_pct", "data_log_c=right_duty_pct"])
    assert_same(from_file(path, said=said)[0], run, WHEELS[:3], atol=1e-8)


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"\x89HDF\r\n\x1a\n" + bytes(600), "expected version 7: save"),
        (b"nothing of the kind" * 20, "no MATLAB file"),
        (bytes(200), "no MATLAB file|expected a vector of times"),
    ],
)
def test_what_is_no_matlab_file_of_version_7_is_refused(tmp_path, raw, message):
    (tmp_path / "log.mat").write_bytes(raw)
    with pytest.raises(InputError, match=message):
        from_file(tmp_path / "log.mat")


def test_a_matlab_file_that_unpacks_to_gigabytes_is_refused(tmp_path):
    path = matlab(tmp_path, t=np.zeros(2**26), u=np.zeros(2**26, np.uint8))
    assert path.stat().st_size < 10**6
    with pytest.raises(InputError, match="unpacks to more, expected at most 268 MB"):
        from_file(path)


def test_excel_workbook_of_two_sheets(tmp_path, run):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for k, sheet in enumerate((book.active, book.create_sheet("two"), book.create_sheet("notes"))):
        if k == 2:
            sheet.append(["calibrated on Monday"])
            continue
        sheet.append(["Robot 7"])
        sheet.append(["Time [s]", "left duty", "right duty", "left angle", "right angle"])
        angles = (column(run, "left_angle_rad"), column(run, "right_angle_rad"))
        for row in zip(run.t_s, *duties(run), *angles, strict=True):
            sheet.append([float(value) for value in row])
    book.save(tmp_path / "log.xlsx")
    found = from_file(tmp_path / "log.xlsx")
    assert len(found) == 2
    assert_same(found[1], run, WHEELS, atol=1e-8)


def test_an_excel_file_without_openpyxl_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    (tmp_path / "log.xlsx").write_bytes(b"PK")
    with pytest.raises(InputError, match=r"pip install 'gecar\[excel\]'"):
        from_file(tmp_path / "log.xlsx")


# Commands that were not logged


def test_a_formula_is_worked_out_and_nothing_else_is():
    t = np.linspace(0.0, 2.0, 41)
    np.testing.assert_allclose(command_of("100*sin(2*pi*t)")(t), 100.0 * np.sin(2 * np.pi * t))
    np.testing.assert_allclose(
        command_of("60*(t < 1) - max(t^2, 1)")(t), 60.0 * (t < 1) - np.maximum(t**2, 1.0)
    )
    np.testing.assert_allclose(command_of("-40")(t), np.full(41, -40.0))


@pytest.mark.parametrize(
    "text",
    ["", "x", "t.real", "__import__('os')", "t[0]", "lambda: t", "sin(t, t)", "sin", "'a'", "True", "1 < t < 2",
     "(" * 400 + "t" + ")" * 400, "t+" * 240 + "t+", "max(t)", "sin(x=t)", "[t for t in t]", "t if t else t"],
)  # fmt: skip
def test_what_is_no_formula_is_refused_in_a_line(text):
    with pytest.raises(InputError, match="--command: found"):
        command_of(text)


def test_a_formula_that_is_no_number_somewhere_is_refused():
    with pytest.raises(InputError, match="is no number at t = 0 s"):
        command_of("1/t")(np.array([0.0, 1.0]))


# The cap on duty


@pytest.mark.parametrize(("dps_at_100", "cap"), [(900.0, 1.0), (720.0, None)], ids=["not capped", "capped"])
def test_speeds_tell_whether_full_duty_was_capped(tmp_path, dps_at_100, cap):
    texts = []
    for duty, rate in ((40.0, 9.0), (60.0, 9.0), (100.0, dps_at_100 / 100.0)):
        t, angle = step(duty, dps_per_pct=rate)
        texts.append(text_of(("t", "duty", "angle"), (t, np.full(len(t), duty), angle)))
    found = import_all(tmp_path, *texts, setup=BENCH)
    assert [each.recording.setup.duty_cap for each in found] == [cap] * 3
    assert any("duties reach 100 %, beyond the cap of robot ev3" in line for line in found[0].guesses)


def test_a_full_power_bench_without_a_cap_of_its_own_is_warned_of(gecar, tmp_path):
    for duty in (40.0, 100.0):
        t, angle = step(duty)
        text = text_of(("t_s", "left_duty_pct", "left_angle_deg"), (t, np.full(len(t), duty), angle))
        (tmp_path / f"step_{duty:.0f}.csv").write_text(text)
        (tmp_path / f"step_{duty:.0f}.toml").write_text('rig = "bench"\n')
    said = "warning: duties reach 100 %, beyond the cap of robot ev3, 80 %; wheels turn faster beyond"
    assert said in gecar("compare", "step_40.csv", "step_100.csv", "--no-picture").out
    (tmp_path / "step_100.toml").write_text('rig = "bench"\nduty_cap = 1.0\n')
    assert "warning" not in gecar("compare", "step_40.csv", "step_100.csv", "--no-picture").out


def test_a_cap_that_was_said_or_is_not_reached_is_left_alone(bring_in):
    t, angle = step(60.0)
    text = text_of(("t", "duty", "angle"), (t, np.full(len(t), 60.0), angle))
    assert bring_in(text, setup=BENCH).recording.setup.duty_cap is None
    full = text_of(("t", "duty", "angle"), (t, np.full(len(t), 100.0), angle))
    assert bring_in(full, setup=Setup(rig="bench", duty_cap=0.9)).recording.setup.duty_cap == 0.9


def test_a_sine_on_a_bench_is_not_capped(bring_in):
    t, angle = step(60.0)
    imported = bring_in(
        text_of(("t", "angle"), (t, angle)),
        setup=BENCH,
        commands={"left_duty_pct": command_of("100*sin(2*pi*t)")},
    )
    assert imported.recording.setup.duty_cap == 1.0
