"""The colour sensor: the floor's raster averaged over a spot, then lag, delay, gain, noise and whole percent."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.fft
import scipy.ndimage

from gecar.compiled import kernel

# Most steps a delay may span: 0.25 s at the smallest step of 0.1 ms, in a ring whose size is a power of two.
RING = 4096


def _disc_points() -> npt.NDArray[np.float64]:
    """Return points that stand for equal areas of the unit disc, shape (30, 2): ahead and left.

    Three rings of 4, 10 and 16 at each ring's mean square radius: the mean and the second moments are a disc's own.
    """
    rings = ((4, 2.0), (10, 9.0), (16, 22.0))
    points = [
        (math.sqrt(area / 30.0) * math.cos(angle), math.sqrt(area / 30.0) * math.sin(angle))
        for count, area in rings
        for angle in (2.0 * math.pi * (k + 0.5) / count for k in range(count))
    ]
    return np.array(points)


_DISC = _disc_points()
BLOCK = 4  # cells across a block


class Surface(NamedTuple):
    """A floor's cells, and where they are alike: what fits predict readings from; make it with `surface`.

    Attributes
    ----------
    cells
        Brightness, 255 bare floor and 0 line, shape (rows, columns), row 0 at the bottom. Around it the floor is bare.
    pitch
        Edge of a cell [m].
    even
        How many cells, at least, around each block of `BLOCK` x `BLOCK` have its brightness, shape (rows, columns).
    """

    cells: npt.NDArray[np.uint8]
    pitch: float
    even: npt.NDArray[np.int32]


def surface(cells: npt.NDArray[np.uint8], pitch: float) -> Surface:
    """Find where a floor is even: for most of a drive the spot lies there, and one cell says as much as its average.

    ``cells`` and ``pitch`` are as in `Surface`.
    """
    beyond = [(0, -size % BLOCK) for size in cells.shape]
    filled = np.pad(cells, beyond, constant_values=255)
    blocks = filled.reshape(filled.shape[0] // BLOCK, BLOCK, filled.shape[1] // BLOCK, BLOCK)
    darkest = scipy.ndimage.minimum_filter(blocks.min((1, 3)), 3, mode="constant", cval=255)
    brightest = scipy.ndimage.maximum_filter(blocks.max((1, 3)), 3, mode="constant", cval=255)
    even = scipy.ndimage.distance_transform_cdt(darkest == brightest, "chessboard")
    return Surface(cells, pitch, (BLOCK * even.clip(0)).astype(np.int32))  # -1 where nothing is drawn at all


def spot_average(raster: npt.NDArray[np.uint8], pitch: float, diameter: float) -> npt.NDArray[np.float32]:
    """Average a floor over the spot around each cell's centre, so that a reading is one look-up.

    The sums are whole numbers and rounded as such: the same bits on every machine.

    Parameters
    ----------
    raster, pitch
        Floor, shape (rows, columns), 255 bare and 0 line; size of a cell [m]. Around it the floor is bare.
    diameter
        The spot's [m].

    Returns
    -------
    numpy.ndarray
        Brightness 0..255, shape (rows, columns).
    """
    weights = _disc_weights(0.5 * spot_reach(pitch, diameter) / pitch)
    n = len(weights) // 2
    shape = [scipy.fft.next_fast_len(size + 2 * n, real=True) for size in raster.shape]
    spectrum = scipy.fft.rfft2(255.0 - raster, shape) * scipy.fft.rfft2(weights, shape)
    dark = np.rint(scipy.fft.irfft2(spectrum, shape)[n : n + raster.shape[0], n : n + raster.shape[1]])
    return (255.0 - dark / weights.sum()).astype(np.float32)


def _disc_weights(radius: float) -> npt.NDArray[np.float64]:
    """Return how many of 20 x 20 points in each cell a disc around the middle one covers, shape (2n + 1, 2n + 1)."""
    n = math.ceil(radius)
    points = (np.arange((2 * n + 1) * 20) + 0.5) / 20.0 - (n + 0.5)
    covered = points[:, None] ** 2 + points[None, :] ** 2 <= max(radius, 0.1) ** 2
    return covered.reshape(2 * n + 1, 20, 2 * n + 1, 20).sum((1, 3)).astype(np.float64)


@kernel
def spot_reach(pitch: float, diameter: float) -> float:
    """Return the diameter [m] to average over for a spot: cells blur by themselves.

    A bilinear look-up of square cells spreads a point with variance pitch^2 (1/12 + 1/6) an axis, as a disc of
    diameter 2 pitch does; variances add, so the spot gives that much up.
    """
    return math.sqrt(max(diameter * diameter - 4.0 * pitch * pitch, 0.0))


@kernel
def glance(
    averaged: npt.NDArray[np.float32], pitch: float, s: Any, front: float, left: float, p: Any
) -> float:
    """Return what the sensor sees [%], before lag, delay and noise, on a floor averaged by `spot_average`.

    Parameters
    ----------
    averaged, pitch
        Brightness, shape (rows, columns); size of a cell [m].
    s, p
        Records of dtypes `STATE` and `PHYSICS`.
    front, left
        How far this sensor sits to the front and to the left of its nominal place [m].
    """
    ahead = p.sensor_ahead + front - p.com_ahead
    x, y = _where_drawn(s.x, s.y, s.cos, s.sin, ahead, p.sensor_left + left, p, averaged, pitch)
    return p.black + (p.white - p.black) * floor_brightness(averaged, pitch, x, y) / 255.0


@kernel
def _where_drawn(
    x: float, y: float, cos: float, sin: float, ahead: float, aside: float, p: Any,
    raster: npt.NDArray[Any], pitch: float,
) -> tuple[float, float]:  # fmt: skip
    """Return where the floor under a sensor is drawn [m], as the course may lie displaced, or be another size."""
    x, y = x + ahead * cos - aside * sin - p.line_dx, y + ahead * sin + aside * cos - p.line_dy
    if p.line_angle != 0.0:
        turn_cos, turn_sin = math.cos(p.line_angle), math.sin(p.line_angle)
        x, y = x * turn_cos + y * turn_sin, y * turn_cos - x * turn_sin
    if p.line_scale != 1.0:
        middle_x, middle_y = 0.5 * pitch * raster.shape[1], 0.5 * pitch * raster.shape[0]
        x, y = middle_x + (x - middle_x) / p.line_scale, middle_y + (y - middle_y) / p.line_scale
    return x, y


@kernel
def floor_brightness(raster: npt.NDArray[Any], pitch: float, x: float, y: float) -> float:
    """Return the floor's brightness at a point [m], 0 (line) to 255, bilinear; bare floor outside the field."""
    column = x / pitch - 0.5
    row = y / pitch - 0.5
    j = math.floor(column)
    i = math.floor(row)
    if j < 0 or i < 0 or j >= raster.shape[1] - 1 or i >= raster.shape[0] - 1:
        return 255.0
    right = column - j
    up = row - i
    j = int(j)
    i = int(i)
    below = (1.0 - right) * raster[i, j] + right * raster[i, j + 1]
    above = (1.0 - right) * raster[i + 1, j] + right * raster[i + 1, j + 1]
    return (1.0 - up) * below + up * above


