"""What a foreign column means: guessed from its name, or as the user says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gecar.errors import expected
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.importing.units import QUANTITY, UNITS

# What the user says of a column: the recording's column, or None to pass it over; and its unit, or None to
# guess it.
Said = tuple[str | None, str | None]

_SPELLINGS = {
    spelling: unit
    for unit, spellings in {
        "s": "sec secs second seconds",
        "ms": "millis msec milliseconds",
        "us": "micros usec \u00b5s",
        "ns": "nanos nsec",
        "m": "meter meters metre metres",
        "px": "pixel pixels",
        "deg": "degree degrees \u00b0",
        "rad": "radian radians rads",
        "rev": "revs turns rotations",
        "pct": "percent %",
        "v": "volt volts",
        "mv": "millivolts",
        "rad_s": "rps",
    }.items()
    for spelling in spellings.split()
}
_TIME = {"t", "time", "timestamp", "clock", "stopwatch", "millis", "elapsed", "ms", "seconds"}
_LEFT = {"left", "l", "lft", "lm", "ml"}
_RIGHT = {"right", "r", "rgt", "rm", "mr"}
_DUTY = {"duty", "dc", "power", "pwr", "pwm", "cmd", "command", "u"}
_ANGLE = {
    "angle",
    "enc",
    "encoder",
    "tacho",
    "rotation",
    "position",
    "pos",
    "count",
    "counts",
    "ticks",
    "deg",
    "rot",
}
_OTHERS = {
    "reflection_pct": {
        "reflection",
        "reflected",
        "reflect",
        "refl",
        "light",
        "colour",
        "color",
        "sensor",
        "brightness",
    },
    "battery_v": {"battery", "batt", "bat", "vbat", "voltage"},
    "yaw_rate_dps": {"rate", "gyro", "omega", "dps"},
    "heading_deg": {"heading", "theta", "yaw", "orientation", "phi", "bearing", "psi"},
    "x_m": {"x"},
    "y_m": {"y"},
}
_PASSED_OVER = {
    "speed",
    "velocity",
    "vx",
    "vy",
    "v",
    "ax",
    "ay",
    "frame",
    "step",
    "line",
    "row",
    "index",
    "id",
    "raw",
}


@dataclass(frozen=True)
class Meaning:
    """What a foreign column is.

    Attributes
    ----------
    name
        Its name in the file.
    column
        The recording's column it becomes; ``None``: passed over.
    unit
        Its unit, a key of `UNITS`; ``None``: still to be guessed from the numbers.
    said
        Whether the user said so.
    """

    name: str
    column: str | None
    unit: str | None = None
    said: bool = False


def guess_meanings(
    names: Sequence[str], most: Sequence[float], said: Mapping[str, Said]
) -> tuple[Meaning, ...]:
    """Guess what each column is.

    Parameters
    ----------
    names
        The columns' names in the file.
    most
        The largest magnitude in each: a column named ``left`` and no more is a duty if that is at most 100,
        and an angle else.
    said
        What the user said, by name in the file.

    Returns
    -------
    tuple
        One `Meaning` a column, in order. Of several that seem to mean the same, the first is taken.
    """
    taken = {column for name, (column, _) in said.items() if name in names and column}
    context = _Context.of(names)
    meanings = []
    for name, size in zip(names, most, strict=True):
        if name in said:
            meanings.append(Meaning(name, *said[name], said=True))
            continue
        column, unit = context.guess(name, size)
        if column in taken:
            column = None
        elif column:
            taken.add(column)
        meanings.append(Meaning(name, column, unit))
    return tuple(meanings)


def parse_said(texts: Sequence[str]) -> dict[str, Said]:
    """Read ``NAME=COLUMN[:UNIT]`` options; ``NAME=-`` passes a column over.

    Raises
    ------
    InputError
        If one is not of that form, or names an unknown column or unit.
    """
    said: dict[str, Said] = {}
    for text in texts:
        name, equals, meaning = text.rpartition("=")
        column, _, unit = meaning.partition(":")
        if not equals or not name:
            raise expected(
                "--column", repr(text), "NAME=COLUMN or NAME=COLUMN:UNIT, as in 'lm=left_angle_deg:rad'"
            )
        if column != "-" and column not in COLUMNS:
            raise expected("--column", f"{column!r} in {text!r}", f"one of {', '.join(COLUMNS)}, or -")
        if unit and unit not in UNITS[QUANTITY[column]]:
            raise expected("--column", f"the unit {unit!r}", f"one of {', '.join(UNITS[QUANTITY[column]])}")
        said[name] = (None if column == "-" else column, unit or None)
    return said


def _words(name: str) -> list[str]:
    """Return the words of a column's name: ``leftAngle (deg)`` is left, angle, deg."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", name)
    return [word for word in re.split(r"[^a-z%\u00b0\u00b5]+", spaced.lower()) if word]


@dataclass(frozen=True)
class _Context:
    """What all names of a file say about one of them: the motors' ports, and whether there are positions."""

    sides: Mapping[str, str]
    with_pose: bool

    @staticmethod
    def of(names: Sequence[str]) -> _Context:
        """Look at all names. Of two ports, the first letter is the left motor's, as on most EV3 robots."""
        found = re.findall(r"(?:motor|out|port|angle|duty)[ _]?([a-d])\b", "\n".join(names).lower())
        ports = sorted(set(found))
        sides = {ports[0]: "left", ports[1]: "right"} if len(ports) == 2 else {}
        return _Context(sides, any("x" in _words(name) for name in names))

    def guess(self, name: str, most: float) -> Said:
        """Return the recording's column that a name means, and the unit it names."""
        if name in COLUMNS:
            return (
                name,
                "deg" if name == "heading_deg" else None,
            )  # the numbers of other columns tell their unit
        words = _words(name)
        column = self._column(set(words), self._side(words), most)
        if column is None:
            return None, None
        units = [_SPELLINGS.get(word, word) for word in words] if len(words) > 1 else []
        return column, next((unit for unit in reversed(units) if unit in UNITS[QUANTITY[column]]), None)

    def _side(self, words: Sequence[str]) -> str | None:
        """Return the wheel a name speaks of: ``left``, ``l_enc``, ``lduty``, ``motor_B``."""
        for word in words:
            if word in self.sides:
                return self.sides[word]
            if word in _LEFT | _RIGHT:
                return "left" if word in _LEFT else "right"
            if word[0] in "lr" and len(word) > 2 and word[1:] in _DUTY | _ANGLE:
                return "left" if word[0] == "l" else "right"
        return None

    def _column(self, words: set[str], side: str | None, most: float) -> str | None:
        if words & _PASSED_OVER:
            return None
        bare = words | {word[1:] for word in words if side}
        if bare & _DUTY:
            return f"{side or 'left'}_duty_pct"
        for column, known in _OTHERS.items():
            if words & known:
                return column
        if bare & _ANGLE and not side:
            return "heading_deg" if self.with_pose else "left_angle_deg"
        if side:
            return f"{side}_duty_pct" if most <= 100.0 and not bare & _ANGLE else f"{side}_angle_deg"
        return "t_s" if words & _TIME else None
