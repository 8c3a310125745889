"""The floor as an image of brightness: drawn from the line's area, or taken from a scan or photograph."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image
from shapely.geometry import LinearRing, MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from gecar.errors import InputError, expected

PITCH_M = 0.001
MAX_CELLS = 50_000_000  # 50 m^2 at 1 mm, 50 MB
WHITE = 255
# Half covered cells are common (an edge in the middle of a cell); nudged, rounding cannot split such ties.
_NUDGE = 1e-6


def raster_shape(width_m: float, height_m: float, pitch_m: float) -> tuple[int, int]:
    """Return rows and columns of cells that cover a field.

    Raises
    ------
    InputError
        If the pitch is not a positive length, or there would be too many cells.
    """
    if not 1e-5 <= pitch_m <= 1.0:
        raise expected("raster pitch", f"{pitch_m} m", "1e-5 to 1 m")
    columns, rows = (math.ceil(length / pitch_m - 1e-6) for length in (width_m, height_m))
    if columns * rows > MAX_CELLS:
        raise expected("raster pitch", f"{pitch_m} m, {columns} x {rows} cells", f"at most {MAX_CELLS} cells")
    return rows, columns


def draw(area: MultiPolygon, width_m: float, height_m: float, pitch_m: float) -> npt.NDArray[np.uint8]:
    """Draw the line on a white floor.

    Parameters
    ----------
    area
        What the line covers [m].
    width_m, height_m
        Field [m].
    pitch_m
        Edge of a cell [m].

    Returns
    -------
    numpy.ndarray
        Brightness, 255 bare floor to 0 line, by the share of the cell that is covered; shape (rows, columns),
        row 0 at the bottom.

    Raises
    ------
    InputError
        As `raster_shape`.
    """
    shape = raster_shape(width_m, height_m, pitch_m)
    share = np.zeros(shape)
    for polygon in area.geoms:
        _add_share(share, polygon, pitch_m)
    np.clip(share, 0.0, 1.0, out=share)
    return np.floor(WHITE * (1.0 - share) + (0.5 + _NUDGE)).astype(np.uint8)


def _add_share(share: npt.NDArray[np.float64], polygon: Polygon, pitch_m: float) -> None:
    """Add the exact share of each cell that a polygon covers.

    Every edge adds, to each cell it passes and to all cells right of it, the height it spans there times the
    part of the cell to its right; over a closed ring these sum to the area inside (the signed-area rule of
    font rasterisers).
    """
    rings = [np.asarray(ring.coords) / pitch_m for ring in _rings(polygon)]
    low = np.floor(np.min([ring.min(axis=0) for ring in rings], axis=0) + 1e-9).astype(int)
    high = np.ceil(np.max([ring.max(axis=0) for ring in rings], axis=0) - 1e-9).astype(int)
    width, height = np.maximum(high - low, 1)
    change = np.zeros((height + 1, width + 2))
    for ring in rings:
        for a, b in pairwise(ring):
            _add_edge(change, a - low, b - low)
    rows, columns = share.shape
    covered = np.cumsum(change[:, :-1], axis=1)[: min(height, rows - low[1]), : min(width, columns - low[0])]
    share[low[1] : low[1] + covered.shape[0], low[0] : low[0] + covered.shape[1]] += covered


def _rings(polygon: Polygon) -> list[LinearRing]:
    # Clockwise outside: edges on the left go up, and then add.
    turned = orient(polygon, -1.0)
    return [turned.exterior, *turned.interiors]


def _add_edge(
    change: npt.NDArray[np.float64], a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]
) -> None:
    """Add one edge's part, cut where it passes from cell to cell."""
    if a[1] == b[1]:
        return
    cuts = [np.array([0.0, 1.0])]
    for axis in (0, 1):
        low, high = sorted((a[axis], b[axis]))
        lines = np.arange(math.ceil(low), math.floor(high) + 1)
        if high > low:
            cuts.append(np.clip((lines - a[axis]) / (b[axis] - a[axis]), 0.0, 1.0))
    t = np.unique(np.concatenate(cuts))
    x = a[0] + t * (b[0] - a[0])
    rise = np.diff(t) * (b[1] - a[1])
    middle_x = 0.5 * (x[1:] + x[:-1])
    middle_y = a[1] + 0.5 * (t[1:] + t[:-1]) * (b[1] - a[1])
    column = np.clip(middle_x.astype(int), 0, change.shape[1] - 2)
    row = np.clip(middle_y.astype(int), 0, change.shape[0] - 1)
    part = middle_x - column
    np.add.at(change, (row, column), rise * (1.0 - part))
    np.add.at(change, (row, column + 1), rise * part)


@dataclass(frozen=True)
class FloorImage:
    """A floor as a picture.

    Attributes
    ----------
    brightness
        255 bare floor to 0 line, shape (rows, columns), row 0 at the bottom.
    pixels_per_metre
        Its scale.
    """

    brightness: npt.NDArray[np.uint8]
    pixels_per_metre: float


def read_image(path: Path, where: str) -> npt.NDArray[np.uint8]:
    """Read a picture of a floor as grey levels.

    Returns
    -------
    numpy.ndarray
        Grey levels 0 (black) to 255 (white), shape (rows, columns), row 0 at the **bottom**.

    Raises
    ------
    InputError
        If it is missing, no picture, or has more pixels than a raster may have cells.
    """
    try:
        with warnings.catch_warnings():  # the check below says it in one line
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture = Image.open(path)
        with picture:
            _check_picture(picture, where)
            sheet = Image.new("RGBA", picture.size, "white")
            sheet.alpha_composite(picture.convert("RGBA"))
    except InputError:
        raise
    except FileNotFoundError:
        raise expected(where, f"no file {path}", "a picture of the course") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise expected(
            where, f"{path.name}, which cannot be read ({error})", "a PNG, JPEG or TIFF file"
        ) from None
    return np.ascontiguousarray(np.asarray(sheet.convert("L"))[::-1])


def _check_picture(picture: Image.Image, where: str) -> None:
    if picture.width * picture.height > MAX_CELLS:
        raise expected(where, f"{picture.width} x {picture.height} pixels", f"at most {MAX_CELLS} pixels")
    if picture.mode[0] in "IF":
        raise expected(where, f"pixels of kind {picture.mode}", "8 bits a channel")


def resample(picture: FloorImage, width_m: float, height_m: float, pitch_m: float) -> npt.NDArray[np.uint8]:
    """Bring a picture, lower left corner on the field's, to a raster's cells; white where the picture ends.

    Raises
    ------
    InputError
        As `raster_shape`.
    """
    rows, columns = raster_shape(width_m, height_m, pitch_m)
    grey, per_metre = picture.brightness, picture.pixels_per_metre
    reach = rows * pitch_m * per_metre, columns * pitch_m * per_metre
    sheet = np.full([max(math.ceil(r), n) for r, n in zip(reach, grey.shape, strict=True)], WHITE, np.uint8)
    sheet[: grey.shape[0], : grey.shape[1]] = grey
    shrinks = pitch_m * per_metre >= 1.0
    rule = Image.Resampling.BOX if shrinks else Image.Resampling.BILINEAR
    small = Image.fromarray(sheet).resize((columns, rows), rule, box=(0.0, 0.0, reach[1], reach[0]))
    return np.array(small)
