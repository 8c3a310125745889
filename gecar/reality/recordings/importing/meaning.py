"""What a foreign column means: guessed from its name, or as the user says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gecar.errors import expected
from gecar.reality.recordings.importing.units import QUANTITY, UNIT_NAMES

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
        "count": "counts tick ticks pulse pulses",
        "rpm": "rpms",
        "rad_s": "rps",
    }.items()
    for spelling in spellings.split()
}
_UNITS = {*_SPELLINGS, *(unit for units in UNIT_NAMES.values() for unit in units)}
_PER_SECOND = re.compile(
    r"(?:^|[^a-z])(mm|cm|m|rad|deg|rev|counts?|ticks?)(?:[ _]*/[ _]*|[ _]per[ _]|[ _])s(?:ec|econd)?s?(?:[^a-z]|$)"
)
_SPEEDS = {"deg": "dps", "count": "count_s", "counts": "count_s", "tick": "count_s", "ticks": "count_s"}


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_TIME = _set("t time timestamp clock stopwatch millis elapsed ms seconds stamp secs")
_LEFT, _RIGHT = _set("left l lft lm ml"), _set("right r rgt rm mr")
_DUTY = _set("duty dc power pwr pwm cmd command u")
_PERCENT = _set("pct percent %")
_SPEED = _set("speed velocity vel rpm omega dps w v")
_ANGLE = _set("angle enc encoder tacho rotation position pos count counts tick ticks pulses deg rot")
_COUNTS = _set("enc encoder count counts tick ticks pulses")
_MOTOR = _set("motor wheel large medium out port in a b c d")  # say nothing of a quantity
_RUNS = _set("run trial experiment episode session")
_OTHERS = {
    "reflection_pct": _set("reflection reflected reflect refl light colour color sensor brightness"),
    "battery_v": _set("battery batt bat vbat voltage"),
    "yaw_rate_dps": _set("rate gyro omega dps angular gz"),
    "heading_deg": _set("heading theta yaw orientation phi bearing psi"),
    "x_m": _set("x"),
    "y_m": _set("y"),
}
# Robots log much that is no column of a recording, under names that have a wheel in them: modes, setpoints, currents.
_PASSED_OVER = _set(
    "vx vy ax ay az gx gy frame step line row index id raw seq mode state status flag target setpoint set reference "
    "ref desired goal error err current amps torque effort temperature temp kp ki kd acceleration accel acc linear "
    "covariance magnetic quality valid"
)


@dataclass(frozen=True)
class Meaning:
    """What a foreign column is.

    Attributes
    ----------
    name
        Its name in the file.
    column
        The column it becomes, one of `QUANTITY`: a recording's, or a wheel's speed; ``None``: passed over.
    unit
        Its unit, one of `UNIT_NAMES`; ``None``: still to be guessed from the numbers.
    said
        Whether the user said so.
    """

    name: str
    column: str | None
    unit: str | None = None
    said: bool = False

    @property
    def counts(self) -> bool:
        """Whether its name speaks of an encoder's counts."""
        return bool(_COUNTS & _stems(_words(self.name)))

    @property
    def surely_duty(self) -> bool:
        """Whether its name, or the user, leaves no doubt that it is a duty."""
        return self.said or bool({"duty", "dc", "pct", "percent", "%"} & _stems(_words(self.name)))

    @property
    def pwm(self) -> bool:
        """Whether its name speaks of pulse widths, which count to 100, 255 or more."""
        return "pwm" in _stems(_words(self.name))


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
        One `Meaning` a column, in order. Of several that seem to mean the same, the first is taken; a wheel's speed
        only where its angle is not there.
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
    return tuple(
        Meaning(m.name, None) if m.column in SPEED_OF and not m.said and SPEED_OF[m.column] in taken else m
        for m in meanings
    )


SPEED_OF: Mapping[str | None, str] = {f"{side}_speed_dps": f"{side}_angle_deg" for side in ("left", "right")}
"""Column of a wheel's speed, and of the angle it adds up to."""


def names_time(name: str) -> bool:
    """Say whether a column of this name is taken for the time."""
    return _Context({}, False, False).guess(name, 0.0)[0] == "t_s"


def counts_runs(name: str) -> bool:
    """Say whether a column of this name is taken to number runs."""
    words = set(_words(name)) - {"no", "nr", "number", "num", "id", "index"}
    return bool(words) and words <= _RUNS


def is_unit(cell: str) -> bool:
    """Say whether a cell, as below a column's name, is a unit."""
    return cell.lower().strip("[]() ") in _UNITS or _per_second(cell) is not None


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
        if column != "-" and column not in QUANTITY:
            raise expected("--column", f"{column!r} in {text!r}", f"one of {', '.join(QUANTITY)}, or -")
        known = UNIT_NAMES[QUANTITY[column]] if column != "-" else ()
        if unit and unit not in known:
            raise expected(
                "--column", f"the unit {unit!r}", f"one of {', '.join(known)}" if known else "none"
            )
        said[name] = (None if column == "-" else column, unit or None)
    return said


def _words(name: str) -> list[str]:
    """Return the words of a column's name: ``leftAngle (deg)`` is left, angle, deg."""
    return [word for word in re.split(r"[^a-z%\u00b0\u00b5]+", _spaced(name.lstrip("%_"))) if word]


