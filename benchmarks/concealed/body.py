"""The robot and its floor as a MuJoCo model: rigid bodies, joints, contacts."""

from __future__ import annotations

import math

import mujoco

from benchmarks.concealed.robot import (
    CASTER_RADIUS,
    CHASSIS_PITCH_INERTIA,
    CHASSIS_ROLL_INERTIA,
    GRAVITY,
    WHEEL_MASS,
    Concealed,
)

STEP_S = 0.0005  # halving it moves nothing that a sensor sees
BUMP_RADIUS = 0.20  # m, the ridge is the cap of a lying cylinder

# Joint limits and dry friction: as hard as the step allows.
_HARD = 'solimp{0}="0.9999 0.9999 0.001" solref{0}="0.003 1"'

# Contacts. MuJoCo's cone couples sliding to lifting: with an impedance near 1 a dragging caster hops, and the wheels
# lose 5 % of their way. An impedance of 0.01 makes the normal a plain spring and damper (4e5 1/s^2: the tyres sink by
# 7 micrometres), a hundred times softer than the lift, while impratio keeps the tangential part hard: creep is below
# 0.03 % of the way, and slip ends within 1 ms.
_IMPEDANCE = 0.01
_STIFFNESS = 4.0e5
_STICK_RATE = 1000.0
_CONTACT = (
    f'solimp="{_IMPEDANCE} {_IMPEDANCE} 0.001" solref="{-_STIFFNESS} {-2.0 * math.sqrt(_STIFFNESS)}" '
    f'solreffriction="-1 {-_STICK_RATE * _IMPEDANCE}"'
)
_OPTION = (
    'integrator="implicitfast" cone="elliptic" impratio="1e5" solver="Newton" iterations="50" tolerance="1e-12" '
    f'gravity="0 0 {-GRAVITY}"'
)
_GHOST = 'contype="0" conaffinity="0"'  # geoms touch only through the explicit pairs below


def build(concealed: Concealed) -> mujoco.MjModel:
    """Compile the model of one robot on its floor.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.

    Returns
    -------
    mujoco.MjModel
        Joints ``left`` and ``right`` are the motor shafts; pairs ``left``, ``right`` and ``caster`` the contacts.
    """
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP_S / (1.0 + concealed.clock_skew)!r}" {_OPTION}/>'
        f'<worldbody><geom name="floor" type="plane" size="9 9 1" {_GHOST}/>{_ridge(concealed)}'
        f"{_chassis(concealed)}</worldbody><contact>{_pairs(concealed)}</contact></mujoco>"
    )


def radii(concealed: Concealed) -> tuple[float, float]:
    """Give the rolling radius of the left and the right wheel [m]."""
    mean, half = concealed.base.wheel_radius * concealed.radius_scale, concealed.radius_difference / 2.0
    return mean * (1.0 - half), mean * (1.0 + half)


def _chassis(concealed: Concealed) -> str:
    """Brick and battery, such that everything together has the nominal mass, centre of mass and yaw inertia."""
    base, height = concealed.base, sum(radii(concealed)) / 2.0
    half_track = base.track_width * concealed.track_scale / 2.0
    mass = base.mass - 2.0 * WHEEL_MASS
    ahead = base.mass * concealed.com_ahead / mass
    up = (base.mass * concealed.com_height - 2.0 * WHEEL_MASS * height) / mass - height
    wheels = 2.0 * WHEEL_MASS * (concealed.com_ahead**2 + half_track**2 + 0.3 * height**2)
    yaw = base.yaw_inertia * concealed.yaw_inertia_scale - wheels - mass * (ahead - concealed.com_ahead) ** 2
    # No body turns harder about one axis than about the other two together.
    roll = max(CHASSIS_ROLL_INERTIA, yaw - CHASSIS_PITCH_INERTIA)
    inertia = f"{roll!r} {CHASSIS_PITCH_INERTIA} {yaw!r}"
    left, right = radii(concealed)
    return (
        f'<body name="chassis" pos="0 0 {height + _unevenness(concealed)!r}"><freejoint/>'
        f'<inertial pos="{ahead!r} 0 {up!r}" mass="{mass}" diaginertia="{inertia}"/>'
        f'<geom name="caster" type="sphere" size="{CASTER_RADIUS}" {_GHOST} '
        f'pos="{base.caster_ahead} 0 {CASTER_RADIUS - height!r}"/>'
        f"{_wheel(concealed, 'left', half_track, left)}{_wheel(concealed, 'right', -half_track, right)}</body>"
    )


