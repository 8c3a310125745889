"""Import: what people have on disk, in their units and under their names, becomes a recording."""

import numpy as np
import pytest
from support.foreign_logs import (
    BRICK,
    assert_same,
    brick_log,
    camera_log,
    pose_errors,
    table,
)

from gecar.errors import InputError
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.importing.command_formula import command_of
from gecar.reality.recordings.importing.frame import Frame
from gecar.reality.recordings.importing.meaning import guess_meanings, parse_said
from gecar.reality.recordings.recording import read_recording, write_recording
from gecar.reality.recordings.setup import Setup


def test_recording_format_itself_comes_through(bring_in, run):
    imported = bring_in(table(run, tuple(COLUMNS)[:10]))
    assert_same(imported, run, tuple(COLUMNS)[:10], atol=1e-8)
    assert imported.repairs == ()


def test_datalog_with_names_and_units_of_its_own(bring_in, run):
    names = ("time", "lm", "rm", "left", "right", "light", "battery")
    imported = bring_in(
        brick_log(run, names=names, separator=", ", factors={"t_s": 1000.0, "battery_v": 1000.0})
    )
    assert_same(imported, run, atol=1e-8)
    assert "file0.txt: Pybricks DataLog, 1200 rows" in imported.guesses
    assert "file0.txt: 'time' is t_s, in ms (steps of 10)" in imported.guesses
    assert any("'battery' is battery_v, in mv" in line for line in imported.guesses)


def test_terminal_capture_mixed_with_text(bring_in, run):
    lines = brick_log(run).split("\n")
    lines[300:300] = ["low battery, stop soon", ">>> 12"]
    text = "\r\n".join(["Pybricks 4.0", "# white 62, black 6", "Press CENTER", *lines, "Done."])
    imported = bring_in(text)
    assert_same(imported, run, atol=1e-8)
    assert any("passed over lines 1, 3, 304, 305, 1208: other text" in line for line in imported.repairs)
    assert "white 62, black 6" in imported.recording.setup.notes


def test_tracker_export_joins_the_bricks_log(bring_in, run):
    seen = ~np.isnan(run.x_m)
    rows = zip(run.t_s[seen] - 2.5, 100 * run.x_m[seen], 100 * run.y_m[seen], strict=True)
    tracker = "mass A\nt\tx\ty\t\n" + "\n".join(f"{t:.6E}\t{x:.4E}\t{y:.4E}\t" for t, x, y in rows)
    imported = bring_in(tracker, brick_log(run))
    assert imported.offset.offset_s == pytest.approx(2.5, abs=0.003)
    assert max(np.std(e) for e in pose_errors(imported, run)[:2]) < 0.002
    assert np.isnan(imported.recording.heading_rad).all()


def test_tracker_export_of_several_tracks_takes_the_first(bring_in, run):
    seen = ~np.isnan(run.x_m)
    rows = zip(run.t_s[seen], run.x_m[seen], run.y_m[seen], strict=True)
    body = "\n".join(f"{t:.4f}\t{x:.4f}\t{y:.4f}\t0\t0\t" for t, x, y in rows)
    imported = bring_in("#multi:\n\tfront\t\trear\t\t\nt\tx\ty\tx\ty\t\n" + body, brick_log(run))
    assert "file0.txt: 'front x' is x_m, in m" in "\n".join(imported.guesses)
    assert max(np.std(e) for e in pose_errors(imported, run)[:2]) < 0.002


def test_camera_in_pixels_y_down_clockwise_radians(bring_in, run):
    seen = ~np.isnan(run.x_m)
    heading = (-run.heading_rad[seen] + np.pi) % (2 * np.pi) - np.pi
    rows = zip(
        1.7e12 + 1000 * run.t_s[seen],
        100 + 800 * run.x_m[seen],
        1000 - 800 * run.y_m[seen],
        heading,
        strict=True,
    )
    camera = "timestamp;x_px;y_px;theta\n" + "\n".join(
        f"{t:.0f};{x:.1f};{y:.1f};{h:.4f}" for t, x, y, h in rows
    )
    imported = bring_in(brick_log(run), camera, frame=Frame(origin=(100, 1000)))
    errors = pose_errors(imported, run)
    assert max(np.std(e) for e in errors[:2]) < 0.002
    assert max(abs(np.mean(e)) for e in errors[:2]) < 0.01  # the scale is the encoders'
    assert np.abs(errors[2]).max() < 0.03


@pytest.mark.parametrize("unit", ["cm", "mm"])
def test_wrong_unit_of_length_is_found_by_the_encoders(bring_in, run, unit):
    factor = {"cm": 100.0, "mm": 1000.0}[unit]
    camera = camera_log(run, factors={"x_m": factor, "y_m": factor}, shift=4.0)
    imported = bring_in(brick_log(run), camera)
    assert max(np.abs(e).max() for e in pose_errors(imported, run)) < 0.06


def test_camera_whose_headings_start_elsewhere(bring_in, run):
    seen = ~np.isnan(run.x_m)
    rows = zip(
        run.t_s[seen], run.x_m[seen], run.y_m[seen], np.rad2deg(run.heading_rad[seen]) + 90, strict=True
    )
    camera = "t,x,y,yaw\n" + "\n".join(f"{t:.3f},{x:.4f},{y:.4f},{h % 360:.1f}" for t, x, y, h in rows)
    imported = bring_in(brick_log(run), camera)
    error = pose_errors(imported, run)[2]
    assert abs(np.median(np.exp(1j * error).imag)) < 0.05
    assert any("deg where the robot faces along x" in line for line in imported.repairs)


