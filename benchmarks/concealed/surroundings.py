"""Forces on the robot that depend on where it is, how fast it goes, and what time it is."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import numpy.typing as npt

from benchmarks.concealed.body import radii
from benchmarks.concealed.colour_sensor import FIELD
from benchmarks.concealed.history import TICK_S
from benchmarks.concealed.robot import GRAVITY, Concealed

_DRAG_BLEND = 0.02  # m/s: below this drags fade out, so that they cannot drive the robot
_TWIST_SLIPS = 6.0  # rad: a cable from above slips in its clamp rather than winding up for ever
_ROLLING_BLEND = 0.2  # rad/s: below this rolling resistance fades out, so that it cannot drive the robot
_SCRUB_BLEND = 0.2  # rad/s: below this rate of turning tyres flex instead of scrubbing
_FAN_SWINGS = 0.7  # rad, to either side of the field's middle
_FAN_BEAM = 0.25  # rad off the beam's middle its push is down to a third
_TIPPING = 0.1  # s, time constant of a table that tips


class Surroundings:
    """Floor, air and cables around one robot.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    model
        The compiled robot, whose gravity and friction this class rewrites as the robot moves.
    """

    def __init__(self, concealed: Concealed, model: mujoco.MjModel) -> None:
        self._hidden, self._model = concealed, model
        self._chassis = model.body("chassis").id
        self._tyres = [model.pair("left_floor").id, model.pair("right_floor").id]
        self._geoms = {int(model.geom(side).id): index for index, side in enumerate(("left", "right"))}
        self._wheels = [int(model.geom_bodyid[geom]) for geom in self._geoms]
        self._radii = radii(concealed)
        self._half_track = concealed.base.track_width * concealed.track_scale / 2.0
        self._scratch = np.zeros(6)
        drags = concealed.air_drag or concealed.pile or concealed.swivel or concealed.yaw_pull
        hauled = concealed.trailer or concealed.twist
        dragged = concealed.hair or concealed.grooves or concealed.fan or concealed.scrub or concealed.fin
        hung = concealed.brush or concealed.turret
        self._pushed = bool(
            concealed.tether or concealed.magnet or concealed.gusts or drags or hauled or dragged or hung
        )
        self._braked = bool(
            concealed.rolling_resistance or concealed.strip or concealed.frame_rub or concealed.patches
        )
        self._rubbed = bool(concealed.hair or concealed.grooves or concealed.brush)
        self._gripped = bool(concealed.patch or concealed.dust or concealed.hop)
        self.idle = not (
            self._pushed
            or self._gripped
            or concealed.waves
            or concealed.curl
            or concealed.leak
            or concealed.rocking
            or self._braked
            or concealed.nap
        )
        self._rolled, self._castor = 0.0, math.nan  # way of the wheels [m], heading of a castor wheel [rad]
        self._turned = 0.0  # since the recording began [rad]
        self._wound = 0.0  # way of hair round the caster [m]
        self._tipped = (math.nan, 1.0)  # how far a table is tipped now, and to which side
        self._weight: tuple[float, float] | None = None  # place of a weight on a string [m]
        shafts = [model.joint(side) for side in ("left", "right")]
        self._angle_at = [int(shaft.qposadr[0]) for shaft in shafts]
        self._speed_at = [int(shaft.dofadr[0]) for shaft in shafts]
        ends = [int(model.body_dofadr[body] + model.body_dofnum[body]) for body in self._wheels]
        self._spins = list(map(slice, self._speed_at, ends))  # a wheel may turn on its shaft, too

    def settle(self) -> None:
        """Set what does not change while driving, and undo what the last drive left behind."""
        self._lean(*self._hidden.tilt)
        self._model.pair_friction[self._tyres, :2] = self._hidden.tyre_friction
        self._shrink(0.0)

    def act(self, state: mujoco.MjData, time_s: float) -> None:
        """Set the forces of one tick.

        Parameters
        ----------
        state
            The robot now; its applied forces are overwritten.
        time_s
            Time since the recording began [s].
        """
        x, y = float(state.qpos[0]), float(state.qpos[1])
        if self._gripped:
            self._grip(x, y, state)
        self._shrink(time_s)
        if self._hidden.waves is not None or self._hidden.curl is not None:
            self._lean(*self._sloping(x, y))
        if self._hidden.rocking is not None:
            slope, _, way, _ = self._hidden.rocking
            (tilt_x, tilt_y), leaning = self._hidden.tilt, slope * self._tip(x, y)
            self._lean(tilt_x + leaning * math.cos(way), tilt_y + leaning * math.sin(way))
        if self._hidden.nap is not None:
            share, way = self._hidden.nap
            heading = _heading(state)
            ahead = math.cos(heading) * state.qvel[0] + math.sin(heading) * state.qvel[1]
            carried = TICK_S * share * abs(ahead)
            state.qpos[:2] += carried * math.cos(way), carried * math.sin(way)
        if self._pushed:
            heading = _heading(state)
            force_x, force_y = self._push(x, y, state.qvel, time_s)
            drag_x, drag_y, turning = self._drag(heading, state.qvel)
            turning += self._swing(time_s)
            if self._hidden.trailer is not None:
                haul_x, haul_y, hauling = self._haul(x, y, heading)
                drag_x, drag_y, turning = drag_x + haul_x, drag_y + haul_y, turning + hauling
            if self._rubbed:
                rub_x, rub_y, rubbing = self._rub(heading, state.qvel)
                drag_x, drag_y, turning = drag_x + rub_x, drag_y + rub_y, turning + rubbing
            state.xfrc_applied[self._chassis] = [force_x + drag_x, force_y + drag_y, 0.0, 0.0, 0.0, turning]
        if self._braked:
            self._resist(state)

    def _lean(self, along_x: float, along_y: float) -> None:
        """Gravity's components along a floor that is not level."""
        down = -math.sqrt(max(1.0 - math.sin(along_x) ** 2 - math.sin(along_y) ** 2, 0.0))
        self._model.opt.gravity[:] = [
            GRAVITY * math.sin(along_x),
            GRAVITY * math.sin(along_y),
            GRAVITY * down,
        ]

    def _sloping(self, x: float, y: float) -> tuple[float, float]:
        """Give the slope here of a floor with waves, or of a mat that curls up at its edges [rad]."""
        along_x, along_y = self._hidden.tilt
        if self._hidden.waves is not None:
            slope, length, phase_x, phase_y = self._hidden.waves
            turn = 2.0 * math.pi / length
            along_x, along_y = (
                along_x + slope * math.sin(turn * x + phase_x),
                along_y + slope * math.sin(turn * y + phase_y),
            )
        if self._hidden.curl is not None:
            slope, wide = self._hidden.curl
            along_x += slope * _curled(x, FIELD[0], wide)
            along_y += slope * _curled(y, FIELD[1], wide)
        return along_x, along_y

    def _shrink(self, time_s: float) -> None:
        """Give a tyre that loses its air the radius that it has now."""
        if self._hidden.leak is None:
            return
        lost, time, side = self._hidden.leak
        left = 1.0 - lost * (1.0 - math.exp(-time_s / time))
        self._model.geom_size[list(self._geoms)[side], 0] = self._radii[side] * left

    def _tip(self, x: float, y: float) -> float:
        """Let a table on uneven legs tip to the side where the robot is; give how far it has, from -1 to 1."""
        _, hinge_x, way, play = self._hidden.rocking or (0.0, 0.0, 0.0, 0.0)
        beyond = math.cos(way) * (x - hinge_x) + math.sin(way) * (y - FIELD[1] / 2.0)
        tipped, side = self._tipped
        if math.isnan(tipped):  # it has borne the robot since before the recording
            tipped = side = math.copysign(1.0, beyond)
        if abs(beyond) > play:
            side = math.copysign(1.0, beyond)
        self._tipped = tipped + TICK_S / _TIPPING * (side - tipped), side
        return tipped

    def _grip(self, x: float, y: float, state: mujoco.MjData) -> None:
        """Set each tyre's friction: a disc on the floor, dust on the tread, a wheel that hops."""
        hidden, grip = self._hidden, self._hidden.tyre_friction
        if hidden.patch is not None:
            centre_x, centre_y, radius, coefficient = hidden.patch
            grip = coefficient if math.hypot(x - centre_x, y - centre_y) < radius else grip
        speeds = state.qvel[self._speed_at]
        if hidden.dust is not None:
            lost, way = hidden.dust
            self._rolled += TICK_S * self._radii[0] * float(np.abs(speeds).sum()) / 2.0
            grip *= 1.0 - lost * (1.0 - math.exp(-self._rolled / way))
        grips = [grip, grip]
        if hidden.hop is not None:
            lost, fast, side = hidden.hop
            if abs(speeds[side]) > fast and math.sin(state.qpos[self._angle_at[side]]) > 0.0:
                grips[side] *= 1.0 - lost
        for tyre, own in zip(self._tyres, grips, strict=True):
            self._model.pair_friction[tyre, :2] = own

    def _drag(self, heading: float, velocity: npt.NDArray[np.float64]) -> tuple[float, float, float]:
        """Force [N] and torque [N m] on the chassis that depend on where it is heading."""
        hidden, force_x, force_y = self._hidden, 0.0, 0.0
        turning, rate = hidden.yaw_pull, float(velocity[5])
        if hidden.twist > 0.0:
            turning -= hidden.twist * self._turned / (1.0 + abs(self._turned) / _TWIST_SLIPS)
            self._turned += TICK_S * rate
        if hidden.scrub > 0.0:
            turning -= hidden.scrub * math.tanh(rate / _SCRUB_BLEND)
        if hidden.fin is not None:
            turning -= hidden.fin[0] * math.sin(heading - hidden.fin[1])
        if hidden.pile is not None:
            most, way = hidden.pile
            ahead = math.cos(heading) * velocity[0] + math.sin(heading) * velocity[1]
            against = (1.0 - math.cos(heading - way) * math.copysign(1.0, ahead)) / 2.0
            drag = -most * against * math.tanh(ahead / _DRAG_BLEND)
            force_x, force_y = drag * math.cos(heading), drag * math.sin(heading)
        if hidden.swivel is not None:
            most, trail = hidden.swivel
            back = self._hidden.base.caster_ahead
            vx = velocity[0] - back * math.sin(heading) * rate
            vy = velocity[1] + back * math.cos(heading) * rate
            if math.isnan(self._castor):
                self._castor = heading
            across = -math.sin(self._castor) * vx + math.cos(self._castor) * vy
            self._castor += TICK_S * across / trail
            side = -most * math.tanh(across / _DRAG_BLEND)
            force_x, force_y = (
                force_x - side * math.sin(self._castor),
                force_y + side * math.cos(self._castor),
            )
            arm = back - hidden.com_ahead  # the forces act at the centre of mass, the castor's behind it
            turning += arm * side * math.cos(self._castor - heading)
        return force_x, force_y, turning

    def _swing(self, time_s: float) -> float:
        """Torque on the chassis of an arm that swings to and fro on it [N m]."""
        torque, period, phase = self._hidden.turret or (0.0, 1.0, 0.0)
        return torque * math.sin(2.0 * math.pi * time_s / period + phase)

    def _rub(self, heading: float, velocity: npt.NDArray[np.float64]) -> tuple[float, float, float]:
        """Force [N] and torque [N m] of what rubs on the floor besides the tyres: a brush, or the caster."""
        forces = zip(self._brush(heading, velocity), self._rub_caster(heading, velocity), strict=True)
        force_x, force_y, turning = (brush + caster for brush, caster in forces)
        return force_x, force_y, turning

    def _rub_caster(self, heading: float, velocity: npt.NDArray[np.float64]) -> tuple[float, float, float]:
        """Force [N] and torque [N m] of hair round the caster's ball and of grooves that it runs in."""
        hidden, force_x, force_y = self._hidden, 0.0, 0.0
        cos, sin, back = math.cos(heading), math.sin(heading), self._hidden.base.caster_ahead
        vx, vy = velocity[0] - back * sin * velocity[5], velocity[1] + back * cos * velocity[5]
        if hidden.hair is not None:
            most, way = hidden.hair
            self._wound = min(max(self._wound + TICK_S * (cos * vx + sin * vy), 0.0), way)
            speed = max(math.hypot(vx, vy), 1e-9)
            drag = most * self._wound / way * math.tanh(speed / _DRAG_BLEND) / speed
            force_x, force_y = -drag * vx, -drag * vy
        if hidden.grooves is not None:
            most, along = hidden.grooves
            held = most * math.tanh((math.cos(along) * vy - math.sin(along) * vx) / _DRAG_BLEND)
            force_x, force_y = force_x + held * math.sin(along), force_y - held * math.cos(along)
        return force_x, force_y, (back - hidden.com_ahead) * (cos * force_y - sin * force_x)

    def _brush(self, heading: float, velocity: npt.NDArray[np.float64]) -> tuple[float, float, float]:
        """Force [N] and torque [N m] of a brush that rubs on the floor, against its own way."""
        most, ahead, left = self._hidden.brush or (0.0, 0.0, 0.0)
        cos, sin, rate = math.cos(heading), math.sin(heading), float(velocity[5])
        vx = float(velocity[0]) - rate * (sin * ahead + cos * left)
        vy = float(velocity[1]) + rate * (cos * ahead - sin * left)
        speed = max(math.hypot(vx, vy), 1e-9)
        drag = most * math.tanh(speed / _DRAG_BLEND) / speed
        along, across = -drag * (cos * vx + sin * vy), -drag * (cos * vy - sin * vx)
        turning = (ahead - self._hidden.com_ahead) * across - left * along
        return -drag * vx, -drag * vy, turning

    def _haul(self, x: float, y: float, heading: float) -> tuple[float, float, float]:
        """Force [N] and torque [N m] of a weight that a string drags behind the caster; none while it is slack."""
        most, length = self._hidden.trailer or (0.0, 1.0)
        back = self._hidden.base.caster_ahead
        hook_x, hook_y = x + back * math.cos(heading), y + back * math.sin(heading)
        if self._weight is None:
            self._weight = (hook_x - length * math.cos(heading), hook_y - length * math.sin(heading))
        off_x, off_y = self._weight[0] - hook_x, self._weight[1] - hook_y
        away = math.hypot(off_x, off_y)
        if away <= length:
            return 0.0, 0.0, 0.0
        self._weight = (hook_x + off_x * length / away, hook_y + off_y * length / away)
        pull = most * math.tanh((away - length) / TICK_S / _DRAG_BLEND) / away
        force_x, force_y = pull * off_x, pull * off_y
        arm = back - self._hidden.com_ahead
        return force_x, force_y, arm * (math.cos(heading) * force_y - math.sin(heading) * force_x)

    def _push(
        self, x: float, y: float, velocity: npt.NDArray[np.float64], time_s: float
    ) -> tuple[float, float]:
        """Horizontal force on the chassis [N]."""
        hidden, force_x, force_y = self._hidden, 0.0, 0.0
        if hidden.tether is not None:
            post_x, post_y, stiffness = hidden.tether
            force_x, force_y = stiffness * (post_x - x), stiffness * (post_y - y)
        if hidden.magnet is not None:
            post_x, post_y, core, most = hidden.magnet
            # Greatest at core / sqrt(3), fading with the cube of the distance.
            away = math.hypot(x - post_x, y - post_y) / core
            pull = most * 3.08 / core / (1.0 + away**2) ** 2
            force_x, force_y = force_x + pull * (post_x - x), force_y + pull * (post_y - y)
        for start, length, gust_x, gust_y in hidden.gusts:
            if start <= time_s < start + length:
                force_x, force_y = force_x + gust_x, force_y + gust_y
        if hidden.air_drag > 0.0:
            drag = hidden.air_drag * math.hypot(velocity[0], velocity[1])
            force_x, force_y = force_x - drag * velocity[0], force_y - drag * velocity[1]
        if hidden.fan is not None:
            blow_x, blow_y = self._blow(x, y, time_s)
            force_x, force_y = force_x + blow_x, force_y + blow_y
        return float(force_x), float(force_y)

    def _blow(self, x: float, y: float, time_s: float) -> tuple[float, float]:
        """Force of a fan that swings to and fro about the field's middle [N]: away from it, and in its beam only."""
        fan_x, fan_y, push, period, phase = self._hidden.fan or (0.0, 0.0, 0.0, 1.0, 0.0)
        off_x, off_y = x - fan_x, y - fan_y
        swing = _FAN_SWINGS * math.sin(2.0 * math.pi * time_s / period + phase)
        aim = math.atan2(FIELD[1] / 2.0 - fan_y, FIELD[0] / 2.0 - fan_x) + swing
        aside = math.remainder(math.atan2(off_y, off_x) - aim, 2.0 * math.pi)
        away = math.hypot(off_x, off_y)
        blown = push * math.exp(-((aside / _FAN_BEAM) ** 2)) * 2.0 / (1.0 + away * away)
        return blown * off_x / away, blown * off_y / away

    def _resist(self, state: mujoco.MjData) -> None:
        """Torque against each wheel's turning: coefficient x load x radius, and what floor or frame holds."""
        loads = self._loads(state)
        sticking, rubbing, clinging = self._sticking(state), self._rubbing(state), self._clinging(state)
        axle = state.xmat[self._chassis].reshape(3, 3)[:, 1]
        turning = [float(state.qvel[spin].sum()) for spin in self._spins]
        for side, body in enumerate(self._wheels):
            brake = self._hidden.rolling_resistance * loads[side] * self._radii[side] + sticking[side]
            brake += rubbing[side]
            brake += clinging[side]
            state.xfrc_applied[body, 3:] = -brake * math.tanh(turning[side] / _ROLLING_BLEND) * axle

    def _sticking(self, state: mujoco.MjData) -> tuple[float, float]:
        """Give the torque with which a strip across the floor holds each wheel that stands on it [N m]."""
        if self._hidden.strip is None:
            return 0.0, 0.0
        most, strip_x, width, angle = self._hidden.strip
        heading, half = _heading(state), self._half_track
        held = []
        for lever in (half, -half):
            off_x = float(state.qpos[0]) - lever * math.sin(heading) - strip_x
            off_y = float(state.qpos[1]) + lever * math.cos(heading) - FIELD[1] / 2.0
            across = math.cos(angle) * off_x + math.sin(angle) * off_y
            held.append(most if abs(across) < width / 2.0 else 0.0)
        return held[0], held[1]

    def _clinging(self, state: mujoco.MjData) -> list[float]:
        """Give the torque with which a patchy floor holds each wheel [N m]: by chance, but everywhere its own."""
        if self._hidden.patches is None:
            return [0.0, 0.0]
        most, wide, pattern = self._hidden.patches
        heading, held = _heading(state), []
        for lever in (self._half_track, -self._half_track):
            column = math.floor((float(state.qpos[0]) - lever * math.sin(heading)) / wide)
            row = math.floor((float(state.qpos[1]) + lever * math.cos(heading)) / wide)
            drawn = 43758.5453 * math.sin(12.9898 * column + 78.233 * row + pattern)
            held.append(most * (drawn - math.floor(drawn)))
        return held

    def _rubbing(self, state: mujoco.MjData) -> list[float]:
        """Give the torque with which the frame holds the wheel that a turn presses on it [N m]."""
        held = [0.0, 0.0]
        if self._hidden.frame_rub is not None:
            rub, way, side = self._hidden.frame_rub
            heading, velocity = _heading(state), state.qvel
            ahead = math.cos(heading) * velocity[0] + math.sin(heading) * velocity[1]
            held[side] = rub * max(way * float(ahead * velocity[5]), 0.0)
        return held

    def _loads(self, state: mujoco.MjData) -> list[float]:
        """Read the normal force under the left and the right wheel in the step before [N]."""
        loads = [0.0, 0.0]
        for index, touching in enumerate(state.contact.geom):
            side = self._geoms.get(int(touching[0]), self._geoms.get(int(touching[1])))
            if side is not None:
                mujoco.mj_contactForce(self._model, state, index, self._scratch)
                loads[side] += self._scratch[0]
        return loads


def _curled(place: float, length: float, wide: float) -> float:
    """Give the share of its edges' slope that a curled mat has here, down to the middle."""
    return min(max(1.0 - place / wide, 0.0), 1.0) - min(max(1.0 - (length - place) / wide, 0.0), 1.0)


def _heading(state: mujoco.MjData) -> float:
    """Heading of the chassis [rad], wrapped."""
    w, i, j, k = state.qpos[3:7]
    return math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))
