"""Ports: the places where physics enters the one dynamics, and what a law written for one of them may look at.

A term (`gecar.world.terms`) is a law at a port. The tables here say what there is; `gecar.world.kernel.terms` computes
it. A port that has two sides takes one value for each wheel, worked out from that wheel's own variables; one that has
none takes one value, from the mean of both wheels' variables.
"""

from __future__ import annotations

from dataclasses import dataclass

N_TERMS = 4
"""Most terms a robot has."""
MOST_CONSTANTS = 6
MOST_TOKENS = 32
MOST_STORE_TOKENS = 16
# A term's row of numbers: port, which side (-1: both, 0: left, 1: right), how many tokens law and store have, the
# store's time constant [s], a point on the floor [m], whether the store's law looks at the store itself, constants,
# then the tokens themselves.
PORT, SIDE, LENGTH, STORE_LENGTH, STORE_S, AT_X, AT_Y, OF_ITSELF = range(8)
CONSTANTS = 8
LAW = CONSTANTS + MOST_CONSTANTS
STORE_LAW = LAW + MOST_TOKENS
TERM_WIDTH = STORE_LAW + MOST_STORE_TOKENS
STACK = 6
"""How many values a law may hold at once while it is worked out."""

BOTH, LEFT, RIGHT = -1, 0, 1
SIDES = {"both": BOTH, "left": LEFT, "right": RIGHT}


@dataclass(frozen=True)
class Variable:
    """A variable of laws.

    Attributes
    ----------
    id, unit
        Its name in laws, and its unit.
    title
        A few words a student understands.
    scale
        A usual size in that unit: searches take constants in units of it.
    of_wheel
        Whether each wheel has its own.
    """

    id: str
    unit: str
    title: str
    scale: float
    of_wheel: bool = False


VARIABLES: tuple[Variable, ...] = (
    Variable("time", "s", "time since the start", 10.0),
    Variable("command", "-", "the commanded duty", 1.0, True),
    Variable("voltage", "V", "the battery's voltage", 8.0),
    Variable("current", "A", "the motor's current", 0.5, True),
    Variable("angle", "rad", "the shaft's angle", 1.0, True),
    Variable("speed", "rad/s", "the shaft's speed", 10.0, True),
    Variable("load", "N", "the wheel's load", 3.0, True),
    Variable("slip", "m/s", "the tyre's slip", 0.05, True),
    Variable("other_angle", "rad", "the other shaft's angle", 1.0, True),
    Variable("other_speed", "rad/s", "the other shaft's speed", 10.0, True),
    Variable("other_command", "-", "the other motor's commanded duty", 1.0, True),
    Variable("side", "-", "-1 on the left, +1 on the right", 1.0, True),
    Variable("ahead", "m/s", "the speed ahead", 0.3),
    Variable("aside", "m/s", "the speed to the left", 0.1),
    Variable("turn_rate", "rad/s", "the turning rate", 2.0),
    Variable("x", "m", "the place along x", 1.0),
    Variable("y", "m", "the place along y", 1.0),
    Variable("heading", "rad", "the heading", 1.0),
    Variable("distance", "m", "the distance to a point on the floor", 1.0),
    Variable("reading", "%", "the colour sensor's reading", 50.0),
    Variable("store", "-", "the term's own store", 1.0, True),
    Variable("draw", "A", "the current both motors draw", 0.5),
)  # fmt: skip
VARIABLE = {variable.id: number for number, variable in enumerate(VARIABLES)}

_MOVING = tuple(v.id for v in VARIABLES if v.id not in ("distance", "reading"))
_SEEN = ("time", "x", "y", "heading", "ahead", "aside", "turn_rate")


@dataclass(frozen=True)
class Port:
    """A place where physics enters the dynamics.

    Attributes
    ----------
    id, unit
        Its name in robot files, and the unit of what a law there gives; "-": a share by which something grows.
    title
        What a law there adds, in a few words.
    of_wheel
        Whether each wheel has its own.
    worth
        What is much there, in that unit: searches begin with a hundredth of it.
    variables
        What laws there may look at.
    sensor
        Whose it is, where what is measured changes and not what the robot does: ``encoders``, ``gyro``, ``camera`` or
        ``colour``; "": the robot's own.
    on_bench
        Whether it acts on a motor whose wheel hangs in the air.
    """

    id: str
    unit: str
    title: str
    of_wheel: bool
    worth: float
    variables: tuple[str, ...] = _MOVING
    sensor: str = ""
    on_bench: bool = False

    @property
    def reads(self) -> bool:
        """Whether it is a sensor's."""
        return bool(self.sensor)


