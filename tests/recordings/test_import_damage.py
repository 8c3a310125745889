"""Import of damaged logs: mended, and said, where that is safe; refused with a reason elsewhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.foreign_logs import (
    BRICK,
    assert_same,
    brick_log,
    camera_log,
    import_all,
    pose_errors,
    with_line,
)

from gecar.errors import InputError
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.recording import read_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.robot import load_robot


def test_cut_last_line_is_left_out(bring_in, run):
    imported = bring_in(brick_log(run)[:-20])
    assert len(imported.recording.t_s) == 1199
    assert "file0.txt: left out line 1201: not 7 fields" in imported.repairs


def test_a_log_with_commands_in_its_last_row_alone_is_refused(bring_in):
    with pytest.raises(InputError, match="found 1 rows from the first command on, expected at least two"):
        bring_in("Time,duty,angle\n0,,1\n10,,1\n20,5,2\n")


def test_repeated_and_misplaced_times_are_left_out(bring_in, run):
    text = with_line(brick_log(run), 100, lambda line: "3.5" + line[line.index(",") :])
    text = with_line(text, 200, lambda line: line + "\n" + line)
    imported = bring_in(text)
    assert len(imported.recording.t_s) == 1199
    assert any("1 rows whose time the next row repeats" in line for line in imported.repairs)
    assert any("1 rows whose time is out of order (3.5)" in line for line in imported.repairs)


@pytest.mark.parametrize("between", ["", "Start again\n"])
def test_every_run_of_a_file_becomes_a_recording(tmp_path, run, between):
    first, header = brick_log(run, rows=slice(0, 200)), brick_log(run)
    second = (
        header if between else header.split("\n", 1)[1]
    )  # the names again, or the clock alone starts again
    short, long = import_all(tmp_path, first + between + second)
    assert (short.recording.name, long.recording.name) == ("file0_1", "file0_2")
    assert len(short.recording.t_s) == 200
    assert_same(long, run, atol=1e-8)


def test_one_of_several_runs_in_a_file(tmp_path, run):
    text = brick_log(run, rows=slice(0, 200)) + "Start again\n" + brick_log(run)
    (only,) = import_all(tmp_path, text, run=1)
    assert len(only.recording.t_s) == 200
    with pytest.raises(InputError, match="--run: found 3, expected 1 to 2"):
        import_all(tmp_path, text, run=3)


def test_a_few_rows_before_the_clock_starts_again_are_left_out(bring_in, run):
    first, again = brick_log(run, rows=slice(0, 8)), brick_log(run).split("\n", 1)[1]
    imported = bring_in(first + again)
    assert_same(imported, run, atol=1e-8)
    assert "file0.txt: left out a run of 8 rows" in imported.repairs


def test_a_file_of_which_most_rows_would_go_is_refused(bring_in, run):
    rows = brick_log(run).strip().split("\n")
    cut = [row.rsplit(",", k % 5)[0] for k, row in enumerate(rows[1:])]
    with pytest.raises(InputError, match="of 1200 lines with numbers are rows of 7 columns"):
        bring_in("\n".join([rows[0], *cut]))
    coarse = [f"{float(row.split(',')[0]):.0f},{row.split(',', 1)[1]}" for row in rows[1:]]
    with pytest.raises(InputError, match="rows repeat the time of the next: its clock is too coarse"):
        bring_in("\n".join([rows[0], *coarse]))


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
        lambda: import_logs([path], load_robot("ev3"), Setup(), ImportOptions())[0].recording,
        lambda: read_recording(path),
    ):
        try:
            recording = read()
        except InputError as refused:
            assert "\n" not in str(refused)  # noqa: PT017  most damage is beyond repair: one line says so
        else:
            assert (np.diff(recording.t_s) > 0).all()