def test_mark_off_the_axle_is_moved_onto_it(bring_in, run):
    seen = ~np.isnan(run.x_m)
    x, y, h = run.x_m[seen], run.y_m[seen], run.heading_rad[seen]
    rows = zip(run.t_s[seen], x + 0.05 * np.cos(h), y + 0.05 * np.sin(h), np.rad2deg(h), strict=True)
    camera = "t,x,y,yaw\n" + "\n".join(f"{t:.3f},{a:.4f},{b:.4f},{c:.2f}" for t, a, b, c in rows)
    imported = bring_in(brick_log(run), camera, frame=Frame(mark=(0.05, 0.0), heading_zero_deg=0.0))
    assert max(np.std(e) for e in pose_errors(imported, run)[:2]) < 0.003


def test_columns_named_as_a_recordings_keep_their_frame(bring_in, run):
    mirrored = camera_log(run, factors={"y_m": -1.0, "heading_deg": -1.0})
    imported = bring_in(brick_log(run), mirrored)
    assert (
        np.std(imported.recording.y_m[~np.isnan(imported.recording.y_m)] + run.y_m[~np.isnan(run.y_m)]) < 1e-6
    )
    assert any("y points down? Left as it is" in line for line in imported.repairs)
    other = bring_in(brick_log(run), mirrored.replace("x_m,y_m,heading_deg", "x,y,theta_deg"))
    assert any("y points down: turned over" in line for line in other.repairs)


def test_camera_that_sees_less_than_the_wheels_tell_is_believed(bring_in, run):
    imported = bring_in(brick_log(run), camera_log(run, factors={"x_m": 0.7, "y_m": 0.7}))
    assert np.nanmax(np.abs(imported.recording.x_m)) < 0.72 * np.nanmax(np.abs(run.x_m))
    assert any("it moves 0.70 times as far as the wheels" in line for line in imported.repairs)


def test_first_pose_is_put_on_the_start(bring_in, run):
    imported = bring_in(brick_log(run), camera_log(run), frame=Frame(start=(0.15, 0.6, np.pi / 2)))
    found = imported.recording
    first = np.flatnonzero(~np.isnan(found.x_m))[0]
    at = (found.x_m[first], found.y_m[first], found.heading_rad[first])
    np.testing.assert_allclose(at, (0.15, 0.6, np.pi / 2), atol=0.02)


def test_decimal_commas_and_utf16(bring_in, run):
    text = brick_log(run, separator=";").replace(".", ",")
    assert_same(bring_in(text.encode("utf-16")), run, atol=1e-8)


def test_file_without_names_takes_them_from_the_user(bring_in, run):
    text = brick_log(run).split("\n", 1)[1]
    with pytest.raises(InputError, match="no line of column names above the numbers"):
        bring_in(text)
    assert_same(bring_in(text, names=BRICK), run, atol=1e-8)


def test_command_that_was_not_logged_is_said(bring_in):
    text = "time, angle\n" + "\n".join(f"{t}, {t // 2}" for t in range(3, 1000, 10))
    with pytest.raises(InputError, match="no column looks like a command to a motor"):
        bring_in(text)
    imported = bring_in(text, commands={"left_duty_pct": command_of("60")}, setup=Setup(rig="bench"))
    np.testing.assert_allclose(imported.recording.left_duty, 0.6)
    assert imported.recording.left_angle_rad[-1] == pytest.approx(np.deg2rad(496))


def test_what_is_imported_is_a_recording(tmp_path, bring_in, run):
    imported = bring_in(brick_log(run), camera_log(run, shift=-3.0))
    write_recording(imported.recording, tmp_path / "run.csv")
    again = read_recording(tmp_path / "run.csv")
    np.testing.assert_allclose(again.x_m, imported.recording.x_m, atol=1e-8)
    assert again.setup.notes == "imported from file0.txt and file1.txt"


def test_columns_are_what_the_user_says(bring_in, run):
    names = ("a", "b", "c", "d", "e", "f", "g")
    said = parse_said([f"{name}={column}" for name, column in zip(names, BRICK, strict=True)])
    assert_same(bring_in(brick_log(run, names=names), said=said), run, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("left", "expected NAME=COLUMN"),
        ("a=b", "found 'b' in 'a=b'"),
        ("a=t_s:km", "the unit 'km', expected one of s"),
    ],
)
def test_what_the_user_says_wrongly_is_named(text, message):
    with pytest.raises(InputError, match=message):
        parse_said([text])


@pytest.mark.parametrize(
    ("name", "column", "unit"),
    [
        ("time_ms", "t_s", "ms"),
        ("Timestamp (s)", "t_s", "s"),
        ("leftDuty", "left_duty_pct", None),
        ("rpwm", "right_duty_pct", None),
        ("R motor power [%]", "right_duty_pct", "pct"),
        ("encoder_left", "left_angle_deg", None),
        ("left_rad", "left_angle_deg", "rad"),
        ("colour sensor", "reflection_pct", None),
        ("battery mV", "battery_v", "mv"),
        ("gyro_rate", "yaw_rate_dps", None),
        ("x [mm]", "x_m", "mm"),
        ("pos_y_cm", "y_m", "cm"),
        ("theta_deg", "heading_deg", "deg"),
        ("left_speed", "left_speed_dps", None),
        ("comment", None, None),
    ],
)
def test_names_are_understood(name, column, unit):
    meaning = guess_meanings([name], [500.0], {})[0]
    assert (meaning.column, meaning.unit) == (column, unit)


def test_ports_tell_left_from_right():
    found = guess_meanings(["motor B", "motor C", "angle B", "angle C"], [80, 80, 900, 900], {})
    assert [m.column for m in found] == [
        "left_duty_pct",
        "right_duty_pct",
        "left_angle_deg",
        "right_angle_deg",
    ]
