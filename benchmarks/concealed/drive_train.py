"""From commands to shaft torques: firmware, battery and motors, one tick at a time."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from benchmarks.concealed.history import TICK_S
from benchmarks.concealed.robot import DUTY_CAP, KNOT_S, Concealed

_LIMITER_GAIN = 20.0  # V s / rad: the speed limiter lets go of the whole supply within 0.4 rad/s
_TOOTH_BLEND = 0.2  # rad/s: below this a damaged tooth lets go, so that it cannot drive the robot
_RUB_BLEND = 0.5  # rad/s: below this difference of speeds the axles' rubbing fades out
_LOSS_BLEND = 0.2  # rad/s: below this what gears lose fades out, so that it cannot drive the robot
_GREASE_BLEND = 0.3  # rad/s: below this grease, being a liquid, gives way
_HUM_BLEND = 0.2  # rad/s: below this what a resonance takes fades out
_MOST_SYNCED = 0.3  # share of the supply by which keeping two motors together changes a duty at most
_BAND_SLIPS = 10.0  # rad: a rubber band round the axle slips rather than winding up for ever


@dataclass(frozen=True)
class Drive:
    """What the motors do within one tick, left and right."""

    torques: tuple[float, float]  # N m, on top of the joint's own damping and friction
    friction: tuple[float, float]  # N m, budget of dry friction
    terminal_v: float


class DriveTrain:
    """Both motors with their firmware.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    """

    def __init__(self, concealed: Concealed) -> None:
        self._hidden, self._base = concealed, concealed.base
        self._stall_torque_per_volt = self._base.torque_constant / self._base.resistance  # N m / V
        waiting = round(concealed.actuation_delay / TICK_S)
        self._queue = deque([(0.0, 0.0)] * waiting)
        self._ramped = (0.0, 0.0)
        gain = concealed.gain_difference / 2.0
        self._gains = (1.0 - gain, 1.0 + gain)
        self._varying_friction = concealed.static_friction > 0.0
        self._driven_at = [[-math.inf, -math.inf], [-math.inf, -math.inf]]  # s, by side: backward, forward
        self._kept = [0.0, 0.0]  # shares of the supply that the firmware adds to keep the speed
        self._polled: tuple[float, tuple[float, float]] = (
            0.0,
            (0.0, 0.0),
        )  # when commands were looked for, and seen
        self._held: list[float | None] = [None, None]  # angles at which the motors were stopped [rad]
        self._softened = 0.0  # share of a grease's stiffness that is worked away
        self._sagged = 0.0  # V, of the battery's slow part
        self._given: list[tuple[float, float]] = [
            (0.0, 0.0)
        ] * 2  # duty [%] of each motor, and since when [s]
        self._warm = [0.0, 0.0]  # of each motor's fuse, 1 where its rated current brings it
        self._borne = [0.0, 0.0]  # for how long each driver has borne too much current [s]
        self._off_until = [0.0, 0.0]  # s
        self._stuck = [0.0, 0.0]  # duties that act until others are far enough from them [%]
        self._alike = False  # whether both motors are given the same, and not nothing
        self._lead: float | None = None  # of the left motor before the right when that began [rad]

    def duties(self, command_pct: tuple[float, float], time_s: float) -> tuple[float, float]:
        """Pass one tick's command through delay, ramp, cap and dead band.

        Parameters
        ----------
        command_pct
            Left and right duty [%].
        time_s
            Time since the recording began [s].

        Returns
        -------
        tuple[float, float]
            Share of the terminal voltage across each motor, signed.
        """
        self._queue.append(self._heard(command_pct, time_s))
        late = self._queue.popleft()
        most = self._hidden.command_slew * TICK_S
        if most < math.inf:
            late = tuple(  # type: ignore[assignment]
                old + min(max(new - old, -most), most) for old, new in zip(self._ramped, late, strict=True)
            )
            self._ramped = late
        if self._hidden.reversal_pause > 0.0:
            late = self._paused(0, late[0], time_s), self._paused(1, late[1], time_s)
        self._alike = late[0] == late[1] != 0.0
        left, right = self._shaped(late[0]), self._shaped(late[1])
        if abs(left) + abs(right) > self._hidden.duty_budget:
            left, right = self._rationed(left, right)
        if left != 0.0 and right != 0.0:
            left, right = left * (1.0 - self._hidden.shared_drop), right * (1.0 - self._hidden.shared_drop)
        if self._hidden.wander is not None:
            left, right = self._wandered(0, left, time_s), self._wandered(1, right, time_s)
        return left * self._gains[0], right * self._gains[1]

    def _heard(self, command_pct: tuple[float, float], time_s: float) -> tuple[float, float]:
        """Give what the firmware makes of a command before it passes it on, if it hears it at all."""
        for start, length in self._hidden.dropouts:
            if start <= time_s < start + length:
                command_pct = (0.0, 0.0)
        if self._hidden.latch is not None:
            period, gone = self._hidden.latch
            ticking = math.floor(time_s / period + gone)
            if ticking > self._polled[0]:
                self._polled = ticking, command_pct
            command_pct = self._polled[1]
        if self._hidden.sticky_pct > 0.0:
            command_pct = self._unstuck(0, command_pct[0]), self._unstuck(1, command_pct[1])
        if self._hidden.throttle is not None:
            left, right = command_pct
            command_pct = self._throttled(0, left, time_s), self._throttled(1, right, time_s)
        return command_pct

    def _unstuck(self, side: int, duty_pct: float) -> float:
        """Give the duty that acts: a new one only if it is nothing, or far enough from the last that did."""
        if duty_pct == 0.0 or abs(duty_pct - self._stuck[side]) >= self._hidden.sticky_pct:
            self._stuck[side] = duty_pct
        return self._stuck[side]

    def _rationed(self, left: float, right: float) -> tuple[float, float]:
        """Scale both duties so that together they keep within the budget."""
        share = self._hidden.duty_budget / (abs(left) + abs(right))
        return left * share, right * share

    def _wandered(self, side: int, duty: float, time_s: float) -> float:
        """Change one motor's drive by what is drawn for every half second, and lies between two draws in between."""
        which, knots = self._hidden.wander or (0, (0.0,))
        place = min(time_s / KNOT_S, len(knots) - 1.0)
        before = min(int(place), len(knots) - 2)
        share = place - before
        changed = (1.0 - share) * knots[before] + share * knots[before + 1]
        return duty * (1.0 + changed) if which == side else duty

    def _paused(self, side: int, duty_pct: float, time_s: float) -> float:
        """Withhold a duty until the motor has not been driven the other way for a while."""
        if duty_pct == 0.0:
            return 0.0
        way, driven_at = int(duty_pct > 0.0), self._driven_at[side]
        if time_s - driven_at[1 - way] < self._hidden.reversal_pause:
            return 0.0
        driven_at[way] = time_s
        return duty_pct

    def _throttled(self, side: int, duty_pct: float, time_s: float) -> float:
        """Take a share off a duty that has been the same for a while."""
        share, after = self._hidden.throttle or (0.0, math.inf)
        if duty_pct != self._given[side][0]:
            self._given[side] = duty_pct, time_s
        return duty_pct if time_s - self._given[side][1] < after else duty_pct * (1.0 - share)

    def drive(
        self,
        duties: tuple[float, float],
        speeds: tuple[float, float],
        angles: tuple[float, float],
        time_s: float,
    ) -> Drive:
        """Compute torques from duties and the shafts' state.

        Parameters
        ----------
        duties
            As :meth:`duties` returns them.
        speeds, angles
            Of the left and right shaft [rad/s, rad].
        time_s
            Time since the recording began [s].

        Returns
        -------
        Drive
        """
        if self._hidden.keeper is not None:
            duties = self._keep(0, duties[0], speeds[0]), self._keep(1, duties[1], speeds[1])
        if self._hidden.motor_sync > 0.0:
            duties = self._together(duties, angles)
        if self._hidden.holding > 0.0:
            duties = self._hold(0, duties[0], angles[0]), self._hold(1, duties[1], angles[1])
        if self._hidden.cut_out is not None:
            off = [time_s < until for until in self._off_until]
            duties = 0.0 if off[0] else duties[0], 0.0 if off[1] else duties[1]
        terminal = self._terminal(duties, speeds, time_s)
        volts = [duty * terminal for duty in duties]
        if self._hidden.cut_out is not None:
            volts = [self._guarded(i, volts[i], speeds[i], time_s) for i in (0, 1)]
        torques = tuple(
            self._torque(i, volts[i], speeds[i], angles[i])
            + self._oddities(i, volts[i], speeds[i], angles[i], time_s)
            for i in (0, 1)
        )
        if self._hidden.axle_rub > 0.0:
            rub = self._hidden.axle_rub * math.tanh((speeds[0] - speeds[1]) / _RUB_BLEND)
            torques = torques[0] - rub, torques[1] + rub
        friction = (self._friction(speeds[0]), self._friction(speeds[1]))
        return Drive(torques, friction, terminal)  # type: ignore[arg-type]

    def _shaped(self, duty_pct: float) -> float:
        """Cap and dead band: a dead zone takes the band off the duty, a threshold only blocks what is below it."""
        if self._hidden.duty_step_pct > 0.0:
            duty_pct = self._hidden.duty_step_pct * round(duty_pct / self._hidden.duty_step_pct)
        duty = min(max(duty_pct / 100.0, -DUTY_CAP), DUTY_CAP)
        duty *= 1.0 + self._hidden.expo * ((duty / DUTY_CAP) ** 2 - 1.0)
        band = self._hidden.dead_band_pct / 100.0
        if band == 0.0:
            return duty
        if abs(duty) < band:
            return 0.0
        return duty if self._hidden.dead_band_is_threshold else duty - math.copysign(band, duty)

    def _keep(self, side: int, duty: float, speed: float) -> float:
        """Add the integral of what the speed lacks of a motor's that runs free under this duty; none at rest."""
        rate, most = self._hidden.keeper or (0.0, 0.0)
        lacking = duty - speed * self._base.back_emf_constant / self._base.supply
        kept = min(max(self._kept[side] + TICK_S * rate * lacking, -most), most)
        self._kept[side] = kept if duty != 0.0 else 0.0
        return min(max(duty + self._kept[side], -1.0), 1.0)

    def _together(self, duties: tuple[float, float], angles: tuple[float, float]) -> tuple[float, float]:
        """Hold back the motor that has got ahead of the other since both were first given the same."""
        lead = angles[0] - angles[1]
        if not self._alike:
            self._lead = None
            return duties
        if self._lead is None:
            self._lead = lead
        wanted = self._hidden.motor_sync * (lead - self._lead) / 2.0
        fix = min(max(wanted, -_MOST_SYNCED), _MOST_SYNCED)
        return min(max(duties[0] - fix, -1.0), 1.0), min(max(duties[1] + fix, -1.0), 1.0)

    def _hold(self, side: int, duty: float, angle: float) -> float:
        """Drive a motor that is given nothing back to where it was when that began."""
        held = self._held[side]
        if duty != 0.0 or held is None:
            self._held[side] = held = angle
        wanted = self._hidden.holding * (held - angle)
        return duty if duty != 0.0 else min(max(wanted, -DUTY_CAP), DUTY_CAP)

    def _terminal(self, duties: tuple[float, float], speeds: tuple[float, float], time_s: float) -> float:
        """Voltage at the terminals: a chopper draws duty x motor current from a source behind a resistance."""
        source = self._base.supply * self._hidden.supply_scale - self._hidden.battery_drain * time_s
        if self._hidden.slow_sag is not None:
            source = self._sag(source, duties, speeds)
        if self._hidden.loose_cell is not None:
            source *= self._touching(speeds)
        if self._hidden.pulses is not None:
            share, period, on, gone = self._hidden.pulses
            source *= 1.0 - share * ((time_s / period + gone) % 1.0 < on)
        inner = self._hidden.battery_resistance
        if inner == 0.0:
            return source
        load = (duties[0] ** 2 + duties[1] ** 2) / self._base.resistance
        back = (
            self._base.back_emf_constant
            * (duties[0] * speeds[0] + duties[1] * speeds[1])
            / self._base.resistance
        )
        return (source + inner * back) / (1.0 + inner * load)

    def _guarded(self, side: int, volts: float, speed: float, time_s: float) -> float:
        """Let a driver cut out for a while when it has borne too much current; a motor that is off runs free [V]."""
        most, bears, rests = self._hidden.cut_out or (math.inf, 0.0, 0.0)
        back = self._base.back_emf_constant * speed
        if time_s < self._off_until[side]:
            return back
        too_much = abs(volts - back) > most * self._base.resistance
        self._borne[side] = self._borne[side] + TICK_S if too_much else 0.0
        if self._borne[side] > bears:
            self._borne[side], self._off_until[side] = 0.0, time_s + rests
        return volts

    def _touching(self, speeds: tuple[float, float]) -> float:
        """Give the share of the voltage that is left while a curve pulls a cell off its spring."""
        share, half, way = self._hidden.loose_cell or (0.0, 1.0, 1.0)
        radius, track = self._base.wheel_radius, self._base.track_width
        sideways = way * radius**2 * (speeds[1] ** 2 - speeds[0] ** 2) / (2.0 * track)
        pulled = max(sideways / half, 0.0) ** 2
        return 1.0 - share * pulled / (1.0 + pulled)

    def _sag(self, source: float, duties: tuple[float, float], speeds: tuple[float, float]) -> float:
        """Let the battery's slow part follow the current drawn; give what is left of the source's voltage [V]."""
        resistance, time = self._hidden.slow_sag or (0.0, 1.0)
        left = source - self._sagged
        drawn = sum(
            duty * (duty * left - self._base.back_emf_constant * speed) / self._base.resistance
            for duty, speed in zip(duties, speeds, strict=True)
        )
        self._sagged += TICK_S / time * (resistance * drawn - self._sagged)
        return left

    def _torque(self, side: int, volts: float, speed: float, angle: float) -> float:
        hidden = self._hidden
        if abs(speed) > hidden.speed_limit - 1.0:
            volts = self._limited(volts, speed)
        torque = self._stall_torque_per_volt * volts
        if hidden.direction_gain != 0.0 and volts != 0.0:
            torque *= 1.0 + hidden.direction_gain * math.copysign(1.0, volts)
        if hidden.friction_ratio != 0.0:
            torque -= (
                hidden.friction_ratio * hidden.coulomb_friction
            )  # shifts the budget to one side, also at rest
        if hidden.ripple_torque != 0.0:
            torque += hidden.ripple_torque * math.sin(
                hidden.ripple_cycles * angle + hidden.ripple_phases[side]
            )
        return torque

    def _oddities(self, side: int, volts: float, speed: float, angle: float, time_s: float) -> float:
        """Torque of physics outside the catalogue [N m], on top of the nominal motor's (which brakes by back-EMF)."""
        hidden, torque = self._hidden, 0.0
        usual = self._stall_torque_per_volt * (volts - self._base.back_emf_constant * speed)
        if hidden.heat is not None and hidden.heat[2] == side:
            grown = hidden.heat[0] * (1.0 - math.exp(-time_s / hidden.heat[1]))
            torque -= usual * grown / (1.0 + grown)
        if hidden.coasting > 0.0 and volts == 0.0:
            torque -= usual * hidden.coasting
        if hidden.overrun > 0.0 and volts * usual < 0.0:
            torque -= usual * hidden.overrun
        most = hidden.current_limit * self._base.torque_constant
        if abs(usual) > most:
            torque -= math.copysign(abs(usual) - most, usual)
        if hidden.tooth is not None and hidden.tooth[2] == side:
            size, width, _, phase = hidden.tooth
            if (angle + phase) % (2.0 * math.pi) < width:
                torque -= size * math.tanh(speed / _TOOTH_BLEND)
        if hidden.rubber_band is not None and hidden.rubber_band[1] == side:
            torque -= hidden.rubber_band[0] * angle / (1.0 + abs(angle) / _BAND_SLIPS)
        if hidden.gear_loss is not None and hidden.gear_loss[1] == side:
            torque -= hidden.gear_loss[0] * abs(usual) * math.tanh(speed / _LOSS_BLEND)
        if hidden.grease is not None and hidden.grease[3] == side:
            torque -= self._stiffness(speed) * math.tanh(speed / _GREASE_BLEND)
        return torque - self._taken(side, usual, speed)

    def _taken(self, side: int, usual: float, speed: float) -> float:
        """Torque that a resonance and a fuse take [N m]."""
        taken = 0.0
        if self._hidden.hum is not None and self._hidden.hum[3] == side:
            most, at, width, _ = self._hidden.hum
            taken += most * math.tanh(speed / _HUM_BLEND) / (1.0 + ((abs(speed) - at) / width) ** 2)
        if self._hidden.fuse is not None:
            taken += self._fused(side, usual)
        return taken

    def _fused(self, side: int, usual: float) -> float:
        """Warm a motor's fuse by the current through it; give the torque that its resistance costs [N m]."""
        share, rated, time = self._hidden.fuse or (0.0, 1.0, 1.0)
        grown = share * self._warm[side]
        current = usual / self._base.torque_constant / (1.0 + grown)
        self._warm[side] += TICK_S / time * ((current / rated) ** 2 - self._warm[side])
        return usual * grown / (1.0 + grown)

    def _stiffness(self, speed: float) -> float:
        """Work grease soft by turning, while it stiffens with time; give its torque [N m]."""
        torque, rest, shear, _ = self._hidden.grease or (0.0, 1.0, 1.0, 0)
        left = 1.0 - self._softened
        self._softened += TICK_S * (abs(speed) / shear * left - self._softened / rest)
        return torque * left

    def _limited(self, volts: float, speed: float) -> float:
        """Take voltage away so that the motor's own torque never drives it above the limit; it may coast there."""
        turn = math.copysign(1.0, speed)
        holding = (
            self._base.back_emf_constant * abs(speed)
            + self._hidden.coulomb_friction / self._stall_torque_per_volt
        )
        allowed = holding + _LIMITER_GAIN * (self._hidden.speed_limit - abs(speed))
        return turn * min(turn * volts, max(allowed, 0.0))

    def _friction(self, speed: float) -> float:
        """Dry friction's budget, with the Stribeck curve (exponent 2) where breaking away takes more."""
        if not self._varying_friction:
            return self._hidden.coulomb_friction
        fading = math.exp(-((speed / self._hidden.stribeck_speed) ** 2))
        return self._hidden.coulomb_friction + self._hidden.static_friction * fading
