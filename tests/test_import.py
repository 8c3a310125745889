"""Import: what people have on disk becomes the recording it came from; damage is mended or refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import drive

from gecar.errors import InputError
from gecar.reality.columns import COLUMNS
from gecar.reality.importing.clock import compare, estimate_offset
from gecar.reality.importing.frame import Frame
from gecar.reality.importing.logs import ImportOptions, import_logs
from gecar.reality.importing.meaning import guess_meanings, parse_said
from gecar.reality.importing.track import Track, odometry
from gecar.reality.recording import read_recording, write_recording
from gecar.reality.setup import Setup
from gecar.world.robot import load_robot

BRICK = (
    "t_s",
    "left_duty_pct",
    "right_duty_pct",
    "left_angle_deg",
    "right_angle_deg",
    "reflection_pct",
    "battery_v",
)
POSE = ("t_s", "x_m", "y_m", "heading_deg")


@pytest.fixture(scope="module")
def run():
    return drive(3)


@pytest.fixture
def bring_in(tmp_path):
    """Write files and import them; return what came of it."""

    def _bring_in(*texts, setup=None, **options):
        paths = []
        for k, text in enumerate(texts):
            paths.append(tmp_path / f"file{k}.txt")
            paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
        return import_logs(paths, load_robot("ev3"), setup or Setup(), ImportOptions(**options))

    return _bring_in


def table(recording, columns, *, names=None, separator=",", factors=None, rows=slice(None), shift=0.0):
    """Return a recording's columns as text, under other names and in other units."""
    factors = factors or {}
    series = []
    for column in columns:
        field, factor = COLUMNS[column]
        values = getattr(recording, field) / factor + (shift if column == "t_s" else 0.0)
        series.append(values[rows] * factors.get(column, 1.0))
    lines = [
        separator.join("" if np.isnan(v) else f"{v:.10g}" for v in row) for row in zip(*series, strict=True)
    ]
    return "\n".join([separator.join(names or columns), *lines]) + "\n"


def brick_log(recording, **how):
    return table(recording, BRICK, **how)


def camera_log(recording, **how):
    return table(recording, POSE, rows=~np.isnan(recording.x_m), **how)


def with_line(text, number, change):
    """Return text with one line (0 is the header) changed."""
    lines = text.split("\n")
    lines[number] = change(lines[number])
    return "\n".join(lines)


def assert_same(imported, recording, columns=BRICK, **tolerance):
    for column in columns:
        field = COLUMNS[column][0]
        np.testing.assert_allclose(getattr(imported.recording, field), getattr(recording, field), **tolerance)


def pose_errors(imported, recording):
    """Return the imported pose less the recorded one, at the imported times [m, m, rad]."""
    found, seen = imported.recording, ~np.isnan(recording.x_m)
    at = ~np.isnan(found.x_m)
    fields = ("x_m", "y_m", "heading_rad")
    track = [np.interp(found.t_s[at], recording.t_s[seen], getattr(recording, f)[seen]) for f in fields]
    return [getattr(found, f)[at] - t for f, t in zip(fields, track, strict=True)]


# --- formats, there and back


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
    imported = bring_in(text, constant={"left_duty_pct": 60.0}, setup=Setup(rig="bench"))
    np.testing.assert_allclose(imported.recording.left_duty, 0.6)
    assert imported.recording.left_angle_rad[-1] == pytest.approx(np.deg2rad(496))


def test_what_is_imported_is_a_recording(tmp_path, bring_in, run):
    imported = bring_in(brick_log(run), camera_log(run, shift=-3.0))
    write_recording(imported.recording, tmp_path / "run.csv")
    again = read_recording(tmp_path / "run.csv")
    np.testing.assert_allclose(again.x_m, imported.recording.x_m, atol=1e-8)
    assert again.setup.notes == "imported from file0.txt and file1.txt"


# --- recordings of a 3D simulation, where they are at hand

PRACTICE = sorted((Path(__file__).parents[2] / "shared/recordings/practice/p01").glob("*.csv"))


@pytest.mark.skipif(not PRACTICE, reason="needs ../shared/recordings/practice")
def test_practice_recordings_come_through_as_they_are(tmp_path):
    for path in PRACTICE:
        recording = read_recording(path)
        imported = import_logs([path], load_robot("ev3"), Setup(), ImportOptions())
        assert imported.repairs == ()
        assert_same(imported, recording, tuple(COLUMNS)[:10], atol=1e-9)


@pytest.mark.skipif(not PRACTICE, reason="needs ../shared/recordings/practice")
def test_practice_logs_in_two_files_are_joined_within_four_milliseconds(bring_in):
    for path in PRACTICE:
        recording = read_recording(path)
        imported = bring_in(brick_log(recording), camera_log(recording, shift=33.3))
        assert imported.offset.offset_s == pytest.approx(-33.3, abs=0.004)


