"""A brick's log and a camera's made one: clocks aligned, axes and units compared, rows merged by time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.dead_reckoning import wheel_odometry
from gecar.reality.recordings.importing.clock import ClockOffset, Likeness, compare, estimate_offset
from gecar.reality.recordings.importing.frame import Frame, heading_offset, to_course
from gecar.reality.recordings.importing.log import Log
from gecar.reality.recordings.importing.track import Track
from gecar.reality.recordings.importing.units import UNITS
from gecar.world.robot import Robot

# Below these an offset is as likely chance as truth: the correlation, and by how many times the next best
# offset leaves more of the motion unexplained. Of 96 recordings of a 3D simulation 4 were refused (6 without
# headings), and no offset that passed was off by more than 45 ms, though wheels slipped in a third of them.
_LEAST_CORRELATION = 0.75
_LEAST_LEAD = 1.5
_SAME_ROW_S = 5e-5


@dataclass
class Joining:
    """What joining found: the columns so far, and a line for each thing found or mended."""

    columns: dict[str, Series]
    lines: list[str]
    offset: ClockOffset | None = None


def join(brick: Log, camera: Log | None, robot: Robot, frame: Frame, offset_s: float | None) -> Joining:
    """Join the logs of one run.

    Parameters
    ----------
    brick
        The log with the commands; it may hold poses too.
    camera
        The log with the poses, on its own clock; ``None`` if the brick's log is all there is.
    robot
        For its wheels and track.
    frame
        The camera's frame.
    offset_s
        What to add to the camera's times [s]; ``None``: found from motion.

    Raises
    ------
    InputError
        If the clocks can not be aligned.
    """
    joining = Joining(dict(brick.columns), [])
    seen_by = camera or brick
    if not seen_by.has_pose:
        return joining
    seen, told = _camera_track(seen_by), _brick_track(brick, robot)
    if camera is not None:
        offset_s = offset_s if offset_s is not None else _align(joining, told, seen)
    offset = offset_s or 0.0 if camera is not None else 0.0
    likeness = compare(told, seen, offset) if told else Likeness(np.nan, np.nan, None)
    seen, frame = _settle(joining, seen_by, seen, frame, likeness)
    if frame.heading_zero_deg is None and not seen_by.in_frame:
        frame = _zero_heading(joining, told, seen, frame, offset)
    track = to_course(seen, frame)
    merge_pose(joining, replace(track, t_s=track.t_s + offset), own_clock=camera is not None)
    return joining


def _camera_track(log: Log) -> Track:
    """Return a log's positions [its unit] and headings [rad]."""
    heading = log.columns.get("heading_deg")
    seen = ~np.isnan(log.columns["x_m"]) & ~np.isnan(log.columns["y_m"])
    if heading is not None:
        seen &= ~np.isnan(heading)
        heading = np.deg2rad(heading[seen])
    return Track(log.columns["t_s"][seen], log.columns["x_m"][seen], log.columns["y_m"][seen], heading)


def _brick_track(log: Log, robot: Robot) -> Track | None:
    """Return the path the encoders tell; ``None`` without both."""
    if "left_angle_deg" not in log.columns or "right_angle_deg" not in log.columns:
        return None
    left, right = log.columns["left_angle_deg"], log.columns["right_angle_deg"]
    seen = ~np.isnan(left) & ~np.isnan(right)
    radius, width = robot.body.wheel_radius, robot.body.track_width
    path = wheel_odometry(np.deg2rad(left[seen]), np.deg2rad(right[seen]), radius, width)
    return Track(log.columns["t_s"][seen], *path.T)


def _align(joining: Joining, told: Track | None, seen: Track) -> float:
    """Find the camera's offset, and refuse one that is not sure."""
    if told is None:
        raise InputError(
            "no encoders to align the camera's clock by: say it with --offset SECONDS (0 if it is one clock)"
        )
    found = estimate_offset(told, seen)
    if found.correlation < _LEAST_CORRELATION:
        raise InputError(
            f"at no offset do camera and encoders agree (correlation at most {found.correlation:.2f}): are "
            "they of one run? --offset SECONDS says it"
        )
    if 1.0 - found.runner_up < _LEAST_LEAD * (1.0 - found.correlation):
        raise InputError(
            f"camera and encoders agree at several offsets (at {found.offset_s:.2f} s with correlation "
            f"{found.correlation:.2f}, elsewhere with {found.runner_up:.2f}): --offset SECONDS says which"
        )
    joining.offset = found
    joining.lines.append(
        f"clocks: {found.offset_s:+.4f} s added to the camera's times, +-{found.deviation_s:.4f} s "
        f"(correlation {found.correlation:.2f}, next best {found.runner_up:.2f})"
    )
    if abs(found.drift_s) > 0.02:
        joining.lines.append(
            f"clocks: the offset drifts by {found.drift_s * 1e3:+.0f} ms: a clock is off, or wheels slip"
        )
    return found.offset_s


