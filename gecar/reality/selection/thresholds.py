"""What structure counts for something, measured where nothing is missing."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Limits:
    """What structure counts for something, a block of samples; noise alone leaves 0 on average.

    Attributes
    ----------
    floor
        What the simulation itself leaves where nothing is missing.
    least_drop
        What an effect must explain at least.
    unexplained
        What may be left without a word.
    """

    floor: float
    least_drop: float
    unexplained: float


# Measured on robots in a 3D engine with nothing concealed: motion 0.2 to 0.6; sight up to 8, for a path's errors
# linger while the sensor crosses an edge; of 81 none lost a third of that to an effect worth a name.
MOTION = Limits(floor=0.7, least_drop=0.1, unexplained=2.5)
SIGHT = Limits(floor=6.0, least_drop=0.8, unexplained=25.0)
# A path is smoothed with a model's help: where that does not explain how the robot moves, less is known of the path.
SIGHT_ON_A_DOUBTFUL_PATH = replace(SIGHT, least_drop=SIGHT.floor)