# --- clocks


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("headings", [True, False])
def test_clock_offset_is_found_within_two_milliseconds(seed, headings):
    recording = drive(seed)
    seen = ~np.isnan(recording.x_m)
    camera = Track(
        recording.t_s[seen][40:] - 61.2345,
        1000 * recording.x_m[seen][40:],
        -1000 * recording.y_m[seen][40:],
        -recording.heading_rad[seen][40:] if headings else None,
    )
    brick = odometry(recording.t_s, recording.left_angle_rad, recording.right_angle_rad, 0.028, 0.12)
    found = estimate_offset(brick, camera)
    assert found.offset_s == pytest.approx(61.2345, abs=0.002)
    assert found.deviation_s < 0.004
    likeness = compare(brick, camera, found.offset_s)
    assert likeness.scale == pytest.approx(0.001, rel=0.01)
    assert likeness.mirrored
    assert np.isnan(likeness.heading_factor) or likeness.heading_factor == pytest.approx(-1.0, rel=0.01)


def test_camera_of_another_run_is_refused(bring_in, run):
    with pytest.raises(InputError, match=r"at no offset do camera and encoders agree"):
        bring_in(brick_log(run), camera_log(drive(4)))


def test_two_offsets_that_agree_alike_are_refused(bring_in):
    t = np.arange(0, 12, 0.01)
    duty = np.where(np.sin(2 * np.pi * t / 3) > 0, 80.0, 20.0)
    speed = 9 * duty
    angle = np.cumsum(speed) * 0.01
    rows = zip(t, duty, duty, angle, angle, strict=True)
    brick = ",".join(BRICK[:5]) + "\n" + "\n".join(",".join(f"{v:.4f}" for v in row) for row in rows)
    camera = "t,x,y\n" + "\n".join(
        f"{a:.3f},{np.deg2rad(b) * 0.028:.4f},0" for a, b in zip(t, angle, strict=True)
    )
    with pytest.raises(InputError, match="agree at several offsets"):
        bring_in(brick, camera)
    assert bring_in(brick, camera, offset_s=0.0).offset is None


def test_without_encoders_the_offset_must_be_said(bring_in, run):
    commands = table(run, BRICK[:3])
    with pytest.raises(InputError, match="no encoders to align the camera's clock by"):
        bring_in(commands, camera_log(run))
    imported = bring_in(commands, camera_log(run), offset_s=0.0)
    assert np.abs(pose_errors(imported, run)[0]).max() < 1e-6


# --- damage


def test_cut_last_line_is_left_out(bring_in, run):
    imported = bring_in(brick_log(run)[:-20])
    assert len(imported.recording.t_s) == 1199
    assert "file0.txt: left out line 1201: not 7 fields" in imported.repairs


def test_repeated_and_misplaced_times_are_left_out(bring_in, run):
    text = with_line(brick_log(run), 100, lambda line: "3.5" + line[line.index(",") :])
    text = with_line(text, 200, lambda line: line + "\n" + line)
    imported = bring_in(text)
    assert len(imported.recording.t_s) == 1199
    assert any("1 rows whose time the next row repeats" in line for line in imported.repairs)
    assert any("1 rows whose time is out of order (3.5)" in line for line in imported.repairs)


def test_clock_that_starts_again_keeps_the_longer_stretch(bring_in, run):
    short, long = brick_log(run, rows=slice(0, 200)), brick_log(run)
    imported = bring_in(short + long.split("\n", 1)[1])
    assert_same(imported, run, atol=1e-8)
    assert any("stretches of 200, 1200 rows" in line for line in imported.repairs)


def test_one_of_several_runs_in_a_file(bring_in, run):
    text = brick_log(run, rows=slice(0, 200)) + "Start again\n" + brick_log(run)
    assert_same(bring_in(text), run, atol=1e-8)
    assert len(bring_in(text, run=1).recording.t_s) == 200
    with pytest.raises(InputError, match="--run: found 3, expected 1 to 2"):
        bring_in(text, run=3)


def test_times_in_milliseconds_under_a_name_that_says_seconds(bring_in, run):
    imported = bring_in(brick_log(run, factors={"t_s": 1000.0}))
    assert_same(imported, run, atol=1e-8)
    assert "file0.txt: 't_s' is t_s, in ms (steps of 10)" in imported.guesses


@pytest.mark.parametrize("name", ["left_angle_deg", "left angle"])
def test_angles_in_radians_are_found_by_the_motors_speed(bring_in, run, name):
    text = brick_log(run, factors={"left_angle_deg": np.pi / 180}).replace("left_angle_deg", name)
    assert_same(bring_in(text), run, atol=1e-8)


def test_duty_as_a_fraction(bring_in, run):
    assert_same(
        bring_in(brick_log(run, factors={"left_duty_pct": 0.01, "right_duty_pct": 0.01})), run, atol=1e-8
    )


