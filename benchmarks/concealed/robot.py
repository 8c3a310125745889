"""The nominal robot, written down a second time, and what may be concealed in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

# The numbers of the nominal EV3 robot that recordings assume. Copied by hand, so that no code has to be shared.
MASS = 0.75  # kg, everything
YAW_INERTIA = 0.0040  # kg m^2, everything, about the centre of mass
CASTER_AHEAD = -0.085  # m
TRACK_WIDTH = 0.120  # m
WHEEL_RADIUS = 0.028  # m
TORQUE_CONSTANT = 0.2746  # N m / A
BACK_EMF_CONSTANT = 0.4731  # V s / rad
RESISTANCE = 5.50  # ohm
SHAFT_INERTIA = 0.00248  # kg m^2
SUPPLY = 8.67  # V
DUTY_CAP = 0.80
KNOT_S = 0.5  # s between two knots of a drive, or of a camera, that wanders
GRAVITY = 9.81  # m / s^2

# Not in the nominal robot's file, and hardly felt: a 3D robot needs them, a planar one does not.
WHEEL_MASS = 0.02  # kg each; a LEGO 56 x 28 mm wheel with its axle
CASTER_RADIUS = 0.010  # m
CHASSIS_ROLL_INERTIA = 0.0015  # kg m^2
CHASSIS_PITCH_INERTIA = 0.0030  # kg m^2


@dataclass(frozen=True)
class Base:
    """The numbers of a robot that its file states and no effect changes, in SI units; default: the EV3."""

    name: str = "ev3"
    mass: float = MASS
    yaw_inertia: float = YAW_INERTIA
    caster_ahead: float = CASTER_AHEAD
    track_width: float = TRACK_WIDTH
    wheel_radius: float = WHEEL_RADIUS
    torque_constant: float = TORQUE_CONSTANT
    back_emf_constant: float = BACK_EMF_CONSTANT
    resistance: float = RESISTANCE
    shaft_inertia: float = SHAFT_INERTIA
    supply: float = SUPPLY


EV3 = Base()
# The 81.6 mm wheel (LEGO 2903) on a wide frame; motors and battery are the EV3's.
LARGE = Base("large", mass=0.90, yaw_inertia=0.0060, track_width=0.160, wheel_radius=0.0408)
# SPIKE's large angular motor runs free at 175 rpm and stalls at 0.25 N m with 7.2 V (LEGO's fact sheet 45602).
SPIKE = Base(
    "spike", mass=0.55, yaw_inertia=0.0026, track_width=0.112, torque_constant=0.235, back_emf_constant=0.385,
    resistance=6.5, shaft_inertia=0.0012, supply=7.6,
)  # fmt: skip
BASES = {base.name: base for base in (EV3, LARGE, SPIKE)}


@dataclass(frozen=True)
class Concealed:
    """What one robot hides. Every default is neutral: the nominal robot hides nothing.

    Catalogue effects come first, then physics that no row of the catalogue describes. SI units, except where a
    name ends in ``_pct`` or ``_deg``. Lengths and angles of the floor are in the course's frame. ``base`` is no
    secret: the recordings' robot file states it.
    """

    base: Base = EV3

    coulomb_friction: float = 0.0165  # N m
    viscous_friction: float = 0.0  # N m s / rad
    static_friction: float = 0.0  # N m above Coulomb friction
    stribeck_speed: float = 1.0  # rad / s
    friction_ratio: float = 0.0  # forward friction x (1 + ratio), backward x (1 - ratio)
    direction_gain: float = 0.0  # forward drive x (1 + gain), backward x (1 - gain)
    backlash_deg: float = 0.0  # whole play between motor and wheel
    dead_band_pct: float = 0.0
    dead_band_is_threshold: bool = (
        False  # False: dead zone, the output starts at 0; True: it starts at the band
    )
    inertia_scale: float = 1.0
    actuation_delay: float = 0.0  # s
    command_slew: float = math.inf  # % / s
    gain_difference: float = 0.0  # right minus left, of the duty's voltage
    supply_scale: float = 1.0
    battery_resistance: float = 0.0  # ohm
    battery_drain: float = 0.0  # V / s
    ripple_torque: float = 0.0  # N m
    ripple_cycles: int = 1  # per turn of the shaft
    ripple_phases: tuple[float, float] = (0.0, 0.0)  # rad, left and right
    speed_limit: float = math.inf  # rad / s
    radius_scale: float = 1.0
    radius_difference: float = 0.0  # right minus left, over the mean
    track_scale: float = 1.0
    yaw_inertia_scale: float = 1.0
    tyre_friction: float = 0.9
    patch: tuple[float, float, float, float] | None = None  # x, y, radius [m], coefficient
    caster_friction: float = 0.0
    rolling_resistance: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)  # rad, gravity's component along +x and +y
    com_height: float = 0.050  # m
    com_ahead: float = -0.0322  # m
    sensor_lag: float = 0.0  # s
    sensor_delay: float = 0.0  # s
    sensor_gain: float = 1.0
    sensor_offset_pct: float = 0.0
    sensor_ahead: float = 0.081  # m
    sensor_left: float = 0.0  # m
    spot_diameter: float = 0.008  # m
    line_shift: tuple[float, float, float] = (
        0.0,
        0.0,
        0.0,
    )  # dx, dy [m], angle [rad] about the course's origin
    clock_skew: float = 0.0  # log time = true time x (1 + skew)
    pose_delay: float = 0.0  # s

    # Outside the catalogue.
    off_centre: tuple[float, float, float] | None = None  # m, phases left and right [rad]
    oval: tuple[float, float, float] | None = None  # half the difference of the half axes [m], phases [rad]
    tether: tuple[float, float, float] | None = None  # x, y [m], stiffness [N/m]
    magnet: tuple[float, float, float, float] | None = None  # x, y, core radius [m], greatest pull [N]
    waves: tuple[float, float, float, float] | None = None  # slope [rad], wave length [m], phases x, y [rad]
    gusts: tuple[tuple[float, float, float, float], ...] = ()  # start, length [s], force x, y [N]
    air_drag: float = 0.0  # N s^2 / m^2
    bump: tuple[float, float, float] | None = None  # height [m], x [m], angle from +y [rad]
    lens: float = 0.0  # 1/m^2, radial distortion of the camera about the field's centre
    ambient: tuple[float, float] | None = None  # share of light lost, heading it comes from [rad]
    pose_drift_deg: float = 0.0  # deg / s of heading in the pose, and of the path with it
    dropouts: tuple[tuple[float, float], ...] = ()  # start, length [s]: no command reaches the motors

    # Outside the catalogue, from the second set of kinds. Sides: 0 left, 1 right.
    heat: tuple[float, float, int] | None = None  # share the resistance grows by, time constant [s], side
    loosening: tuple[float, int] | None = None  # play that grows between motor and wheel [rad/s], side
    duty_step_pct: float = 0.0  # the firmware rounds duties to multiples of this
    shared_drop: float = 0.0  # share of the voltage lost while both motors are driven
    current_limit: float = math.inf  # A, of each motor's driver
    tooth: tuple[float, float, int, float] | None = None  # torque [N m], width [rad], side, phase [rad]
    rubber_band: tuple[float, int] | None = None  # torque per angle wound up [N m/rad], side
    coasting: float = 0.0  # share of the braking that is missing at duty 0
    dust: tuple[float, float] | None = None  # share of grip lost at last, way it takes [m]
    hop: tuple[float, float, int] | None = None  # share of grip lost half of each turn, from [rad/s], side
    pile: tuple[float, float] | None = None  # drag against the pile [N], heading it points to [rad]
    yaw_pull: float = 0.0  # N m on the chassis, counter-clockwise
    swivel: tuple[float, float] | None = None  # sideways force of a castor wheel [N], trail [m]
    camera_bump: tuple[float, float, float, float] | None = None  # time [s], shift x, y [m], turn [rad]
    flicker: tuple[float, float, float] | None = None  # share, Hz, phase [rad]
    sway: tuple[float, float] | None = None  # Hz and damping ratio of the sensor's mount

    # Outside the catalogue, from the third set of kinds.
    axle_rub: float = 0.0  # dry friction between the two axles [N m]
    strip: tuple[float, float, float, float] | None = None  # brake [N m], x, width [m], angle from +y [rad]
    reversal_pause: float = 0.0  # s without drive before a motor turns the other way
    toe: tuple[float, int] | None = None  # a wheel's heading against the chassis' [rad], side
    trailer: tuple[float, float] | None = None  # drag of a weight on a string [N], length of the string [m]
    twist: float = 0.0  # torque per turned heading of a cable from above [N m/rad]
    keeper: tuple[float, float] | None = (
        None  # integral of the speed's error: rate [1/s], most share of supply
    )
    wander: tuple[int, tuple[float, ...]] | None = None  # side, change of its drive at every half second
    shadow: tuple[float, float, float, float] | None = (
        None  # share of light lost, x, blur [m], way into it [rad]
    )
    marker: tuple[float, float] = (0.0, 0.0)  # where the camera's marker sits, ahead and left of the axle [m]

    # Outside the catalogue, from the fourth set of kinds.
    gear_loss: tuple[float, int] | None = None  # share of a motor's torque that its gears lose, side
    # Torque of stiff grease [N m], time in which it stiffens [s], turn that works it soft [rad], side.
    grease: tuple[float, float, float, int] | None = None
    # Torque per acceleration sideways [N m s^2/m], which way the robot turns then (1: left), side.
    frame_rub: tuple[float, float, int] | None = None
    hair: tuple[float, float] | None = None  # greatest drag at the caster [N], way ahead it takes [m]
    slow_sag: tuple[float, float] | None = None  # resistance of the battery that acts late [ohm], time [s]
    holding: float = 0.0  # share of the supply per angle from where a motor was stopped [1/rad]
    latch: tuple[float, float] | None = (
        None  # period of looking for commands [s], share of one gone at the start
    )
    second_spot: tuple[float, float, float] | None = None  # share of the light, ahead, left of the first [m]
    auto_gain: tuple[float, float] | None = None  # exponent of the mean reading, time of the mean [s]
    keystone: tuple[float, float] = (0.0, 0.0)  # how the camera's scale falls along x and y [1/m]
    frame_rate: float = 0.0  # frames come faster than they are counted for by this share
    grooves: tuple[float, float] | None = None  # drag on the caster across them [N], their heading [rad]

    # Outside the catalogue, from the fifth set of kinds.
    hum: tuple[float, float, float, int] | None = (
        None  # torque [N m] at a speed, half width [rad/s] of it, side
    )
    scrub: float = 0.0  # dry friction of the tyres' width against turning [N m]
    # Share of a motor's resistance that a fuse adds at its rated current, this current [A], time of warming [s].
    fuse: tuple[float, float, float] | None = None
    throttle: tuple[float, float] | None = None  # share taken off a duty that is held, from when on [s]
    # Share of the battery's voltage lost, acceleration sideways that takes half of it [m/s^2], to which way (1: left).
    loose_cell: tuple[float, float, float] | None = None
    # Place of a fan [m], its push 1 m away [N], period in which it swings [s], phase [rad].
    fan: tuple[float, float, float, float, float] | None = None
    # Slope [rad], place on the hinge, x [m], way of tipping [rad], from how far beyond the hinge on it tips [m].
    rocking: tuple[float, float, float, float] | None = None
    patches: tuple[float, float, float] | None = None  # greatest brake [N m], size of each [m], which pattern
    warming: tuple[float, float] | None = None  # share of light a warm lamp lacks, time of warming [s]
    faded: tuple[float, float, float, float] | None = None  # share of ink lost, x, y, radius [m]
    shake: tuple[
        tuple[float, float, float], ...
    ] = ()  # camera's shift [m] and turn [rad] at every half second
    backlog: tuple[float, float, float] | None = (
        None  # most that poses lag [s], period [s], share of one gone
    )

    # Outside the catalogue, from the sixth set of kinds.
    expo: float = 0.0  # share of a duty that grows with its cube; the greatest duty stays as it is
    # Current that a motor's driver cuts off [A], for how long it bears that, and for how long it is off [s].
    cut_out: tuple[float, float, float] | None = None
    clutch: tuple[float, int] | None = None  # torque from which a wheel slips on its axle [N m], side
    # Share of the battery's voltage that another load takes, its period [s], share of it that is on, and of one gone.
    pulses: tuple[float, float, float, float] | None = None
    fin: tuple[float, float] | None = (
        None  # greatest torque of a draught [N m], heading it turns the robot to [rad]
    )
    nap: tuple[float, float] | None = None  # share of its way that a robot is carried aside, which way [rad]
    wobble: tuple[float, float, float, float] | None = (
        None  # of the line: size, wave length [m], phases x, y [rad]
    )
    seams: tuple[float, float] | None = None  # share of light lost where tiles meet, half width [m]
    nod: tuple[float, float] | None = (
        None  # share of light lost per acceleration ahead [s^2/m], settling time [s]
    )
    aspect: float = 0.0  # the camera's x is too long by this share, its y too short
    compass: tuple[float, int, float] | None = (
        None  # deviation of the heading [rad], periods a turn, phase [rad]
    )

    # Outside the catalogue, from the seventh set of kinds.
    overrun: float = 0.0  # share of the braking that is missing where a motor outruns the duty it is given
    motor_sync: float = 0.0  # share of the supply per angle that one motor leads by, given alike [1/rad]
    sticky_pct: float = 0.0  # a new duty, other than 0, acts only if it is at least so far from the last [%]
    duty_budget: float = math.inf  # both duties are scaled so that their sizes add up to no more than this
    # Drag of a brush on the floor [N], and where it hangs, ahead and left of the axle's centre [m].
    brush: tuple[float, float, float] | None = None
    curl: tuple[float, float] | None = None  # slope of the mat at its edges [rad], from how far inside on [m]
    leak: tuple[float, float, int] | None = None  # share of a wheel's radius lost at last, time [s], side
    turret: tuple[float, float, float] | None = None  # torque of its swings [N m], period [s], phase [rad]
    line_wider: float = 0.0  # m, more than the line is wide as drawn
    speed_lift: float = 0.0  # share of light lost per speed ahead or back [s/m]
    # Where two cameras' pictures meet, x [m]; how the second one's is off: shift x, y [m], turn [rad], scale.
    stitch: tuple[float, float, float, float, float] | None = None
    predictor: tuple[float, float] | None = (
        None  # for how long poses are extrapolated [s], by a mean over [s]
    )

    # What every robot has a little of (background.py). The scales act only in worlds that model the thing.
    inductance_scale: float = 1.0
    presliding_scale: float = 1.0  # of the gear's deflection before it slides
    creep_scale: float = 1.0  # of the tyres' slip per force
    encoder_wave_deg: tuple[float, float, float] | None = None  # once a turn: amplitude, phases [rad]
    camera_turn_deg: float = 0.0  # the camera's frame against the course's
    gyro_scale: float = 1.0
    gyro_bias_dps: float = 0.0
    gamma: float = 1.0  # light reads 100 x (share of white) ** gamma
    gloss: tuple[float, float, float, float] | None = None  # share, wave length [m], phases x, y [rad]


NEUTRAL = Concealed()
