"""The catalogue: physics a simulation may have left out, each a group of parameters with a neutral value.

Every parameter is a field of the kernel's `PHYSICS` record. At its neutral value an effect vanishes bit for bit, so
the kernels hold all effects always; identification frees some and pins the rest, and what it finds is a robot.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gecar.world.ports import N_TERMS, TERM_WIDTH

DEG = math.pi / 180.0

DUTY_LEVELS, SHAFT_CYCLES = "duty levels", "shaft cycles"  # scans that fits treat apart


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    Attributes
    ----------
    field
        Its field in the `PHYSICS` record (SI).
    label
        Its name with unit in robot files and verdicts (``angle_deg``).
    unit
        The unit it is shown in.
    low, high
        Bounds, in that unit.
    neutral
        Value at which it vanishes, in that unit; None: the robot's own constant.
    worthwhile
        Smallest change from neutral worth a name, in that unit; 0 where the parameter only shapes the effect.
    si
        SI value of one unit.
    start
        Where identification starts from, in that unit, when the neutral value itself says nothing.
    shape_step
        For a parameter that only shapes the effect: a change that is visible, in that unit.
    by_ratio
        Whether it acts by its ratio, so that fits run in its logarithm.
    search_spread
        Standard deviation of a derivative-free search, in coordinates.
    model_error, model_error_steps
        How far a fitted value may be off because the simulation is not reality: as a share of its size, and in
        sizes worth a name, or changes of shape that are visible. Measured against a 3D engine: gears that give add to
        their play 0.3 to 0.8 degrees there. How tyres slip as load moves differs from engine to engine by 5 mm of the
        centre of mass's height, and grip found in Bullet's recordings is off by 0.03 to 0.04. A path is off by 1 mm or
        so where a line lies, along which a robot goes in 4 ms.
    differs
        Standard deviation over motors of one kind and batteries, in that unit; 0: no more than a name is worth.
    smooth
        Whether small changes from neutral act in proportion, to both sides; others are no part of the discrepancy.
    """

    field: str
    label: str
    unit: str
    low: float
    high: float
    neutral: float | None
    worthwhile: float
    si: float = 1.0
    start: float | None = None
    shape_step: float = 0.0
    by_ratio: bool = False
    search_spread: float = 1.0
    model_error: float = 0.02
    model_error_steps: float = 0.15
    differs: float = 0.0
    smooth: bool = True


@dataclass(frozen=True)
class Search:
    """How a parameter space on which derivatives mislead is searched.

    Attributes
    ----------
    apart
        How far starting values are from each other [coordinates].
    restarts
        How many starting values there are at most.
    finalists
        How many of them are searched on.
    generations, trials_factor
        For so many generations of so many times the usual trials.
    """

    apart: float = 5.5
    restarts: int = 6
    finalists: int = 2
    generations: int = 22
    trials_factor: int = 1


@dataclass(frozen=True)
class Effect:
    """A named group of parameters.

    Attributes
    ----------
    id
        The identifier reports and robot files use.
    title
        A few words a student understands.
    parameters
        The first one is the effect's size: at its neutral value the effect vanishes whatever the others are.
    channels
        Where it shows: ``motor`` (encoders), ``pose``, ``sensor`` (reflection), ``clock``.
    signature
        In what motion it shows.
    source
        Where the law and the bounds come from.
    needs
        What recordings must have to show it: ``floor``, ``bench``, ``pose``, ``two motors``, ``both directions``,
        ``full duty``.
    starts
        Values identification starts from, by label; () where they are scanned, or a few sizes on both sides of
        neutral will do.
    scan
        How starting values are scanned, a name in `gecar.reality.fitting.initial_values`.
    search
        Set where derivatives mislead: slip, play, stiction, thresholds, an edge on the floor, waves.
    differentiable
        Whether derivatives at a fit say what other recordings would have made of it.
    worth
        The sizes, by label, all of which a find must reach to be worth a name: one set of them is enough; () where
        the parameters' own ``worthwhile`` decide.
    """

    id: str
    title: str
    parameters: tuple[Parameter, ...]
    channels: tuple[str, ...]
    signature: str
    source: str
    needs: tuple[str, ...] = ()
    starts: tuple[Mapping[str, float], ...] = ()
    scan: str = ""
    search: Search | None = None
    differentiable: bool = True
    worth: tuple[Mapping[str, float], ...] = ()

    @property
    def of_sensor(self) -> bool:
        """Whether it changes what the colour sensor reads, and nothing else."""
        return self.channels == ("sensor",)

    @property
    def at_a_place(self) -> bool:
        """Whether it acts at a place on the floor, which a recording may not pass."""
        return self.scan == "floor cells"


