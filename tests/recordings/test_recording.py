"""Recordings: what is read is what was written, and what is wrong is named by line and column."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gecar.errors import InputError
from gecar.reality.recordings import csv_reader
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.recording import make_recording, read_case, read_recording, write_recording
from gecar.reality.recordings.setup import Setup

FLOOR = (
    "t_s,left_duty_pct,right_duty_pct,left_angle_deg,x_m\n0.0,50,-50,0,1.5\n0.01,50,-50,3,\n0.02,0,0,7,1.6\n"
)


@pytest.fixture
def write(tmp_path):
    """Write a recording's CSV, and its TOML if given; return the CSV's path."""

    def _write(csv, toml=None, name="run.csv"):
        path = tmp_path / name
        path.write_text(csv, newline="")
        if toml is not None:
            path.with_suffix(".toml").write_text(toml)
        return path

    return _write


def test_file_units_become_si(write):
    recording = read_recording(write(FLOOR))
    assert recording.name == "run"
    np.testing.assert_allclose(recording.left_duty, [0.5, 0.5, 0.0])
    np.testing.assert_allclose(recording.left_angle_rad, np.deg2rad([0, 3, 7]))
    np.testing.assert_array_equal(recording.x_m, [1.5, np.nan, 1.6])
    assert np.isnan(recording.y_m).all()


def test_columns_may_stand_in_any_order(write):
    shuffled = "x_m,t_s,right_duty_pct,left_duty_pct\n1,0,2,3\n,0.5,4,5\n"
    recording = read_recording(write(shuffled))
    np.testing.assert_allclose(recording.t_s, [0, 0.5])
    np.testing.assert_allclose(recording.commands, [[0.03, 0.02], [0.05, 0.04]])


def test_measured_names_the_columns_with_samples(write):
    assert read_recording(write(FLOOR)).measured == ("left_angle_rad", "x_m")


def test_blank_command_holds_the_one_before(write):
    recording = read_recording(write("t_s,left_duty_pct,right_duty_pct\n0,50,20\n1,,\n2,-10,\n"))
    np.testing.assert_allclose(recording.commands, [[0.5, 0.2], [0.5, 0.2], [-0.1, 0.2]])


def test_windows_line_ends_and_a_byte_order_mark_are_read(write):
    assert read_recording(write("\ufeff" + FLOOR.replace("\n", "\r\n"))).duration_s == pytest.approx(0.02)


def test_series_can_not_be_changed(write):
    with pytest.raises(ValueError, match="read-only"):
        read_recording(write(FLOOR)).t_s[0] = 1.0


def test_one_motor_is_enough_on_a_bench_only(write):
    alone = "t_s,left_duty_pct,left_angle_deg\n0,100,0\n1,100,5\n"
    assert read_recording(write(alone, 'rig = "bench"\nduty_cap = 1.0\n')).setup.duty_cap == 1.0
    with pytest.raises(InputError, match=r'expected both duties \(one is enough with rig = "bench"\)'):
        read_recording(write(alone, name="floor.csv"))


def test_unknown_column_is_passed_over_with_a_warning(write):
    recording = read_recording(write(FLOOR.replace("x_m", "humidity")))
    assert "'humidity'" in recording.warnings[0]


@pytest.mark.parametrize(
    ("csv", "message"),
    [
        ("", "found an empty file, expected a line of column names"),
        ("t_s,left_duty_pct,right_duty_pct\n0,0,0\n", "found 1 rows, expected at least two"),
        (FLOOR.replace("t_s", "seconds"), "expected a recording's columns .*first gecar import"),
        (FLOOR.replace(",", ";"), "with semicolons between columns, expected .*first gecar import"),
        (FLOOR.replace("angle", "angel"), "column 4: found 'left_angel_deg', expected 'left_angle_deg'"),
        (FLOOR.replace("x_m", "left_angle_deg"), "column 5: found 'left_angle_deg' a second time"),
        (FLOOR.replace("0.02,", "0.005,"), "column t_s: found 0.005 after 0.01, expected an increasing time"),
        (FLOOR.replace("0.02,", "0.01,"), "line 4, column t_s: found 0.01 after 0.01"),
        (FLOOR.replace("0.02,", ","), "line 4, column t_s: found a blank, expected a time"),
        (FLOOR.replace("1.6", "nan"), "line 4, column x_m: found 'nan', expected a number or nothing"),
        (FLOOR.replace("1.6", "1e999"), "line 4, column x_m: found '1e999'"),
        (FLOOR.replace("1.6", "1_6"), "line 4, column x_m: found '1_6'"),
        (FLOOR.replace(",7,1.6\n", ",7"), "line 4: found 4 fields, expected 5"),
        (FLOOR.replace("0.01,50,-50,3,\n", "\n"), "line 3: found an empty line"),
        (FLOOR.replace("0.0,50", "0.0,"), "line 2, column left_duty_pct: found a blank, expected the command"),
        (FLOOR.replace("0.02,0,", "0.02,101,"), "column left_duty_pct: found 101, expected a duty"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(write, csv, message):
    with pytest.raises(InputError, match=message):
        read_recording(write(csv))


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        ("rbot = 1", "found the key 'rbot', expected 'robot'"),
        ('rig = "table"', "rig: found 'table', expected \"floor\" or \"bench\""),
        ('robot = "mine.toml"', "robot: found 'mine.toml', no such file"),
        ("duty_cap = 2", "duty_cap: found 2, expected a number from 0.01 to 1"),
        ("[noise]\nx = 1", "noise: found the column 'x'"),
        ('program = "best.txt"', "program: .*best.txt: found no such file"),
        ("= 3", "not TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_beside_it_is_named(write, toml, message):
    with pytest.raises(InputError, match=message):
        read_recording(write(FLOOR, toml))


def test_paths_are_meant_from_the_toml(tmp_path, write):
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/mine.toml").write_text("")
    (tmp_path / "best.txt").write_text("motor(80, 80, 50)\n")
    toml = 'robot = "robots/mine.toml"\nprogram = "best.txt"\n[noise]\nheading_deg = 0.3\n'
    setup = read_recording(write(FLOOR, toml)).setup
    assert setup.robot == str((tmp_path / "robots/mine.toml").resolve())
    assert setup.program == "motor(80, 80, 50)\n"
    assert setup.noise["heading_rad"] == pytest.approx(math.radians(0.3))


def test_huge_file_is_refused_unread(write, monkeypatch):
    monkeypatch.setattr(csv_reader, "MOST_BYTES", 50)
    with pytest.raises(InputError, match="expected at most 0 MB: cut it"):
        read_recording(write(FLOOR))


def test_case_is_a_folder_of_one_robot(tmp_path, write):
    write(FLOOR, name="b.csv")
    write(FLOOR, name="a.csv")
    assert [recording.name for recording in read_case(tmp_path).recordings] == ["a", "b"]
    write(FLOOR, 'robot = "other"', name="c.csv")
    with pytest.raises(InputError, match="recordings of the robots ev3 and other"):
        read_case(tmp_path)


def test_folder_without_recordings_is_no_case(tmp_path):
    with pytest.raises(InputError, match=r"no \.csv file"):
        read_case(tmp_path)


numbers = st.floats(-1e4, 1e4).map(lambda v: float(f"{v:.6g}"))
rows = st.integers(2, 30).flatmap(
    lambda n: st.fixed_dictionaries({
        "left_duty_pct": st.lists(st.integers(-100, 100), min_size=n, max_size=n),
        "right_duty_pct": st.lists(st.integers(-100, 100), min_size=n, max_size=n),
        "left_angle_deg": st.lists(numbers | st.just(math.nan), min_size=n, max_size=n),
        "x_m": st.lists(numbers | st.just(math.nan), min_size=n, max_size=n),
    })
)  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(columns=rows, notes=st.text(max_size=20) | st.just('\x7f\t"'), cap=st.none() | st.floats(0.01, 1.0))
def test_written_and_read_back_is_the_same(tmp_path_factory, columns, notes, cap):
    folder = tmp_path_factory.mktemp("written")
    series = {name: np.array(values, dtype=float) for name, values in columns.items()}
    series["t_s"] = np.arange(len(series["x_m"])) * 0.01
    setup = Setup(course="none", notes=notes, duty_cap=cap, program="motor(1, 2, 3)", noise={"x_m": 0.001})
    written = make_recording("run", series, setup)
    write_recording(written, folder / "run.csv")
    read = read_recording(folder / "run.csv")
    assert read.setup == written.setup
    for field, _ in COLUMNS.values():
        np.testing.assert_allclose(getattr(read, field), getattr(written, field), rtol=1e-8, atol=1e-12)


def logged(degrees_per_s, sampled_every_s, blank=False):
    """A log at 100 Hz of wheels that turn faster and faster and then rest, whose angles are asked for now and then."""
    t = np.arange(0.0, 4.0, 0.01)
    asked = np.floor(t / sampled_every_s + 1e-9) * sampled_every_s
    angle = np.round(degrees_per_s * np.minimum(asked, 3.0) ** 1.5)
    new = np.r_[True, np.diff(asked) > 0.0]
    texts = [f"{a:g}" if n or not blank else "" for a, n in zip(angle, new, strict=True)]
    rows = [f"{time:.2f},50,50,{a},{a}" for time, a in zip(t, texts, strict=True)]
    return "\n".join(["t_s,left_duty_pct,right_duty_pct,left_angle_deg,right_angle_deg", *rows, ""])


def test_samples_that_a_log_repeats_are_taken_for_blanks(write):
    repeated = read_recording(write(logged(400.0, 0.12)))
    blank = read_recording(write(logged(400.0, 0.12, blank=True), name="blank.csv"))
    moving = repeated.t_s < 3.0
    np.testing.assert_array_equal(repeated.left_angle_rad[moving], blank.left_angle_rad[moving])
    assert blank.warnings == ()
    assert len(repeated.warnings) == 1
    assert "the wheels' angles are repeated between samples 0.12 s apart" in repeated.warnings[0]


@pytest.mark.parametrize("speed", [0.0, 30.0, 400.0, 900.0])
def test_wheels_that_turn_slowly_or_rest_repeat_no_samples(write, speed):
    recording = read_recording(write(logged(speed, 0.01)))
    assert not np.isnan(recording.left_angle_rad).any()
    assert recording.warnings == ()
