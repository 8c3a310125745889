"""Import of two logs on two clocks: the offset is found from motion, or refused."""

from pathlib import Path

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
from support.synthetic import drive

from gecar.errors import InputError
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.dead_reckoning import wheel_odometry
from gecar.reality.recordings.importing.clock import compare, estimate_offset
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.importing.track import Track
from gecar.reality.recordings.recording import read_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.robot import load_robot


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
    path = wheel_odometry(recording.left_angle_rad, recording.right_angle_rad, 0.028, 0.12)
    brick = Track(recording.t_s, *path.T)
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


# --- recordings of a 3D simulation, where they are at hand

PRACTICE = sorted((Path(__file__).parents[3] / "shared/recordings/practice/p01").glob("*.csv"))


@pytest.mark.skipif(not PRACTICE, reason="needs ../shared/recordings/practice")
def test_practice_recordings_come_through_as_they_are(tmp_path):
    for path in PRACTICE:
        recording = read_recording(path)
        (imported,) = import_logs([path], load_robot("ev3"), Setup(), ImportOptions())
        assert imported.repairs == ()
        assert_same(imported, recording, tuple(COLUMNS)[:10], atol=1e-9)


@pytest.mark.skipif(not PRACTICE, reason="needs ../shared/recordings/practice")
def test_practice_logs_in_two_files_are_joined_within_four_milliseconds(bring_in):
    for path in PRACTICE:
        recording = read_recording(path)
        imported = bring_in(brick_log(recording), camera_log(recording, shift=33.3))
        assert imported.offset.offset_s == pytest.approx(-33.3, abs=0.004)