def _spaced(name: str) -> str:
    """Return a name in small letters, parted before capitals: ``leftAngle``, ``PositionInMM``."""
    return re.sub(r"(?<=[a-z])(?=[A-Z][a-z]|[A-Z]{2})", " ", name).lower()


def _stems(words: Sequence[str]) -> set[str]:
    """Return words, and what is left of those that a wheel's letter begins or ends: ``lpwm`` and ``pwml`` are pwm."""
    known = _DUTY | _ANGLE | _SPEED
    cut = [stem for word in words for stem in (word[1:] * (word[0] in "lr"), word[:-1] * (word[-1] in "lr"))]
    return set(words) | {stem for stem in cut if stem in known}


def _per_second(name: str) -> str | None:
    """Return the unit of speed that a name holds: ``v_left (mm/s)``, ``left_rad_s``."""
    found = _PER_SECOND.search(_spaced(name))
    return _SPEEDS.get(found[1], f"{found[1]}_s") if found else None


@dataclass(frozen=True)
class _Context:
    """What all names of a file say about one of them: the motors' ports, whether there are positions, two wheels."""

    sides: Mapping[str, str]
    with_pose: bool
    two_wheels: bool

    @staticmethod
    def of(names: Sequence[str]) -> _Context:
        """Look at all names. Of two ports, the first letter is the left motor's, as on most EV3 robots."""
        found = re.findall(r"(?:motor|out|port|angle|duty)[ _]?([a-d])\b", "\n".join(names).lower())
        ports = sorted(set(found))
        sides = {ports[0]: "left", ports[1]: "right"} if len(ports) == 2 else {}
        alone = _Context(sides, False, False)
        two = any(alone.side(_words(name)) == "right" for name in names)
        return _Context(sides, any("x" in _words(name) for name in names), two)

    def guess(self, name: str, most: float) -> Said:
        """Return the column that a name means, and the unit it names."""
        if name in QUANTITY:
            # The numbers of other columns tell their unit.
            return name, "deg" if name == "heading_deg" else "dps" if name in SPEED_OF else None
        words = _words(name)
        column = self._column(words, self.side(words), most)
        if column is None:
            return None, None
        known = UNIT_NAMES[QUANTITY[column]]
        units = [_SPELLINGS.get(word, word) for word in words] if len(words) > 1 else []
        units += [_per_second(name) or ""]
        if column == "yaw_rate_dps" and "angular" in words:
            units.append("rad_s")  # ROS: angular_velocity.z, twist.angular.z
        if column.endswith("duty_pct") and "voltage" in words:
            units.append("v")
        return column, next((unit for unit in reversed(units) if unit in known), None)

    def side(self, words: Sequence[str]) -> str | None:
        """Return the wheel a name speaks of: ``left``, ``l_enc``, ``lduty``, ``pwmr``, ``motor_B``."""
        for word in words:
            if word in self.sides:
                return self.sides[word]
            if word in _LEFT | _RIGHT:
                return "left" if word in _LEFT else "right"
            for letter, stem in ((word[0], word[1:]), (word[-1], word[:-1])):
                if letter in "lr" and stem in _DUTY | _ANGLE | _SPEED:
                    return "left" if letter == "l" else "right"
        return None

    def _column(self, words: Sequence[str], side: str | None, most: float) -> str | None:
        bare = _stems(words)
        if self._is_no_column(bare):
            return None
        if self._is_duty(bare, side):
            return f"{side or 'left'}_duty_pct"
        if bare & _SPEED and (side or not self._robots_own(bare)):
            return f"{side or 'left'}_speed_dps"
        for column, known in _OTHERS.items():
            if bare & known and not (side and column == "yaw_rate_dps"):
                return column
        return self._of_wheel(bare, side, most) if side else self._of_no_wheel(bare)

    @staticmethod
    def _of_wheel(words: set[str], side: str, most: float) -> str | None:
        """Return a wheel's column; a name that says no more than which wheel is a duty or an angle by its size."""
        if words & _ANGLE:
            return f"{side}_angle_deg"
        if words - _LEFT - _RIGHT - _MOTOR - _UNITS:
            return None
        return f"{side}_duty_pct" if most <= 100.0 else f"{side}_angle_deg"

    def _of_no_wheel(self, words: set[str]) -> str | None:
        if words & _ANGLE:
            return "heading_deg" if self.with_pose else "left_angle_deg"
        return "t_s" if words & _TIME else None

    @staticmethod
    def _is_no_column(words: set[str]) -> bool:
        """Say whether a name is of what no recording holds: a mode, a setpoint, one component of a vector in space."""
        if (words & _PASSED_OVER and not {"angular", "z"} <= words) or {"speed", "sp"} <= words:
            return True
        of_space = words & {"x", "y", "z", "w"}
        if words & {"gyro", "angular"}:
            return bool(words & {"x", "y"})
        return bool(of_space) and (bool(words & {"orientation", "quaternion"}) or "z" in words)

    @staticmethod
    def _is_duty(words: set[str], side: str | None) -> bool:
        if words & {"voltage", "volts", "volt"} and (side or words & {"motor", "control", "input"}):
            return not words & {"battery", "batt", "bat"}
        return bool(words & _DUTY) or bool(words & {"speed"} and words & _PERCENT)

    def _robots_own(self, words: set[str]) -> bool:
        """Say whether a speed without a side is the robot's, not that of the one wheel there is."""
        return self.two_wheels or self.with_pose or not words & {"speed", "velocity", "vel", "rpm"}
