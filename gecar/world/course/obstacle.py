"""Things that stand on a course."""

from __future__ import annotations

from dataclasses import dataclass

from shapely import affinity
from shapely.geometry import Point, Polygon, box


@dataclass(frozen=True)
class Obstacle:
    """Something on the floor, at a pose [m, m, rad].

    Attributes
    ----------
    kind
        "box" or "disc".
    length, width
        Of a box, along and across its heading [m]; of a disc, its diameter.
    mass
        [kg].
    friction
        Coulomb coefficient, against the floor and whatever touches it.
    movable
        Whether it can be pushed; if not, it stands like a wall.
    """

    kind: str
    x: float
    y: float
    heading: float
    length: float
    width: float
    mass: float
    friction: float
    movable: bool

    @property
    def radius(self) -> float:
        """Radius of a disc [m]."""
        return 0.5 * self.length

    @property
    def outline(self) -> Polygon:
        """Its outline at its pose [m]."""
        if self.kind == "disc":
            return Point(self.x, self.y).buffer(self.radius, quad_segs=32)
        half_length, half_width = 0.5 * self.length, 0.5 * self.width
        at_origin = box(-half_length, -half_width, half_length, half_width)
        turned = affinity.rotate(at_origin, self.heading, origin=(0, 0), use_radians=True)
        return affinity.translate(turned, self.x, self.y)