@kernel
def spot_reflection(
    floor: Surface,
    x: float,
    y: float,
    cos: float,
    sin: float,
    front: float,
    left: float,
    p: Any,
) -> float:
    """Return what the sensor sees [%], before lag, delay and noise, averaging the spot on the way.

    For fits, where spot, place and floor may differ from call to call; drives `glance`.

    Parameters
    ----------
    floor
        From `surface`.
    x, y, cos, sin
        The axle's centre [m] and the heading.
    front, left
        How far this sensor sits to the front and to the left of its nominal place [m].
    p
        Record of dtype `PHYSICS`.
    """
    ahead, aside = p.sensor_ahead + front, p.sensor_left + left
    px, py = _where_drawn(x, y, cos, sin, ahead, aside, p, floor.cells, floor.pitch)
    radius = 0.5 * spot_reach(floor.pitch, p.spot_diameter) / p.line_scale
    if is_even(floor, px, py, radius):
        share = floor.cells[int(py / floor.pitch), int(px / floor.pitch)] / 255.0
    else:
        turn_cos, turn_sin = math.cos(p.line_angle), math.sin(p.line_angle)
        along = radius * (cos * turn_cos + sin * turn_sin)
        across = radius * (sin * turn_cos - cos * turn_sin)
        total = 0.0
        for k in range(_DISC.shape[0]):
            dx = along * _DISC[k, 0] - across * _DISC[k, 1]
            dy = across * _DISC[k, 0] + along * _DISC[k, 1]
            total += floor_brightness(floor.cells, floor.pitch, px + dx, py + dy)
        share = total / (255.0 * _DISC.shape[0])
    return p.black + (p.white - p.black) * share


@kernel
def is_even(floor: Surface, x: float, y: float, radius: float) -> bool:
    """Whether all cells within a radius of a point on the floor [m], and those beside them, are of one brightness."""
    row, column = int(y / (BLOCK * floor.pitch)), int(x / (BLOCK * floor.pitch))
    inside = x >= 0.0 and y >= 0.0 and row < floor.even.shape[0] and column < floor.even.shape[1]
    return inside and floor.even[row, column] * floor.pitch > radius + floor.pitch


@kernel
def reported(reflection: float, noise: float, p: Any) -> float:
    """Return the whole percent the sensor reports for a reflection [%] with noise [%] added."""
    level = p.sensor_gain * reflection + p.sensor_offset + noise
    return min(max(math.floor(level + 0.5), 0.0), 100.0)


@kernel
def lagged(last: float, now: float, keep: float) -> float:
    """Return a first-order lag's output; ``keep`` = exp(-step / time constant), 0 without lag."""
    return keep * last + (1.0 - keep) * now


@kernel
def lag_keep(dt: float, time_constant: float) -> float:
    """Return the share of its old value a lag keeps over a step; 0 without lag."""
    return math.exp(-dt / time_constant) if time_constant > 0.0 else 0.0


@kernel
def delayed(rings: npt.NDArray[np.float64], ring: int, newest: int, steps: float) -> float:
    """Return a value ``steps`` (any real number) before the newest, linear between entries.

    ``rings``, shape (k * RING,), holds several rings; this one begins at ``ring``.
    """
    whole = int(steps)
    part = steps - whole
    last = newest - whole
    newer = rings[ring + (last & (RING - 1))]
    older = rings[ring + ((last - 1) & (RING - 1))]
    return (1.0 - part) * newer + part * older
