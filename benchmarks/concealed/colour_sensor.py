"""The printed line as plain geometry, and the sensor that looks at it."""

from __future__ import annotations

import math
from collections import deque

from benchmarks.concealed.history import TICK_S
from benchmarks.concealed.robot import Concealed

# The paper's course: 8 x 4 tiles of 0.30 m, a line 25 mm wide through the centres of the 20 rim tiles, sharp corners.
TILE = 0.30  # m
FIELD = (2.4, 1.2)  # m
LINE_WIDTH = 0.025  # m
_HALF = LINE_WIDTH / 2.0
_OUTER = (0.15 - _HALF, 0.15 - _HALF, 2.25 + _HALF, 1.05 + _HALF)  # x0, y0, x1, y1
_INNER = (0.15 + _HALF, 0.15 + _HALF, 2.25 - _HALF, 1.05 - _HALF)
_SLICES = 24
_RISES_S = 0.05  # time constant with which a robot that shakes with its speed lifts the sensor
_DIMMEST = 10.0  # %: a gain that follows the mean light grows no further


def line_share(x: float, y: float, diameter: float, wider: float = 0.0) -> float:
    """Share of a round spot that lies on the line.

    Parameters
    ----------
    x, y
        Middle of the spot in the course's frame [m].
    diameter
        Of the spot [m].
    wider
        More than the line is wide as drawn [m].

    Returns
    -------
    float
        0 on bare floor, 1 on the line. Exact along the sides; by slices at the corners, within 0.002.
    """
    radius = diameter / 2.0
    more = wider / 2.0
    outer = (_OUTER[0] - more, _OUTER[1] - more, _OUTER[2] + more, _OUTER[3] + more)
    inner = (_INNER[0] + more, _INNER[1] + more, _INNER[2] - more, _INNER[3] - more)
    return _share_inside(outer, x, y, radius) - _share_inside(inner, x, y, radius)


def _share_inside(box: tuple[float, float, float, float], x: float, y: float, radius: float) -> float:
    """Share of a disc inside a rectangle much larger than itself."""
    across = (
        min(x - box[0], box[2] - x) / radius
    )  # distance to the nearer upright side, in radii, inside positive
    along = min(y - box[1], box[3] - y) / radius
    if across <= -1.0 or along <= -1.0:
        return 0.0
    if along >= 1.0:
        return _beyond_chord(across)
    if across >= 1.0:
        return _beyond_chord(along)
    return _corner(across, along)


def _beyond_chord(distance: float) -> float:
    """Share of a unit disc on the inner side of a straight edge."""
    if distance >= 1.0:
        return 1.0
    return 1.0 - (math.acos(distance) - distance * math.sqrt(1.0 - distance * distance)) / math.pi


def _corner(across: float, along: float) -> float:
    """Share of a unit disc within a right angle whose sides pass at these distances."""
    first = math.acos(across)
    width = (math.pi - first) / _SLICES  # equal angles: slices narrow towards the rim, as the chord does
    area = 0.0
    for k in range(_SLICES):
        chord = math.sin(first + (k + 0.5) * width)
        area += max(min(along, chord) + chord, 0.0) * chord
    return area * width / math.pi


