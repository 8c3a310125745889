"""What a student has the robot do: held duties, sines, reversals, and the line followed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from benchmarks.concealed.colour_sensor import FIELD
from benchmarks.concealed.history import ROW_TICKS, TICK_S, Array, Controller, Pose
from benchmarks.concealed.robot import EV3, Base

SECONDS = 12.0
_ROW_S = ROW_TICKS * TICK_S
_ROWS = round(SECONDS / _ROW_S) + 1
_SHAFT_TIME_S = 0.105  # how fast a shaft follows its duty, for keeping scripts inside the field only

Hold = tuple[float, float, float]  # seconds, left, right


def script(kind: str, rng: np.random.Generator, base: Base = EV3) -> tuple[Pose, Array]:
    """Draw an open-loop command sequence and where to start it.

    Parameters
    ----------
    kind
        ``holds``, ``holds_gentle``, ``sines`` or ``reversals``.
    rng
        Source of randomness.
    base
        The robot.

    Returns
    -------
    tuple[Pose, Array]
        Start pose, and one row of left and right duty per 10 ms (1201, 2) [%]. Of forty drawn, the first that a
        simple planar guess keeps inside the field, or the one that strays least.
    """
    best, least = None, math.inf
    for _ in range(40):
        start = (rng.uniform(0.9, 1.5), rng.uniform(0.45, 0.75), rng.uniform(-math.pi, math.pi))
        commands = _SCRIPTS[kind](rng)
        strayed = _strayed(start, commands, base)
        if strayed < least:
            best, least = (start, commands), strayed
        if least == 0.0:
            break
    assert best is not None
    return best


def line_follower(kind: str, rng: np.random.Generator) -> tuple[Pose, Controller]:
    """Draw a controller that follows the line, and where to start it.

    Parameters
    ----------
    kind
        ``line`` (white: curve left, black: spin right, as in the practice recordings) or ``line_smooth``
        (both duties proportional to the reading).
    rng
        Source of randomness.

    Returns
    -------
    tuple[Pose, Controller]
        Start pose beside the left straight, heading up, and the controller.
    """
    start = (
        0.175 + rng.normal(0.0, 0.003),
        0.60 + rng.normal(0.0, 0.003),
        math.pi / 2 + rng.normal(0.0, 0.02),
    )
    if kind == "line":
        outer, inner = int(rng.integers(4, 8)) * 5, int(rng.integers(7, 10)) * 5
        white, black = (outer, outer + 20), (outer + 20, -inner)
        threshold = int(rng.integers(40, 75))
        return start, lambda _, reading: white if reading > threshold else black
    base, gain = float(rng.uniform(22.0, 34.0)), float(rng.uniform(0.5, 0.8))

    def smooth(_: float, reading: int) -> tuple[int, int]:
        turn = gain * (reading - 50) * (1.0 if reading > 50 else 1.8)  # or it runs across the line in corners
        return _duty(base - turn), _duty(base + turn)

    return start, smooth


def _duty(wanted: float) -> int:
    """Whole percents, and no more than there is: what a brick would log."""
    return round(min(max(wanted, -100.0), 100.0))


def _holds(rng: np.random.Generator) -> Array:
    return _held(lambda: _hold(rng, backward=True))


def _gentle(rng: np.random.Generator) -> Array:
    return _held(lambda: _hold(rng, backward=False))


def _hold(rng: np.random.Generator, *, backward: bool) -> Hold:
    """One duty pair: rest, straight, spin, or an arc; mostly forward when gentle."""
    seconds, kind = float(rng.uniform(0.25, 1.0)), rng.random()
    speed = 10.0 * rng.integers(2, 9)
    sign = -1.0 if backward and rng.random() < 0.5 else 1.0
    if kind < 0.2:
        return seconds, 0.0, 0.0
    if kind < 0.45:
        return seconds, sign * speed, sign * speed
    if kind < 0.65:
        turn = speed if rng.random() < 0.5 else -speed
        return seconds, turn, -turn
    other = 10.0 * rng.integers(0, 9)
    return seconds, sign * speed, sign * other


def _reversals(rng: np.random.Generator) -> Array:
    """Go there and back again, straight or on the spot, at a pace drawn anew for every few strokes."""
    left_sign, sign = 1.0, 1.0

    def stroke() -> Hold:
        nonlocal left_sign, sign
        sign = -sign
        if rng.random() < 0.3:
            left_sign = -left_sign
        speed = sign * 10.0 * rng.integers(2, 9)
        return float(rng.uniform(0.2, 0.8)), left_sign * speed, speed

    return _held(stroke)


def _sines(rng: np.random.Generator) -> Array:
    """Draw a sine for each motor, 70 % high, of unlike rates."""
    times = np.arange(_ROWS) * _ROW_S
    rates, phases = rng.uniform(0.3, 1.4, 2), np.array([0.0, rng.uniform(-math.pi, math.pi)])
    duties: Array = np.round(70.0 * np.sin(2.0 * math.pi * rates * times[:, None] + phases))
    return duties


def _held(draw: Callable[[], Hold]) -> Array:
    commands, row = np.zeros((_ROWS, 2)), 0
    while row < _ROWS:
        seconds, left, right = draw()
        length = max(round(seconds / _ROW_S), 1)
        commands[row : row + length] = left, right
        row += length
    return commands


def _strayed(start: Pose, commands: Array, base: Base) -> float:
    """How far beyond the field's edge a planar first-order guess takes the axle [m]."""
    speeds, pose, worst = np.zeros(2), list(start), 0.0
    follow = _ROW_S / _SHAFT_TIME_S
    for row in commands:
        speeds += follow * (base.supply / base.back_emf_constant / 100.0 * row - speeds)
        left, right = base.wheel_radius * speeds
        pose[2] += _ROW_S * (right - left) / base.track_width
        pose[0] += _ROW_S * (left + right) / 2.0 * math.cos(pose[2])
        pose[1] += _ROW_S * (left + right) / 2.0 * math.sin(pose[2])
        worst = max(worst, -pose[0], -pose[1], pose[0] - FIELD[0], pose[1] - FIELD[1])
    return worst


_SCRIPTS: dict[str, Callable[[np.random.Generator], Array]] = {
    "holds": _holds,
    "holds_gentle": _gentle,
    "sines": _sines,
    "reversals": _reversals,
}