_P = Parameter


def _values(label: str, *sizes: float) -> tuple[dict[str, float], ...]:
    return tuple({label: size} for size in sizes)


_SHIFTS = tuple(
    {"dx_m": dx, "dy_m": dy, "angle_rad": angle}
    for dx, dy, angle in itertools.product(
        (-0.024, -0.012, 0.0, 0.012, 0.024), (-0.024, -0.012, 0.0, 0.012, 0.024), (-0.012, 0.0, 0.012)
    )
)
_DRAGS = tuple(
    {"force_n": 0.15, "left_m": left, "off_axle_m": off}
    for left, off in ((0.06, 0.02), (-0.06, 0.02), (0.03, 0.06), (-0.03, 0.06), (0.0, 0.02), (0.0, 0.08))
)
_LAW_MOTOR = (
    "brushed DC motor with gearbox: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994"
)
_EV3_FITS = "step fits of five EV3 motors: Coulomb 13-50 deg/s equivalent, forward and backward 5 % apart"
_TYRE = "Coulomb friction circle; Pacejka, Tire and Vehicle Dynamics, ch. 1"
_GEOMETRY = "odometry error model; Borenstein and Feng, IEEE T-RA 12(6), 1996"
_SENSOR = "first-order sensor; white 50-98 %, black 2-10 % on real EV3 colour sensors"