class ColourSensor:
    """Reflected light, one tick at a time, before noise and rounding.

    Parameters
    ----------
    concealed
        What differs from the nominal sensor and the course as drawn.
    """

    def __init__(self, concealed: Concealed) -> None:
        self._hidden = concealed
        self._waiting = deque([100.0] * round(concealed.sensor_delay / TICK_S))
        self._level = math.nan
        lag = concealed.sensor_lag
        self._follow = 1.0 - math.exp(-TICK_S / lag) if lag > 0.0 else 1.0
        self._mean = math.nan  # of the light, for a gain that follows it [%]
        self._ticks = 0
        self._before: tuple[float, float] | None = None  # where the mount was a tick ago [m]
        self._swing = [
            0.0,
            0.0,
            0.0,
            0.0,
        ]  # the loose mount: ahead, left [m] and their rates, in the robot's frame
        self._moving = (0.0, 0.0)  # velocity of the mount in the course's frame [m/s]
        self._axle = (math.nan, math.nan)  # where its centre was a tick ago [m]
        self._shaken: tuple[float, float] | None = None  # where the axle's centre was a tick ago [m]
        self._shaking = 0.0  # mean speed, whichever way [m/s]
        self._pace = 0.0  # speed to which the robot's pitch has settled [m/s]

    def look(self, x: float, y: float, heading: float) -> float:
        """Read the floor.

        Parameters
        ----------
        x, y, heading
            Pose of the axle's centre [m, m, rad].

        Returns
        -------
        float
            Reflection [%]; may leave 0-100 by gain and offset, as the reading itself can't.
        """
        seen = self._floor(x, y, heading)
        if math.isnan(self._level):  # it has looked at this floor since before the recording
            self._level, self._waiting = seen, deque([seen] * len(self._waiting))
        self._waiting.append(seen)
        self._level += self._follow * (self._waiting.popleft() - self._level)
        light = self._level
        if self._hidden.flicker is not None:
            share, hertz, phase = self._hidden.flicker
            light *= (
                1.0 + share * (math.sin(2.0 * math.pi * hertz * self._ticks * TICK_S + phase) - 1.0) / 2.0
            )
        if self._hidden.warming is not None:
            lost, time = self._hidden.warming
            light *= 1.0 - lost * (1.0 - math.exp(-self._ticks * TICK_S / time))
        if self._hidden.auto_gain is not None:
            light *= self._gain(light)
        if self._hidden.nod is not None:
            light *= self._nodded(x, y, heading)
        if self._hidden.speed_lift > 0.0:
            light *= self._lifted(x, y)
        self._ticks += 1
        return self._hidden.sensor_gain * light + self._hidden.sensor_offset_pct

    def _gain(self, light: float) -> float:
        """Let a gain follow the mean light; it is 1 over white, where the sensor was calibrated."""
        power, time = self._hidden.auto_gain or (0.0, 1.0)
        self._mean = light if math.isnan(self._mean) else self._mean + TICK_S / time * (light - self._mean)
        return float((max(self._mean, _DIMMEST) / 100.0) ** -power)

    def _nodded(self, x: float, y: float, heading: float) -> float:
        """Give the share of light that comes back while acceleration lifts, or braking lowers, the robot's nose."""
        lost, time = self._hidden.nod or (0.0, 1.0)
        (old_x, old_y), self._axle = self._axle, (x, y)
        if math.isnan(old_x):
            return 1.0
        speed = (math.cos(heading) * (x - old_x) + math.sin(heading) * (y - old_y)) / TICK_S
        pitched = (speed - self._pace) / time
        self._pace += TICK_S * pitched
        return max(1.0 - lost * pitched, 0.0)

    def _lifted(self, x: float, y: float) -> float:
        """Give the share of light that comes back to a sensor that the robot's speed lifts."""
        old_x, old_y = self._shaken or (x, y)
        self._shaken = (x, y)
        speed = math.hypot(x - old_x, y - old_y) / TICK_S
        self._shaking += TICK_S / _RISES_S * (speed - self._shaking)
        return max(1.0 - self._hidden.speed_lift * self._shaking, 0.0)

    def _floor(self, x: float, y: float, heading: float) -> float:
        hidden = self._hidden
        cos, sin = math.cos(heading), math.sin(heading)
        ahead, left = hidden.sensor_ahead, hidden.sensor_left
        if hidden.sway is not None:
            self._sway(x + cos * ahead, y + sin * ahead, heading)
            ahead, left = ahead + self._swing[0], left + self._swing[1]
        spot_x = x + cos * ahead - sin * left
        spot_y = y + sin * ahead + cos * left
        shade = self._shade(spot_x, spot_y)
        other = None
        if hidden.second_spot is not None:
            _, on, aside = hidden.second_spot
            other = self._printed(spot_x + cos * on - sin * aside, spot_y + sin * on + cos * aside)
        spot_x, spot_y = self._printed(spot_x, spot_y)
        dark = line_share(spot_x, spot_y, hidden.spot_diameter, hidden.line_wider)
        if hidden.faded is not None:
            dark *= self._ink(spot_x, spot_y)
        if hidden.second_spot is not None and other is not None:
            also = line_share(*other, hidden.spot_diameter, hidden.line_wider)
            dark += hidden.second_spot[0] * (also - dark)
        light = 100.0 * (1.0 - dark)
        if hidden.ambient is not None:
            loss, source = hidden.ambient
            light *= 1.0 - loss * (1.0 - math.cos(heading - source)) / 2.0
        light *= 1.0 - shade
        if hidden.seams is not None:
            light *= self._between(spot_x) * self._between(spot_y)
        if hidden.gamma != 1.0:
            light = 100.0 * max(light / 100.0, 0.0) ** hidden.gamma
        if hidden.gloss is not None:
            share, length, phase_x, phase_y = hidden.gloss
            turn = 2.0 * math.pi / length
            shine = math.sin(turn * spot_x + phase_x) * math.sin(turn * spot_y + phase_y)
            light *= 1.0 - share * (1.0 + shine) / 2.0
        return light

    def _printed(self, x: float, y: float) -> tuple[float, float]:
        """Give a place on the floor in the frame of the course as it is printed there."""
        dx, dy, angle = self._hidden.line_shift
        if (dx, dy, angle) != (0.0, 0.0, 0.0):
            cos, sin = math.cos(angle), math.sin(angle)
            x, y = x - dx, y - dy
            x, y = cos * x + sin * y, cos * y - sin * x
        if self._hidden.wobble is not None:
            size, length, phase_x, phase_y = self._hidden.wobble
            turn = 2.0 * math.pi / length
            x, y = x + size * math.sin(turn * y + phase_x), y + size * math.sin(turn * x + phase_y)
        return x, y

    def _between(self, along: float) -> float:
        """Give the share of light that seams between tiles, at every whole tile along one axis, leave the spot."""
        lost, half = self._hidden.seams or (0.0, 0.0)
        off, radius = abs(math.remainder(along, TILE)), self._hidden.spot_diameter / 2.0
        covered = min(off + radius, half) - max(off - radius, -half)
        return 1.0 - lost * max(covered, 0.0) / (2.0 * radius)

    def _ink(self, x: float, y: float) -> float:
        """Give the share of the line's ink that is left at a place where the print is worn."""
        lost, worn_x, worn_y, radius = self._hidden.faded or (0.0, 0.0, 0.0, 1.0)
        away = math.hypot(x - worn_x, y - worn_y) / radius
        return 1.0 - lost * math.exp(-(away**4))  # worn alike within, and hardly beyond

    def _shade(self, x: float, y: float) -> float:
        """Give the share of light that a shadow takes, whose edge is straight and blurred."""
        if self._hidden.shadow is None:
            return 0.0
        loss, edge_x, blur, way = self._hidden.shadow
        into = math.cos(way) * (x - edge_x) + math.sin(way) * (y - FIELD[1] / 2.0)
        return loss * min(max(into / blur + 0.5, 0.0), 1.0)

    def _sway(self, x: float, y: float, heading: float) -> None:
        """Let the loose mount swing: a damped spring that the robot's acceleration at (x, y) shakes."""
        hertz, damping = self._hidden.sway or (1.0, 1.0)
        old, self._before = self._before or (x, y), (x, y)
        moving = ((x - old[0]) / TICK_S, (y - old[1]) / TICK_S)
        jump_x, jump_y = moving[0] - self._moving[0], moving[1] - self._moving[1]
        self._moving = moving
        cos, sin = math.cos(heading), math.sin(heading)
        jumps = (cos * jump_x + sin * jump_y, cos * jump_y - sin * jump_x)
        pull = 2.0 * math.pi * hertz
        for k, jump in enumerate(jumps):
            self._swing[2 + k] -= jump
            self._swing[2 + k] -= TICK_S * (
                2.0 * damping * pull * self._swing[2 + k] + pull**2 * self._swing[k]
            )
            self._swing[k] += TICK_S * self._swing[2 + k]
