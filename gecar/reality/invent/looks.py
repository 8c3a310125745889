"""What a law looks like, in the words a person would use."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from gecar.reality.invent.sentences import linear, pieces
from gecar.world.ports import BY_PORT, VARIABLES
from gecar.world.terms import Term

_TITLES = {variable.id: variable.title for variable in VARIABLES}


class _Known(NamedTuple):
    """A law known by name: at which ports, its shape, and words for a negative and a positive constant."""

    ports: tuple[str, ...]
    shape: str
    negative: str
    positive: str


_TORQUE, _FORCE = ("motor_torque",), ("force_ahead",)
_RATES = (
    ("pose_x", "ahead * cos(heading)"),
    ("pose_y", "ahead * sin(heading)"),
    ("pose_heading", "turn_rate"),
    ("sensor_ahead", "ahead"),
)
_KNOWN = (
    _Known(_TORQUE, r"speed \* abs\(speed\)", "drag growing with the square of the wheel's speed",
           "a push growing with the square of the wheel's speed"),
    _Known(_TORQUE, r"angle", "a spring that winds up as the wheel turns", "a push growing as the wheel turns"),
    _Known(_TORQUE, r"speed", "friction growing with speed", "a push growing with speed"),
    _Known(_TORQUE, r"(sign|tanh)\(\(?speed - other_speed.*", "axles that rub on each other",
           "axles that drive each other apart"),
    _Known(_TORQUE, r"sign\(speed\)", "dry friction in the gears", "less dry friction than the robot's file says"),
    _Known(_TORQUE, r"command", "weaker motors", "stronger motors"),
    _Known(_TORQUE, r"current", "motors that give less torque a current", "motors that give more torque a current"),
    _Known(("gear_friction",), r"1", "less dry friction than the robot's file says", "more dry friction in the gears"),
    _Known(("gear_friction",), r"exp\(\w+ \* cos\(angle - \w+\)\)", "a gear that turns easily at one angle of a turn",
           "a gear that sticks at one angle of a turn"),
    _Known(("gear_friction",), r"(abs\(speed\)|speed)", "friction that falls with speed",
           "friction that grows with speed"),
    _Known(("command", "motor_torque"), r"1", "motors that drive less forward and more backward",
           "motors that drive more forward and less backward"),
    _Known(("command",), r"command", "motors that do less than they are told",
           "motors that do more than they are told"),
    _Known(("command",), r"command \* (positive\(abs\(other_command\) - \w+\)|abs\(other_command\))",
           "motors that are weaker while the other is driven, too",
           "motors that are stronger while the other is driven, too"),
    _Known(("command",), r"sign\(command\)", "a dead band: the first part of a command is lost",
           "a head start of every command"),
    _Known(("command", "motor_torque"), r"side \* command", "a stronger left motor", "a stronger right motor"),
    _Known(("supply_voltage",), r"1", "a flatter battery", "a fuller battery"),
    _Known(("supply_voltage",), r"time", "a battery that runs down", "a battery that recovers"),
    _Known(("supply_voltage",), r"(draw|abs\(current\)|abs\(command\)|command \*\* 2)",
           "a battery that sags under load", "a battery that rises under load"),
    _Known(("rolling_radius",), r"1", "smaller wheels", "larger wheels"),
    _Known(("rolling_radius",), r"side \* 1", "a smaller right wheel", "a larger right wheel"),
    _Known(("tyre_grip",), r"1", "tyres that grip less", "tyres that grip more"),
    _Known(_FORCE, r"ahead \* abs\(ahead\)", "drag growing with the square of the robot's speed, as of air",
           "a push growing with the square of the robot's speed"),
    _Known(_FORCE, r"ahead", "drag growing with the robot's speed", "a push growing with the robot's speed"),
    _Known(_FORCE, r"sign\(ahead\)", "a constant drag: rolling resistance, or a caster that rubs",
           "a constant push along"),
    _Known(("yaw_moment",), r"turn_rate", "drag on turning", "a push on turning"),
    _Known(("yaw_moment",), r"sign\(turn_rate\)", "a caster that rubs when the robot turns", "a push on turning"),
    _Known(("yaw_moment",), r"1", "a constant pull to the right", "a constant pull to the left"),
    _Known(("gear_play",), r"1", "less play than the robot's file says", "play in the gears"),
    _Known(("gear_play",), r"time", "a wheel that gets tighter", "a wheel that comes loose"),
    _Known(("track_width",), r"1", "wheels closer together", "wheels farther apart"),
    _Known(("caster_friction",), r"1", "a caster that drags less", "a caster that drags"),
    _Known(("sensor_ahead",), r"1", "a colour sensor that sits farther back",
           "a colour sensor that sits farther ahead"),
    _Known(("sensor_aside",), r"1", "a colour sensor that sits farther right",
           "a colour sensor that sits farther left"),
    _Known(("sensor_aside",), r"turn_rate", "a colour sensor that reads late when the robot turns",
           "a colour sensor that reads early when the robot turns"),
    _Known(("sensor_ahead", "sensor_aside"), r"(cos|sin)\(heading\)", "a line that lies elsewhere",
           "a line that lies elsewhere"),
    _Known(("pose_turn",), r"time", "a camera that turns slowly", "a camera that turns slowly"),
    _Known(("pose_late",), r"1", "a camera that is early", "a camera that is late"),
    _Known(("pose_late",), r"time", "a camera whose clock runs fast", "a camera whose clock runs slow"),
    _Known(("force_x",), r"1", "a pull toward -x: a floor that is not level",
           "a pull toward +x: a floor that is not level"),
    _Known(("force_y",), r"1", "a pull toward -y: a floor that is not level",
           "a pull toward +y: a floor that is not level"),
    _Known(("gyro_reading",), r"1", "a gyro with an offset", "a gyro with an offset"),
    _Known(("gyro_reading",), r"turn_rate", "a gyro that reads too little", "a gyro that reads too much"),
    _Known(("colour_reading",), r"1", "a colour sensor that reads darker", "a colour sensor that reads brighter"),
    _Known(("colour_reading",), r"reading", "a colour sensor that reads less of what there is",
           "a colour sensor that reads more than there is"),
    _Known(("colour_reading",), r"time", "light that fades", "light that grows"),
    _Known(("colour_reading",), r"[xy]", "light that falls from one side", "light that falls from one side"),
    _Known(("colour_reading",), r"reading \* (sin|cos)\(heading\)", "light that comes from one side",
           "light that comes from one side"),
    _Known(("pose_x", "pose_y"), r"time", "a camera that drifts", "a camera that drifts"),
)  # fmt: skip


def looks_like(term: Term) -> str:
    """Return what a law looks like: its name where it is a known one, or else what it adds and on what that depends."""
    for say in (
        _spring,
        _lens,
        _once_per_turn,
        _late,
        _ramped,
        _paused,
        _holding,
        _wound_up,
        _stored,
        _named,
    ):
        words = say(term)
        if words:
            return words + _where(term)
    return _described(term)


def _where(term: Term) -> str:
    return "" if term.side == "both" else f", on the {term.side} wheel alone"


def _single(term: Term) -> tuple[str, float] | None:
    """Return the shape and the constant of a law of one part."""
    if len(pieces(term)) != 1 or len(linear(term)) != 1:
        return None
    (name,) = linear(term)
    return re.sub(rf"^{name} \* |^{name}$", "", term.law) or "1", term.constants[name]


def _spring(term: Term) -> str:
    if term.port != "force_toward":
        return ""
    at = f"({term.constants['at_x']:.2f}, {term.constants['at_y']:.2f})"
    found = _single(term)
    pulls = found is None or found[1] > 0.0
    kinds: Mapping[str, Callable[[bool], str]] = {
        "1": lambda p: f"a constant {'pull toward' if p else 'push away from'} {at}",
        "distance": lambda p: (
            f"a {'pull toward' if p else 'push away from'} {at} growing with distance: a spring"
        ),
    }
    if found and found[0] in kinds:
        return kinds[found[0]](pulls)
    if "positive(distance" in term.law:
        return f"a pull toward {at} beyond some distance: a tether"
    if "/ (distance" in term.law or "exp(-distance" in term.law:
        return (
            f"a {'pull toward' if pulls else 'push away from'} {at} that is felt near it: a magnet, or a bump"
        )
    return f"a {'pull toward' if pulls else 'push away from'} {at}"


def _lens(term: Term) -> str:
    """Name an error of the camera along the line to a point: a lens (Brown, Photogramm. Eng. 32 (1966) 444)."""
    if term.port != "pose_toward":
        return ""
    at, found = f"({term.constants['at_x']:.2f}, {term.constants['at_y']:.2f})", _single(term)
    if found and found[0] == "distance":
        return f"a camera whose picture is too {'small' if found[1] > 0.0 else 'large'}, about {at}"
    return f"a camera whose lens bends the picture, about {at}"


def _once_per_turn(term: Term) -> str:
    cycles = sorted(
        {
            round(v)
            for name, v in term.constants.items()
            if re.search(rf"(sin|cos)\({name} \* angle", term.law)
        }
    )
    if not cycles:
        return ""
    often = {1: "once", 2: "twice"}.get(cycles[0], f"{cycles[0]} times")
    size = sum(abs(term.constants[name]) ** 2 for name in linear(term)) ** 0.5
    if term.port == "rolling_radius" and cycles == [1]:
        return f"once per wheel turn: a wheel off its centre by {1e3 * size * 0.028:.1f} mm on 28 mm"
    if term.port == "rolling_radius" and cycles == [2]:
        return "twice per wheel turn: an oval wheel"
    if term.port == "encoder_reading":
        return f"{often} per turn: an encoder off its centre"
    return f"{often} per turn: {BY_PORT[term.port].title} that varies with the shaft's angle"


def _late(term: Term) -> str:
    """Name a delay: to first order, what is late is off by its rate of change times the delay."""
    found = _single(term)
    if found is None:
        return ""
    shape, value = found
    if term.port == "command" and shape == "(store - command)" and term.store == "command":
        late_s, what = value * term.store_s, "commands that act"
    elif (term.port, shape) in _RATES:
        late_s, what = -value, f"a {'colour sensor' if term.port == 'sensor_ahead' else 'camera'} that is"
    else:
        return ""
    return f"{what} {'late' if late_s > 0.0 else 'early'}, by about {1e3 * abs(late_s):.0f} ms"


def _ramped(term: Term) -> str:
    """Name a limit of how fast commands change: a store that moves toward them by so much at the most."""
    most = re.fullmatch(r"store \+ max\(-(\w+), min\((\w+), command - store\)\)", term.store)
    if not most:
        return ""
    return f"commands that ramp, at {100.0 * term.constants[most[1]] / term.store_s:.0f} % a second"


def _paused(term: Term) -> str:
    """Name a pause before a motor turns round: a part of the command is lost while a store still has the old sense."""
    found = _single(term)
    if found is None or (found[0], term.store) != ("command * positive(-store * command)", "sign(command)"):
        return ""
    pause_s = -found[1] * math.log(2.0) * term.store_s  # 1 - 2 exp(-t / store_s) changes its sign
    return f"a pause of about {1e3 * pause_s:.0f} ms before a motor turns round" if pause_s > 0.0 else ""


def _holding(term: Term) -> str:
    """Name motors that hold their angle at duty 0: a store follows the shaft while a motor is driven."""
    follows = re.fullmatch(r"store \+ \(angle - store\) \* positive\(abs\(command\) - \w+\)", term.store)
    held = re.fullmatch(r"\w+ \* \(store - angle\) \* positive\(\w+ - abs\(command\)\)", term.law)
    return "motors that hold the angle at which they were stopped" if follows and held else ""


def _wound_up(term: Term) -> str:
    """Name what grows with the angle turned since the start, which a store adds up."""
    if term.port != "yaw_moment" or term.store != "store + turn_rate":
        return ""
    found = _single(term)
    if found and found[1] < 0.0:
        return "a cable that winds up as the robot turns, and turns it back"
    return "a push that grows with turning"


def _stored(term: Term) -> str:
    if not term.store:
        return ""
    fills = "use" if re.search("command|current|draw", term.store) else "motion"
    what = "heat" if term.port != "supply_voltage" else "a battery that tires"
    return f"grows over the first {2.0 * term.store_s:.0f} s of {fills} and stays: {what}"


def _named(term: Term) -> str:
    found = _single(term)
    if found is None:
        return ""
    shape, value = found
    for known in _KNOWN:
        if term.port in known.ports and re.fullmatch(known.shape, shape):
            return known.positive if value > 0.0 else known.negative
    return ""


def _described(term: Term) -> str:
    depends = [_TITLES[name] for name in term.parsed.variables if name != "side"]
    always = ", opposite on the two sides" if "side" in term.parsed.variables else ", always the same"
    on = f" that depends on {' and '.join(depends)}" if depends else always
    return f"{BY_PORT[term.port].title}{on}{_where(term)}"
