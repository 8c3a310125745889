"""A floor photographed at a slant, made straight: the homography that brings marks of known places where they belong.

A photograph of a plane shows it by a projective map, x' = (a x + b y + c) / (g x + h y + 1), y' likewise, of eight
numbers: four marks give them, more are fitted. Source: Hartley and Zisserman, Multiple View Geometry (2nd ed.), ch. 4
(direct linear transform on normalised points). A lens that bends straight lines is not made good.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
from PIL import Image

from gecar.errors import expected

Array = npt.NDArray[np.float64]
Places = Sequence[tuple[float, float]]

FEWEST_MARKS, MOST_MARKS = 4, 16
# Of the square of the marks' extent, the least area any three of four must span.
LEAST_AREA = 0.003
# Of the photograph's longer side: how far more than four marks may miss, and how far the field may reach beyond it.
SLACK = 0.02


def straightened(
    grey: npt.NDArray[np.uint8],
    marks_px: Places,
    marks_m: Places,
    size_m: tuple[float, float],
    per_metre: float,
    where: str,
) -> npt.NDArray[np.uint8]:
    """Return a photographed field as seen from straight above.

    Parameters
    ----------
    grey
        Grey levels, shape (rows, columns), row 0 at the bottom.
    marks_px, marks_m
        Places of four or more marks: in the photograph, from its upper left corner, right and down [pixels]; and on
        the field, from its lower left corner, right and up [m].
    size_m
        Width and height of the field [m].
    per_metre
        Pixels a metre of what is returned.
    where
        Said in errors.

    Returns
    -------
    numpy.ndarray
        Grey levels, row 0 at the bottom.

    Raises
    ------
    InputError
        If marks are too few, on a line, in disagreement, or do not leave all of the field in the photograph.
    """
    _check_marks(marks_px, marks_m, where)
    columns, rows = (round(length * per_metre) for length in size_m)
    # Rows of pictures count down, those of fields up.
    wanted = np.array([(x * per_metre, rows - y * per_metre) for x, y in marks_m])
    seen = np.array(marks_px, float)
    homography = _homography(wanted, seen)
    _check_seen(homography, wanted, seen, (columns, rows), (grey.shape[1], grey.shape[0]), where)
    picture = Image.fromarray(np.ascontiguousarray(grey[::-1]))
    numbers = (homography / homography[2, 2]).ravel()[:8].tolist()
    straight = picture.transform(
        (columns, rows), Image.Transform.PERSPECTIVE, numbers, Image.Resampling.BICUBIC, fillcolor=255
    )
    return np.ascontiguousarray(np.asarray(straight)[::-1])


def _check_marks(marks_px: Places, marks_m: Places, where: str) -> None:
    if not FEWEST_MARKS <= len(marks_px) <= MOST_MARKS:
        raise expected(f"{where}.marks_px", f"{len(marks_px)} marks", f"{FEWEST_MARKS} to {MOST_MARKS}")
    if len(marks_px) != len(marks_m):
        raise expected(
            f"{where}.marks_m", f"{len(marks_m)} places", f"{len(marks_px)}, one a mark of marks_px"
        )
    for name, marks in (("marks_px", marks_px), ("marks_m", marks_m)):
        if _largest_span(np.array(marks, float)) < LEAST_AREA:
            raise expected(
                f"{where}.{name}", "marks on a line, or nearly", "four of which no three lie on a line"
            )


def _largest_span(marks: Array) -> float:
    """Return, over all sets of four, the largest of the least area three of them span, as a share of the extent's."""
    extent = float(np.ptp(marks, axis=0).max()) ** 2
    return max(
        min(_area(*three) for three in combinations(four, 3)) for four in combinations(marks, 4)
    ) / max(extent, 1e-12)


def _area(a: Array, b: Array, c: Array) -> float:
    (ux, uy), (vx, vy) = b - a, c - a
    return 0.5 * abs(float(ux * vy - uy * vx))


def _homography(places: Array, seen: Array) -> Array:
    """Return the map from places to where they are seen, shape (3, 3), by least squares."""
    to_unit, from_unit = _normalising(places), _normalising(seen)
    p, q = _mapped(to_unit, places), _mapped(from_unit, seen)
    rows = []
    for (x, y), (u, v) in zip(p, q, strict=True):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y, -u])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y, -v])
    flattest = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    found: Array = np.linalg.inv(from_unit) @ flattest @ to_unit
    return found / found[2, 2]


def _normalising(points: Array) -> Array:
    """Return the shift and scale that put points around 0 at a mean distance of sqrt 2."""
    middle = points.mean(axis=0)
    scale = np.sqrt(2.0) / np.mean(np.hypot(*(points - middle).T))
    return np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1.0]])


def _mapped(homography: Array, points: Array) -> Array:
    x, y, w = homography @ np.vstack([points.T, np.ones(len(points))])
    return np.column_stack([x / w, y / w])


def _check_seen(
    homography: Array, wanted: Array, seen: Array, field: tuple[int, int], photo: tuple[int, int], where: str
) -> None:
    corners = np.array([(x, y) for x in (0.0, field[0]) for y in (0.0, field[1])])
    depth = (homography @ np.vstack([corners.T, np.ones(4)]))[2]
    # Seen from above, a turn one way on the floor is a turn the same way in the photograph.
    if depth.min() <= 0.0 or np.linalg.det(homography) <= 0.0:
        raise expected(
            f"{where}.marks_px", "marks in another order than marks_m", "the same mark at each place"
        )
    slack = SLACK * max(photo)
    missed = float(np.hypot(*(_mapped(homography, wanted) - seen).T).max())
    if missed > slack:
        found = f"marks that fit together to {missed:.0f} pixels only"
        raise expected(f"{where}.marks_px", found, f"{slack:.0f}, or four marks")
    edges = _mapped(homography, corners)
    if (edges < -slack).any() or (edges > np.array(photo) + slack).any():
        raise expected(
            where, f"a photograph of {photo[0]} x {photo[1]} pixels that cuts the field", "all of it"
        )