PORTS: tuple[Port, ...] = (
    Port("command", "-", "a change of the duty", True, 0.2, on_bench=True),
    Port("supply_voltage", "V", "a change of the battery's voltage", False, 1.0, on_bench=True),
    Port("motor_torque", "N m", "a torque on the motor's shaft", True, 0.1, on_bench=True),
    Port("gear_friction", "N m", "dry friction in the gears", True, 0.05, on_bench=True),
    Port("rolling_radius", "-", "a share of the wheel's rolling radius", True, 0.1),
    Port("wheel_load", "N", "a load on the wheel", True, 2.0),
    Port("tyre_grip", "-", "a share of the tyre's grip", True, 0.5),
    Port("force_ahead", "N", "a force along the robot", False, 1.0),
    Port("force_aside", "N", "a force to the robot's left", False, 1.0),
    Port("force_x", "N", "a force along x", False, 1.0),
    Port("force_y", "N", "a force along y", False, 1.0),
    Port("force_toward", "N", "a pull toward a point on the floor", False, 1.0, (*_MOVING, "distance")),
    Port("yaw_moment", "N m", "a turning moment on the body", False, 0.1),
    Port("gear_play", "rad", "play between the gears and the wheel", True, 0.1),
    Port("track_width", "-", "a share of the distance between the wheels", False, 0.1),
    Port("caster_friction", "-", "friction between caster and floor", False, 0.1),
    Port("encoder_reading", "rad", "an error of the encoder", True, 0.1, ("time", "angle", "speed", "side"),
         "encoders", True),
    Port("gyro_reading", "rad/s", "an error of the gyro", False, 0.2, _SEEN, "gyro"),
    Port("pose_x", "m", "an error of the camera along x", False, 0.05, _SEEN, "camera"),
    Port("pose_y", "m", "an error of the camera along y", False, 0.05, _SEEN, "camera"),
    Port("pose_heading", "rad", "an error of the camera's heading", False, 0.05, _SEEN, "camera"),
    Port("colour_reading", "%", "an error of the colour sensor", False, 10.0,
         ("time", "x", "y", "heading", "reading"), "colour"),
    Port("pose_toward", "m", "an error of the camera toward a point on the floor", False, 0.05, (*_SEEN, "distance"),
         "camera"),
    Port("sensor_ahead", "m", "a shift of the colour sensor to the front", False, 0.02, _SEEN, "colour"),
    Port("sensor_aside", "m", "a shift of the colour sensor to the left", False, 0.02, _SEEN, "colour"),
    Port("pose_turn", "rad", "a turn of the camera's picture", False, 0.05,
         (*_SEEN, "distance"), "camera"),
    Port("pose_late", "s", "how late the camera's poses are", False, 0.05, _SEEN, "camera"),
)  # fmt: skip
PORT_NUMBER = {port.id: number for number, port in enumerate(PORTS)}
AT_A_POINT = ("force_toward", "pose_toward", "pose_turn")
"""Ports of laws that need a point on the floor."""
BY_PORT = {port.id: port for port in PORTS}

# Tokens: a constant's number, then variables, then operators.
FIRST_VARIABLE = 50
FIRST_OPERATOR = 100
OPERATORS = (
    "+", "-", "*", "/", "min", "max",
    "negative", "abs", "sign", "square", "sqrt", "exp", "sin", "cos", "tanh", "positive", "ramp",
)  # fmt: skip
"""Those of two values, then those of one; above 0 ``positive`` is 1 and ``ramp`` the value itself, else both are 0."""
OF_TWO = 6
OPERATOR = {name: FIRST_OPERATOR + number for number, name in enumerate(OPERATORS)}
FUNCTIONS = ("min", "max", "abs", "sign", "square", "sqrt", "exp", "sin", "cos", "tanh", "positive", "ramp")