def test_encoder_that_wraps_resets_and_spikes_is_mended(bring_in, run):
    def edit(angle):
        angle = angle.copy()
        angle[400:] -= angle[400]
        angle[900] = 31000
        return angle

    rows = brick_log(run).strip().split("\n")[1:]
    cells = np.array([row.split(",") for row in rows], dtype=float)
    cells[:, 3] = edit(cells[:, 3])
    cells[:, 4] = np.mod(cells[:, 4], 360.0)
    text = ",".join(BRICK) + "\n" + "\n".join(",".join(f"{v:.8g}" for v in row) for row in cells)
    imported = bring_in(text)
    kept = np.arange(1200) != 900
    np.testing.assert_allclose(
        imported.recording.left_angle_rad[kept], run.left_angle_rad[kept], atol=np.deg2rad(4)
    )
    turned = imported.recording.right_angle_rad - run.right_angle_rad
    np.testing.assert_allclose(turned, turned[0], atol=1e-6)
    said = "\n".join(imported.repairs)
    assert "'left_angle_deg': blanked wild values at 9 s" in said
    assert "'left_angle_deg': carried on after resets to 0 at 4 s" in said
    assert "'right_angle_deg': unwrapped at" in said


def test_encoder_jump_of_no_known_kind_is_refused(bring_in, run):
    rows = brick_log(run).strip().split("\n")
    for k in range(600, len(rows)):
        cells = rows[k].split(",")
        rows[k] = ",".join([*cells[:3], str(float(cells[3]) + 5000), *cells[4:]])
    with pytest.raises(InputError, match="no wheel turns so, and it is no wrap, reset or spike"):
        bring_in("\n".join(rows))


def test_lost_marks_are_blanked(bring_in, run):
    camera = with_line(camera_log(run), 50, lambda line: line.split(",")[0] + ",0,0,0")
    imported = bring_in(brick_log(run), camera)
    assert max(np.abs(e).max() for e in pose_errors(imported, run)[:2]) < 0.01
    assert any("blanked 1 positions where the camera lost its mark" in line for line in imported.repairs)


def test_camera_that_lost_its_mark_for_long_is_refused(bring_in, run):
    camera = camera_log(run)
    for k in range(100, 260):
        camera = with_line(camera, k, lambda line: line.split(",")[0] + ",9,9,0")
    with pytest.raises(InputError, match="the camera lost its mark too often"):
        bring_in(brick_log(run), camera)


def test_blank_cells_and_words_for_nothing_are_no_samples(bring_in, run):
    text = with_line(brick_log(run), 7, lambda line: ",".join([*line.split(",")[:5], "None", "nan"]))
    imported = bring_in(text)
    assert np.isnan(imported.recording.reflection_pct[6])
    assert np.isnan(imported.recording.battery_v[6])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "found an empty file"),
        (b"\x89PNG\r\n\x1a\n\0\0\0", "no two lines of numbers"),
        ("hello\nworld\n", "no two lines of numbers with the same number of columns"),
        ("a,b\n1,2\n3,4\n", "expected a time: --column NAME=t_s says which"),
        ("t,duty\n5,1\n4,1\n3,1\n2,1\n1,1\n0,2\n9,1\n8,2\n7,3\n", "times are out of order: no safe repair"),
        ("t,duty\n0,500\n0.1,500\n", "duties up to 500 are no percentages"),
        ("t,duty\n0,5\n5000000000,5\n", "in no unit that logs are taken in"),
    ],
)  # fmt: skip
def test_what_can_not_be_imported_is_refused_with_a_reason(bring_in, text, message):
    with pytest.raises(InputError, match=message):
        bring_in(text, setup=Setup(rig="bench"))


edits = st.lists(
    st.tuples(
        st.integers(0, 10**6),
        st.sampled_from([b"", b"\n", b",", b"-", b"9", b"nan", b"\xff", b"t_s,x\n", b"1e400"]),
    ),
    min_size=1,
    max_size=12,
)


@settings(deadline=None, max_examples=60)
@given(edits=edits, first=st.integers(0, 200), rows=st.integers(0, 60))
def test_damage_is_mended_or_refused_and_never_crashes(tmp_path_factory, run, edits, first, rows):
    text = bytearray(brick_log(run, rows=slice(first, first + rows)).encode())
    for place, piece in edits:
        at = place % (len(text) + 1)
        text[at : at + 3] = piece
    path = tmp_path_factory.mktemp("damaged") / "run.csv"
    path.write_bytes(bytes(text))
    for read in (
        lambda: import_logs([path], load_robot("ev3"), Setup(), ImportOptions()).recording,
        lambda: read_recording(path),
    ):
        try:
            recording = read()
        except InputError as refused:
            assert "\n" not in str(refused)  # noqa: PT017  most damage is beyond repair: one line says so
        else:
            assert (np.diff(recording.t_s) > 0).all()


# --- what the user says


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
        ("left_speed", None, None),
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