def _unevenness(concealed: Concealed) -> float:
    """Say how far a wheel may reach below its mean radius [m]: the robot is put down from there, not into the floor."""
    return max(shape[0] if shape else 0.0 for shape in (concealed.off_centre, concealed.oval))


def _wheel(concealed: Concealed, side: str, y: float, radius: float) -> str:
    """One motor shaft with its wheel; play or a clutch makes the wheel a body of its own, loose on the shaft."""
    spin = 0.5 * WHEEL_MASS * radius**2
    wheel = (
        f'<inertial pos="0 0 0" mass="{WHEEL_MASS}" diaginertia="{0.6 * spin!r} {spin!r} {0.6 * spin!r}"/>'
        f'<geom name="{side}" {_tread(concealed, side, radius)} {_GHOST}/>'
    )
    if concealed.clutch is not None and concealed.clutch[1] == ("left", "right").index(side):
        slips = f'frictionloss="{concealed.clutch[0]!r}" {_HARD.format("friction")}'
        wheel = _loose(f"{side}_clutch", slips, wheel)
    if concealed.backlash_deg > 0.0:
        play = concealed.backlash_deg / 2.0
        within = f'limited="true" range="{-play!r} {play!r}" {_HARD.format("limit")}'
        wheel = _loose(f"{side}_play", within, wheel)
    base = concealed.base
    braking = base.torque_constant * base.back_emf_constant / base.resistance
    damping = braking + concealed.viscous_friction
    return (
        f'<body name="{side}_shaft" pos="0 {y!r} 0"{_toe(concealed, side)}>'
        f'<joint name="{side}" type="hinge" axis="0 1 0" '
        f'armature="{base.shaft_inertia * concealed.inertia_scale!r}" damping="{damping!r}" '
        f'frictionloss="{max(concealed.coulomb_friction, 1e-9)!r}" {_HARD.format("friction")}/>{wheel}</body>'
    )


def _loose(name: str, held: str, wheel: str) -> str:
    """Make what sits on a shaft a body of its own, which a joint holds."""
    return (
        '<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-8 1e-8 1e-8"/>'
        f'<body name="{name}_wheel"><joint name="{name}" type="hinge" axis="0 1 0" {held}/>{wheel}</body>'
    )


def _toe(concealed: Concealed, side: str) -> str:
    """Turn a shaft that does not lie square to the chassis."""
    if concealed.toe is None or concealed.toe[1] != ("left", "right").index(side):
        return ""
    return f' euler="0 0 {math.degrees(concealed.toe[0])!r}"'


def _tread(concealed: Concealed, side: str, radius: float) -> str:
    """Shape a wheel: a ball touches the floor in one point, right under the middle of its tread."""
    which = 1 if side == "left" else 2
    if concealed.off_centre is not None:
        offset, phase = concealed.off_centre[0], concealed.off_centre[which]
        place = f"{offset * math.cos(phase)!r} 0 {-offset * math.sin(phase)!r}"
        return f'type="sphere" size="{radius!r}" pos="{place}"'
    if concealed.oval is not None:
        half, turn = concealed.oval[0], math.degrees(concealed.oval[which])
        return f'type="ellipsoid" size="{radius + half!r} {radius!r} {radius - half!r}" euler="0 {turn!r} 0"'
    return f'type="sphere" size="{radius!r}"'


def _ridge(concealed: Concealed) -> str:
    """Lay a threshold strip across the floor: the cap of a cylinder that lies below it."""
    if concealed.bump is None:
        return ""
    height, x, angle = concealed.bump
    along_x, along_y = -3.0 * math.sin(angle), 3.0 * math.cos(angle)
    z = height - BUMP_RADIUS
    ends = f"{x - along_x!r} {0.6 - along_y!r} {z!r} {x + along_x!r} {0.6 + along_y!r} {z!r}"
    return f'<geom name="ridge" type="capsule" size="{BUMP_RADIUS}" fromto="{ends}" {_GHOST}/>'


def _pairs(concealed: Concealed) -> str:
    """Which geoms touch, and how they rub; a pair's friction stands alone (no largest-of-both rule)."""
    grounds = ["floor"] if concealed.bump is None else ["floor", "ridge"]
    rubs = {
        "left": concealed.tyre_friction,
        "right": concealed.tyre_friction,
        "caster": concealed.caster_friction,
    }
    return "".join(
        f'<pair name="{geom}_{ground}" geom1="{geom}" geom2="{ground}" condim="{3 if rub > 0.0 else 1}" '
        f'friction="{rub!r} {rub!r} 0 0 0" {_CONTACT}/>'
        for geom, rub in rubs.items()
        for ground in grounds
    )
