"""Every threshold of the decision: its value, what it means, and where it comes from.

Where the source is a study, `benchmarks/concealed` makes such cases (``python -m benchmarks.concealed``): the first two
examinations (seeds 894542421 and 899759292), and development cases with a background, 24 of MuJoCo's world and 38 of
the continuous one (seed 5). "Hand" marks a value that no study varied.
"""

from __future__ import annotations

from typing import Self


class Threshold(float):
    """A number with its meaning and its source."""

    meaning: str
    source: str

    def __new__(cls, value: float, meaning: str, source: str) -> Self:
        """Make a number that carries words."""
        made = super().__new__(cls, value)
        made.meaning, made.source = meaning, source
        return made


_EXAMINED = "first two examinations"
_EMPTY = "81 cases of the 3D engine with nothing concealed"

# -- Evidence
SIGNIFICANCE = Threshold(0.05, "p-value below which something is taken for real", "convention")
ONE_FOLD = Threshold(
    0.9, "share of a step's gain in one recording from which leaving that out tells nothing", "hand"
)

# -- Forward selection
MOST_EFFECTS = Threshold(4, "effects a robot on the floor is given", "hand")
MOST_ON_BENCH = Threshold(
    7, "effects a motor on a bench is given: it is known to tenths of a percent", "hand"
)
COMPETING = Threshold(0.3, "share of the best gain below which an effect is no rival", "hand")
NEGLIGIBLE = Threshold(
    0.02,
    "share of a gain, of excess energy, of information on a parameter, that is as good as none",
    "hand",
)
SEARCHED = Threshold(2.0, "prices of a name an effect must gain to be searched without derivatives", "hand")
DOUBTFUL_FIT = Threshold(1.5, "excess energy a block after which a fit is searched about", "hand")

# -- Clocks of the camera
CLOCKS_FIRST = Threshold(
    0.8, "share of the best effect's gain from which clock offsets are fitted first", _EXAMINED
)
CLOCKS_OVER_COMMON = Threshold(1.3, "times the gain of a common delay that offsets must reach", _EXAMINED)

# -- What explains, and what imitates
WHOLE_SHARE = Threshold(0.85, "share of all excess energy that effects together must explain", _EXAMINED)
MAIN_SHARE = Threshold(
    0.35,
    "share of what is left without it, squared, that an effect beside the unexplained must explain",
    _EXAMINED,
)
STEADY = Threshold(
    0.08,
    "relative spread over recordings of an effect's size, beside what nothing explains",
    "10 cases of the 3D engine: causes beside other physics 0.00 to 0.06, imitations of that physics 0.10 to 0.27",
)
LEFT_SHARE = Threshold(
    0.15,
    "share of what parted before that may be left without a word",
    "laws are off by up to 12 % of an effect's size (`Parameter.model_error`)",
)

MEASURED = Threshold(
    2.0,
    "times the line of what is material that what is left must be: it holds the errors of measuring it",
    "hand",
)

# -- What a simulation is off by
SMALL = Threshold(
    0.3,
    "sizes worth a name: standard deviation of what a robot's constants are off by",
    "with `PRICE` a name begins at 1.3 sizes; 0.5 missed half of what is worth a name, in cases with a background",
)
LARGE = Threshold(3.0, "the same, of changes whose remainder is physics in no list", "ten times `SMALL`")

# -- What a name costs
PRICE = Threshold(
    10.0,
    "log-likelihood an effect must gain beside small changes of all constants",
    "prior odds of 1 in 30 effects (3.4), and of a size between one and a hundred names (4.6), rounded up",
)

# -- Alternatives that the recordings cannot separate
CLOSE = Threshold(
    0.3, "share of an effect's gain that an alternative may lose, and no more than `PRICE`", "hand"
)
CERTAIN = Threshold(2.5, "standard deviations of that loss beyond which it is certain", "hand")

# -- Size
STOPPED = Threshold(8.0, "coordinates from neutral at which a fit that ends at a bound has not ended", "hand")
LEAST_INVERSE = Threshold(0.02, "coordinate of a limit or rate worth a name", "hand")

# -- What passes for the sensors' noise
WHITE_MOTION = Threshold(
    0.7, "excess energy a block of motion that the simulation leaves where nothing is missing", _EMPTY
)
WHITE_READINGS = Threshold(
    6.0, "the same, of readings: a path's errors last while the sensor crosses an edge", _EMPTY
)

# -- Places on the floor
HOTSPOT = Threshold(
    22.0,
    "standard deviations of a cell's excess energy that make it a place",
    "200 empty cases of the 3D engine stayed below 16; ridges of 1.3 to 2.4 mm reached 34 to 79",
)


def table() -> tuple[tuple[str, Threshold], ...]:
    """Return every threshold with its name."""
    return tuple((name, value) for name, value in globals().items() if isinstance(value, Threshold))
