"""From a camera's frame to the course's: scale, axes, origin, turn, the mark's place on the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.importing.track import Track


@dataclass(frozen=True)
class Frame:
    """How a camera's positions become the course's. What is ``None`` is found from motion, or left alone.

    Attributes
    ----------
    scale
        Length of the camera's unit [m]; ``None``: as its unit says.
    y_down
        Whether the camera's y axis points down.
    heading_clockwise
        Whether its headings count clockwise.
    origin
        Camera coordinates, in the camera's unit, of the course's lower left corner; ``None``: (0, 0).
    turn_deg
        By how much the camera's x axis is turned counter-clockwise from the course's [deg].
    heading_zero_deg
        Heading that the camera gives a robot which faces along the camera's x axis [deg].
    mark
        Where the mark is on the robot, ahead and left of the axle's centre [m].
    start
        Pose to put the first position at: x [m], y [m], heading [rad]; the course's START.
    """

    scale: float | None = None
    y_down: bool | None = None
    heading_clockwise: bool | None = None
    origin: tuple[float, float] | None = None
    turn_deg: float = 0.0
    heading_zero_deg: float | None = None
    mark: tuple[float, float] = (0.0, 0.0)
    start: tuple[float, float, float] | None = None


def to_course(track: Track, frame: Frame) -> Track:
    """Bring a camera's track [its metres, rad] into the course's frame [m, rad].

    Raises
    ------
    InputError
        If a mark off the axle's centre, or a START, is given without headings to place it by.
    """
    if track.heading is None and any(frame.mark):
        raise InputError("--mark needs the camera's headings, and there are none")
    origin = frame.origin or (0.0, 0.0)
    x, y = track.x - origin[0], (track.y - origin[1]) * (-1.0 if frame.y_down else 1.0)
    heading = None
    if track.heading is not None:
        sign = -1.0 if frame.heading_clockwise else 1.0
        heading = sign * (track.heading - np.deg2rad(frame.heading_zero_deg or 0.0))
    moved = _turned(Track(track.t_s, x, y, heading), np.deg2rad(frame.turn_deg))
    moved = _off_the_mark(moved, frame.mark)
    return moved if frame.start is None else _placed(moved, frame.start)


def _turned(track: Track, angle: float) -> Track:
    cos, sin = np.cos(angle), np.sin(angle)
    heading = None if track.heading is None else track.heading + angle
    return replace(track, x=cos * track.x - sin * track.y, y=sin * track.x + cos * track.y, heading=heading)


def _off_the_mark(track: Track, mark: tuple[float, float]) -> Track:
    """Go from the mark to the axle's centre."""
    if track.heading is None:
        return track
    cos, sin = np.cos(track.heading), np.sin(track.heading)
    return replace(
        track, x=track.x - mark[0] * cos + mark[1] * sin, y=track.y - mark[0] * sin - mark[1] * cos
    )


def _placed(track: Track, start: tuple[float, float, float]) -> Track:
    """Move and turn a track so that it starts at a pose; it starts where the robot still stands."""
    if track.heading is None:
        raise InputError(
            "--place needs the camera's headings, and there are none: give --origin and --turn instead"
        )
    still = np.hypot(track.x - track.x[0], track.y - track.y[0]) < 0.005
    still &= np.abs(track.heading - track.heading[0]) < np.deg2rad(2.0)
    first = slice(0, int(np.argmin(still)) if not still.all() else len(still))
    turned = _turned(track, start[2] - float(np.median(track.heading[first])))
    x, y = float(np.median(turned.x[first])), float(np.median(turned.y[first]))
    return replace(turned, x=turned.x - x + start[0], y=turned.y - y + start[1])


def heading_offset(track: Track, forward: Series, turning: Series) -> float | None:
    """Return by how much headings differ from the way a robot faces, which is the way it moves [rad].

    Parameters
    ----------
    track
        Positions and headings, in axes of one handedness.
    forward, turning
        Speed, negative backward [m/s], and yaw rate [rad/s] that the encoders tell at its times, shape (n,).

    Returns
    -------
    float
        ``None`` if it moved on, in arcs wider than 0.2 m, for less than twenty samples, or slid.
    """
    going = (np.abs(forward) > 0.1) & (np.abs(turning) < np.abs(forward) / 0.2)
    if track.heading is None or going.sum() < 20:
        return None
    dx, dy = np.gradient(track.x, track.t_s), np.gradient(track.y, track.t_s)
    facing = np.arctan2(dy * np.sign(forward), dx * np.sign(forward))
    difference = np.exp(1j * (track.heading - facing))[going]
    off = np.angle(np.median(difference.real) + 1j * np.median(difference.imag))
    slid = np.median(np.abs(np.angle(difference * np.exp(-1j * off)))) > np.deg2rad(6.0)
    return None if slid else float(off)