CATALOGUE: tuple[Effect, ...] = (
    Effect("coulomb_friction", "dry friction in the gearbox",
           (_P("coulomb_friction", "torque_nm", "N m", 0.0, 0.12, None, 0.002, differs=0.006),),
           ("motor",), "low speed, reversals, small duty", _LAW_MOTOR),
    Effect("viscous_friction", "friction growing with speed",
           (_P("viscous_friction", "coefficient_nms", "N m s/rad", 0.0, 0.03, 0.0, 0.0004, differs=0.002),),
           ("motor",), "high speed", _LAW_MOTOR),
    Effect("static_friction", "breakaway friction above sliding friction",
           (_P("static_friction", "extra_torque_nm", "N m", 0.0, 0.12, 0.0, 0.003),
            _P("stribeck_speed", "speed_rad_s", "rad/s", 0.05, 8.0, 1.0, 0.0, by_ratio=True, search_spread=0.7)),
           ("motor",), "from rest; small duty never moves", _LAW_MOTOR + " (Stribeck curve, exponent 2)",
           scan="slow speeds", search=Search()),
    Effect("friction_asymmetry", "friction or gain differs forward and backward",
           (_P("friction_ratio", "friction_ratio", "-", -0.9, 0.9, 0.0, 0.08),
            _P("direction_gain", "gain_ratio", "-", -0.3, 0.3, 0.0, 0.005)),
           ("motor",), "sign of the speed", _EV3_FITS,
           needs=("both directions",)),
    Effect("viscous_asymmetry", "friction grows with speed more in one direction",
           (_P("viscous_difference", "forward_minus_backward_nms", "N m s/rad", -0.03, 0.03, 0.0, 0.0004),),
           ("motor",), "high speed, by its sign", "torque = -difference / 2 x |speed|; the EMPS drive has it",
           needs=("both directions",)),
    Effect("constant_torque", "a constant torque acts on the shafts",
           (_P("constant_torque", "torque_nm", "N m", -0.12, 0.12, 0.0, 0.002),),
           ("motor",), "both directions, at any speed", "offset of the EMPS drive: Janot, Gautier, Brunot, 2019",
           needs=("bench", "both directions")),
    Effect("backlash", "backlash in the gears",
           (_P("backlash", "angle_deg", "deg", 0.0, 25.0, 0.0, 0.8, DEG, model_error=0.12, model_error_steps=0.6),),
           ("motor", "pose"), "reversals: the encoder turns, the robot waits",
           "dead-zone model of play: Nordin and Gutman, Automatica 38(10), 2002; EV3 gears: 3 deg (Benedettelli)",
           needs=("floor",), starts=_values("angle_deg", 2.0, 5.0, 10.0), search=Search()),
    Effect("dead_band", "small duty gives no torque",
           (_P("dead_band", "duty_pct", "%", 0.0, 40.0, 0.0, 1.0, 0.01, model_error=0.05),
            _P("dead_band_offset", "offset_share", "-", 0.0, 1.0, 1.0, 0.0, shape_step=0.1)),
           ("motor",), "small duty", "dead zone of PWM drives; one EV3 motor did not move at 5 % duty",
           scan=DUTY_LEVELS, search=Search(),
           # friction holds 4 % of an EV3's duty anyway: a threshold without an offset must exceed it
           worth=({"duty_pct": 1.0, "offset_share": 0.3}, {"duty_pct": 5.0})),
    Effect("dead_band_asymmetry", "the small duty that gives no torque differs by motor or direction",
           (_P("dead_band_right", "right_minus_left_pct", "%", -40.0, 40.0, 0.0, 2.0, 0.01, smooth=False),
            _P("dead_band_forward", "forward_minus_backward_pct", "%", -40.0, 40.0, 0.0, 2.0, 0.01, smooth=False)),
           ("motor",), "small duty, by motor or sign", "a micromouse: 26-29 % of duty and 16-20 %",
           needs=("both directions",)),
    Effect("duty_curve", "the motor driver's voltage is not proportional to duty",
           (_P("duty_bulge", "bulge", "-", -0.6, 6.0, 0.0, 0.02),),
           ("motor",), "duty between 0 and 100 %",
           "duty x (1 + bulge) / (1 + bulge |duty|), empirical: bridges in which current decays fast"),
    Effect("full_duty", "full duty gives more than the duties below it would say",
           (_P("full_duty_gain", "gain", "-", -0.1, 0.2, 0.0, 0.005),),
           ("motor",), "duty of 100 %", "a bridge that need not switch loses no dead time; two EV3 motors: 1 % faster",
           needs=("full duty",)),
    Effect("rotor_inertia", "the motors are slower or quicker to speed up",
           (_P("inertia_scale", "scale", "-", 0.2, 4.0, 1.0, 0.05, differs=0.15),),
           ("motor",), "steps", "rests on an estimated acceleration of the EV3 motor: calibrate it"),
    Effect("actuation_delay", "commands act late",
           (_P("actuation_delay", "time_s", "s", 0.0, 0.25, 0.0, 0.005),),
           ("motor",), "every command change", "pure delay between command and motor",
           starts=_values("time_s", 0.01, 0.03, 0.08)),
    Effect("start_latency", "the motors first answer some time after the start",
           (_P("start_latency", "time_s", "s", 0.0, 0.25, 0.0, 0.005),),
           ("motor",), "the first moments, from rest", "EV3 step logs: 25-30 ms before motion, once",
           starts=_values("time_s", 0.02, 0.05)),
    Effect("command_slew", "commands ramp instead of stepping",
           (_P("command_slew", "rate_pct_s", "%/s", 30.0, math.inf, math.inf, 0.0, 0.01, 500.0),),
           ("motor",), "big steps", "rate limiter on duty",
           starts=_values("rate_pct_s", 6000.0, 1500.0, 600.0, 250.0, 100.0)),
    Effect("current_limit", "the motor driver limits the current",
           (_P("current_limit", "current_a", "A", 0.05, math.inf, math.inf, 0.0, 1.0, 1.0),),
           ("motor",), "from rest, reversals, stall", "current chopping of PWM drivers",
           scan="shares of stall current"),
    Effect("motor_gain_asymmetry", "one motor is stronger than the other",
           (_P("gain_difference", "right_minus_left", "-", -0.4, 0.4, 0.0, 0.003),),
           ("motor",), "straight runs curve; the encoders show it", _EV3_FITS,
           needs=("two motors",)),
    Effect("supply_voltage", "the battery's level differs",
           (_P("supply_scale", "scale", "-", 0.5, 1.3, 1.0, 0.005, differs=0.08),),
           ("motor",), "all speeds", "6.0-9.0 V over an EV3 battery's charge; bounds: the robot's battery"),
    Effect("battery_resistance", "the battery's voltage sags under load",
           (_P("battery_resistance", "resistance_ohm", "ohm", 0.0, 4.0, None, 0.1, model_error=0.05),),
           ("motor",), "acceleration, stall; both motors couple", "battery as a source behind a resistance"),
    Effect("battery_drain", "the battery's voltage falls over time",
           (_P("battery_drain", "rate_v_s", "V/s", -0.02, 0.3, 0.0, 0.004),),
           ("motor",), "late against early", "linear fall of open-circuit voltage"),
    Effect("torque_ripple", "torque varies with the shaft's angle",
           (_P("ripple_amplitude", "amplitude_nm", "N m", 0.0, 0.1, 0.0, 0.003),
            # over 100 rad of shaft, 0.01 of a cycle is 1 rad of phase
            _P("ripple_cycles", "cycles_per_rev", "1/rev", 1.0, 48.0, 1.0, 0.0, shape_step=0.01),
            _P("ripple_phase", "phase_rad", "rad", -math.pi, math.pi, 0.0, 0.0, shape_step=0.3),
            _P("ripple_lead", "right_lead_rad", "rad", -math.pi, math.pi, 0.0, 0.0, shape_step=0.3, search_spread=0.2)),
           ("motor",), "periodic in the shaft's angle", "cogging and gear mesh, first harmonic",
           scan=SHAFT_CYCLES, search=Search()),
    Effect("speed_limit", "firmware caps the speed",
           (_P("speed_limit", "speed_rad_s", "rad/s", 1.0, math.inf, math.inf, 0.0, 1.0, 11.0),),
           ("motor",), "high speed", "Motor.run caps the EV3 large motor at 800 deg/s",
           scan="shares of top speed"),
    Effect("wheel_radius", "the wheels' rolling radius differs",
           (_P("radius_scale", "scale", "-", 0.7, 1.3, 1.0, 0.006),),
           ("pose",), "pose against encoders, straight", _GEOMETRY,
           needs=("floor",)),
    Effect("wheel_radius_difference", "one wheel is larger",
           (_P("radius_difference", "right_minus_left", "-", -0.2, 0.2, 0.0, 0.003),),
           ("pose",), "the path curves while the encoders agree", _GEOMETRY,
           needs=("floor",)),
    Effect("track_width", "the effective track differs",
           (_P("track_scale", "scale", "-", 0.7, 1.4, 1.0, 0.006),),
           ("pose",), "pose against encoders, turning", _GEOMETRY,
           needs=("floor",)),
    Effect("yaw_inertia", "the robot is harder or easier to turn",
           (_P("yaw_inertia_scale", "scale", "-", 0.3, 5.0, 1.0, 0.15, model_error=0.05),),
           ("motor", "pose"), "starts and stops of turns",
           "moment of inertia about the vertical through the centre of mass; no builder measures it",
           needs=("floor",)),
    Effect("tyre_friction", "the tyres grip less, or more",
           (_P("tyre_friction", "coefficient", "-", 0.03, 2.0, None, 0.15, model_error_steps=0.35),),
           ("pose",), "hard acceleration, fast turns", _TYRE,
           needs=("floor",), starts=_values("coefficient", 0.6, 0.35, 0.15, 1.2), search=Search()),
    Effect("slippery_patch", "grip is lost in one place on the floor",
           (_P("patch_radius", "radius_m", "m", 0.0, 0.6, 0.0, 0.05, search_spread=1.5),
            _P("patch_x", "x_m", "m", -5.0, 5.0, 0.0, 0.0, shape_step=0.03, search_spread=2.0),
            _P("patch_y", "y_m", "m", -5.0, 5.0, 0.0, 0.0, shape_step=0.03, search_spread=2.0),
            _P("patch_friction", "coefficient", "-", 0.01, 0.8, 0.1, 0.0, by_ratio=True, search_spread=0.5,
               model_error=0.05)),
           ("pose",), "a place on the map", _TYRE,
           needs=("floor", "pose"), scan="floor cells", differentiable=False,
           # the edge makes many valleys close together: with fewer finalists three seeds ended in three places
           search=Search(apart=1.5, restarts=12, finalists=6, generations=40, trials_factor=3)),
    Effect("caster_drag", "the caster drags",
           (_P("caster_friction", "coefficient", "-", 0.0, 1.5, 0.0, 0.05),),
           ("pose", "motor"), "constant drag, turning", "Coulomb friction at the caster's contact",
           needs=("floor",)),
    Effect("point_drag", "something on the robot drags on the floor",
           (_P("drag_force", "force_n", "N", 0.0, 3.0, 0.0, 0.03),
            _P("drag_left", "left_m", "m", -0.2, 0.2, 0.0, 0.0, shape_step=0.01),
            # ahead of the axle or behind it: where wheels hold, what drags there does the same; told 7 mm too small
            # of a weak drag in three worlds, whose wheels and casters scrub in turns
            _P("drag_off_axle", "off_axle_m", "m", 0.0, 0.2, 0.0, 0.0, shape_step=0.01, model_error_steps=0.7)),
           ("pose", "motor"), "constant drag, and a turn to one side",
           "Coulomb friction at a point of the robot, as of a cable or a tag that hangs down",
           needs=("floor",), starts=_DRAGS),
    Effect("rolling_resistance", "the tyres resist rolling",
           (_P("rolling_resistance", "coefficient", "-", 0.0, 0.3, 0.0, 0.01),),
           ("motor", "pose"), "constant drag", "torque = coefficient x load x radius",
           needs=("floor",)),
    Effect("floor_tilt", "the floor is not level",
           (_P("tilt_x", "x_rad", "rad", -0.25, 0.25, 0.0, 0.0025),
            _P("tilt_y", "y_rad", "rad", -0.25, 0.25, 0.0, 0.0025)),
           ("pose", "motor"), "depends on the heading", "gravity's component along the floor, positive along +x, +y",
           needs=("floor",)),
    Effect("load_transfer", "the centre of mass is higher or lower",
           (_P("com_height", "height_m", "m", 0.0, 0.15, None, 0.01, model_error_steps=0.6),),
           ("pose",), "hard acceleration with slip", "quasi-static load transfer",
           needs=("floor",)),
    Effect("com_offset", "the centre of mass is further ahead or behind",
           # a castor wheel instead of a ball looked like 0.9 mm, and scales and a ruler say no more than 1 to 2 mm
           (_P("com_ahead", "ahead_m", "m", -0.084, 0.0, None, 0.004, model_error_steps=0.5),),
           ("pose",), "turns", "rigid body on two wheels and a caster",
           needs=("floor",)),
    Effect("sensor_lag", "the colour sensor answers gradually",
           (_P("sensor_lag", "time_constant_s", "s", 0.0, 0.3, 0.0, 0.005),),
           ("sensor",), "line edges", _SENSOR,
           starts=_values("time_constant_s", 0.01, 0.04, 0.1)),
    Effect("sensor_delay", "the colour sensor answers late",
           (_P("sensor_delay", "time_s", "s", 0.0, 0.25, 0.0, 0.005, model_error_steps=0.8),),
           ("sensor",), "line edges", _SENSOR,
           starts=_values("time_s", 0.01, 0.04, 0.1)),
    Effect("sensor_gain", "white and black read otherwise",
           (_P("sensor_gain", "gain", "-", 0.2, 2.0, 1.0, 0.02),
            _P("sensor_offset", "offset_pct", "%", -40.0, 40.0, 0.0, 1.0)),
           ("sensor",), "level on white and black", _SENSOR),
    Effect("sensor_position", "the sensor is mounted elsewhere",
           # a camera, its mark and a course are set up no better
           (_P("sensor_ahead", "ahead_m", "m", 0.0, 0.16, None, 0.003),
            _P("sensor_left", "left_m", "m", -0.08, 0.08, None, 0.003)),
           ("sensor",), "edges come early or late", _SENSOR,
           scan="around the mount"),
    Effect("spot_size", "the sensor sees a larger or smaller spot",
           (_P("spot_diameter", "diameter_m", "m", 0.001, 0.05, None, 0.002),),
           ("sensor",), "width of edges", _SENSOR),
    Effect("line_shift", "the course lies elsewhere than drawn",
           (_P("line_dx", "dx_m", "m", -0.12, 0.12, 0.0, 0.005),
            _P("line_dy", "dy_m", "m", -0.12, 0.12, 0.0, 0.005),
            _P("line_angle", "angle_rad", "rad", -0.1, 0.1, 0.0, 0.005)),
           ("sensor",), "a place on the map", "rigid displacement of the printed course about the field's origin",
           needs=("pose",), starts=_SHIFTS),
    Effect("line_scale", "the course is printed larger or smaller",
           # printers that fit a page to the paper take 2 to 7 %
           (_P("line_scale", "scale", "-", 0.85, 1.15, 1.0, 0.004),),
           ("sensor",), "a place on the map, more so at its ends",
           "stretch of the printed course about the field's middle",
           needs=("pose",), starts=_values("scale", 0.93, 0.97, 0.985, 1.015, 1.03, 1.07)),
    Effect("clock_skew", "the log's clock runs fast or slow",
           (_P("clock_skew", "rate", "-", -0.06, 0.06, 0.0, 0.004),),
           ("clock",), "grows with time", "log time = true time x (1 + rate)"),
    Effect("pose_delay", "camera poses are late",
           (_P("pose_delay", "time_s", "s", 0.0, 0.3, 0.0, 0.005),),
           ("pose", "clock"), "all motion, in the pose only", "pure delay between motion and logged pose",
           needs=("floor", "pose")),
    Effect("pose_scale", "the camera sees lengths larger or smaller",
           # a mark 60 mm above the plane that a camera 2 m up was calibrated for: 3 %
           (_P("pose_scale", "scale", "-", 0.8, 1.25, 1.0, 0.006),),
           ("pose",), "pose against encoders, straight and not in turns",
           "pinhole camera that looks straight down: magnified about the field's middle",
           needs=("floor", "pose")),
)  # fmt: skip

BY_ID = {effect.id: effect for effect in CATALOGUE}

# The robot's own constants that are no catalogue effect of their own.
_CONSTANTS = (
    "mass", "yaw_inertia", "track_width", "wheel_radius", "caster_ahead",
    "torque_constant", "back_emf_constant", "resistance", "inertia",
    "voltage", "duty_cap", "regulated", "white", "black", "side_sensor_left",
)  # fmt: skip

PHYSICS_FIELDS = _CONSTANTS + tuple(p.field for effect in CATALOGUE for p in effect.parameters)
PHYSICS = np.dtype(
    [(field, np.float64) for field in (*PHYSICS_FIELDS, "n_terms")]
    + [("terms", np.float64, (N_TERMS, TERM_WIDTH))]
)
"""A robot as the kernels take it: constants, effects, and terms, each a row as `gecar.world.ports` lays it out."""