def _settle(joining: Joining, log: Log, seen: Track, frame: Frame, likeness: Likeness) -> tuple[Track, Frame]:
    """Decide the camera's unit, axes and direction of headings, from what was said, or else from motion."""
    seen, unit = _scaled(joining, log, seen, frame, likeness)
    if frame.origin is not None:
        frame = replace(frame, origin=(frame.origin[0] * unit, frame.origin[1] * unit))
    turns = likeness.heading_factor
    if seen.heading is not None and not log.heading_said:
        for name, true in (("deg", np.pi / 180.0), ("rad", 180.0 / np.pi)):
            if 0.5 < abs(turns) / true < 2.0:
                joining.lines.append(f"camera: by the encoders, its headings are in {name}")
                seen, turns = replace(seen, heading=seen.heading * true), turns / true
    if frame.y_down is None and likeness.mirrored:
        frame = _turned_over(
            joining, log, frame, "its path bends against the encoders: y points down", "y_down"
        )
    if frame.heading_clockwise is None and turns < -0.5:
        frame = _turned_over(
            joining, log, frame, "by the encoders, its headings count clockwise", "heading_clockwise"
        )
    return seen, frame


def _turned_over(joining: Joining, log: Log, frame: Frame, finding: str, axis: str) -> Frame:
    """Turn an axis over; but where the names claim the recording's own frame, only say what was found."""
    if log.in_frame:
        joining.lines.append(f"camera: {finding}? Left as it is, for its columns are named as a recording's")
        return frame
    joining.lines.append(f"camera: {finding}: turned over")
    return replace(frame, y_down=True) if axis == "y_down" else replace(frame, heading_clockwise=True)


def _scaled(joining: Joining, log: Log, seen: Track, frame: Frame, likeness: Likeness) -> tuple[Track, float]:
    """Bring positions into metres; return the length of the camera's unit [m] too."""
    assumed = UNITS["length"][log.length_unit]
    if frame.scale is not None:
        return _times(seen, frame.scale / assumed), frame.scale
    ratio, pixels = likeness.scale, log.length_unit == "px"
    if pixels and not np.isfinite(ratio):
        raise InputError(f"{log.name}: positions in pixels, and no encoders to scale them by: --scale METRES")
    if not pixels and (not np.isfinite(ratio) or 0.88 < ratio < 1.14):
        return seen, assumed
    if not pixels and 0.5 < ratio < 2.0:
        joining.lines.append(
            f"camera: it moves {1 / ratio:.2f} times as far as the wheels: slip, wheels, or --scale?"
        )
        return seen, assumed
    for name in () if pixels else ("m", "cm", "mm"):
        metres = UNITS["length"][name]
        if 0.8 < ratio * assumed / metres < 1.25:
            joining.lines.append(f"camera: by the encoders, its unit is {name}, not {log.length_unit}")
            return _times(seen, metres / assumed), metres
    joining.lines.append(
        f"camera: by the wheels, its unit is {ratio * assumed:.4g} m (--scale says otherwise)"
    )
    return _times(seen, ratio), ratio * assumed


def _times(track: Track, factor: float) -> Track:
    return replace(track, x=track.x * factor, y=track.y * factor)


def _zero_heading(joining: Joining, told: Track | None, seen: Track, frame: Frame, offset: float) -> Frame:
    """Find the heading the camera gives a robot that faces along x, from how it moves."""
    if told is None or told.heading is None:
        return frame
    flat = to_course(seen, Frame(y_down=frame.y_down, heading_clockwise=frame.heading_clockwise))
    before, after = seen.t_s + offset - 0.1, seen.t_s + offset + 0.1
    way = np.interp(seen.t_s + offset, told.t_s, told.heading)
    x, y, turn = (
        np.interp(after, told.t_s, v) - np.interp(before, told.t_s, v) for v in (told.x, told.y, told.heading)
    )
    off = heading_offset(flat, (x * np.cos(way) + y * np.sin(way)) / 0.2, turn / 0.2)
    if off is None or abs(off) < np.deg2rad(5.0):
        return frame
    degrees = float(np.rad2deg(off)) * (-1.0 if frame.heading_clockwise else 1.0)
    joining.lines.append(
        f"camera: its headings are {degrees:.1f} deg where the robot faces along x: taken off"
    )
    return replace(frame, heading_zero_deg=degrees)


def merge_pose(joining: Joining, pose: Track, own_clock: bool) -> None:
    """Put poses into the columns: on the brick's rows where times agree, on rows of their own elsewhere."""
    time = joining.columns["t_s"]
    inside = (pose.t_s >= time[0] - _SAME_ROW_S) & (pose.t_s <= time[-1] + _SAME_ROW_S)
    if own_clock and not inside.all():
        joining.lines.append(
            f"camera: left out {int((~inside).sum())} of {len(inside)} poses outside the brick's log"
        )
    at = pose.t_s[inside]
    nearest = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    nearest -= (at - time[nearest - 1]) < (time[nearest] - at)
    own = np.abs(time[nearest] - at) > _SAME_ROW_S
    at = np.where(own, at, time[nearest])
    merged = np.union1d(time, at)
    rows, pose_rows = np.searchsorted(merged, time), np.searchsorted(merged, at)
    columns = {name: _spread(values, rows, len(merged)) for name, values in joining.columns.items()}
    columns["t_s"] = merged
    for name, values in (("x_m", pose.x), ("y_m", pose.y), ("heading_deg", _degrees(pose.heading))):
        if values is not None:
            columns[name] = _spread(values[inside], pose_rows, len(merged))
    joining.columns = columns


def _degrees(heading: Series | None) -> Series | None:
    return None if heading is None else np.rad2deg(heading)


def _spread(values: Series, rows: npt.NDArray[np.intp], size: int) -> Series:
    spread = np.full(size, np.nan)
    spread[rows] = values
    return spread
