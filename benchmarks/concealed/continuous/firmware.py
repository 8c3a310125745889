"""From the commands a program issues to the share of the battery's voltage across each motor."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.concealed.history import TICK_S
from benchmarks.concealed.robot import DUTY_CAP, KNOT_S, Concealed


class Firmware:
    """All that changes a command before it drives a motor, once a tick: from what is heard to what wanders.

    In the order of the code; ``alike`` says whether both motors are given the same duty, other than 0.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    """

    def __init__(self, concealed: Concealed) -> None:
        self._hidden = concealed
        self._issued: list[tuple[float, float]] = []
        self._late = round(concealed.actuation_delay / TICK_S)
        self._now = [0.0, 0.0]
        self._polls, self._polled = 0, (0.0, 0.0)  # how often commands were looked for, and those seen last
        self._asked: list[list[float]] = [[0.0, 0.0], [0.0, 0.0]]  # by motor: duty [%], and when it came [s]
        # By motor: the way it was driven last, and when that ended.
        self._last: list[tuple[float, float]] = [(0.0, -math.inf)] * 2
        self._acting = [0.0, 0.0]  # duties from which others must differ enough to act [%]
        self.alike = False
        self._known: dict[tuple[float, float], tuple[float, float]] = {}

    def duties(self, command_pct: tuple[float, float], time_s: float) -> tuple[float, float]:
        """Pass on one tick's command.

        Parameters
        ----------
        command_pct
            Left and right duty [%].
        time_s
            Time since the recording began [s].

        Returns
        -------
        tuple[float, float]
            Signed share of the terminal voltage, left and right.
        """
        hidden = self._hidden
        lost = hidden.dropouts and any(0.0 <= time_s - start < length for start, length in hidden.dropouts)
        heard = (0.0, 0.0) if lost else command_pct
        if hidden.latch is not None:
            heard = self._latched(heard, time_s, *hidden.latch)
        if hidden.sticky_pct > 0.0:
            heard = self._kept(heard, hidden.sticky_pct)
        self._issued.append(
            heard if hidden.throttle is None else self._spared(heard, time_s, *hidden.throttle)
        )
        acting = self._issued[-1 - self._late] if self._late < len(self._issued) else (0.0, 0.0)
        most = hidden.command_slew * TICK_S
        if most < math.inf:
            for side, wanted in enumerate(acting):
                step = wanted - self._now[side]
                self._now[side] = wanted if abs(step) <= most else self._now[side] + math.copysign(most, step)
            acting = (self._now[0], self._now[1])
        if hidden.reversal_pause > 0.0:
            acting = self._rested(0, acting[0], time_s), self._rested(1, acting[1], time_s)
        self.alike = acting[0] == acting[1] != 0.0
        if acting not in self._known:
            self._known[acting] = self._bridged(*acting)
        shares = self._known[acting]
        if hidden.wander is None:
            return shares
        side, knots = hidden.wander
        gains = [1.0, 1.0]
        gains[side] += float(np.interp(time_s, KNOT_S * np.arange(len(knots)), knots))
        return shares[0] * gains[0], shares[1] * gains[1]

    def _kept(self, heard: tuple[float, float], least: float) -> tuple[float, float]:
        """Keep to the duties that act until one is 0, or differs by enough."""
        for side, duty in enumerate(heard):
            if duty == 0.0 or abs(duty - self._acting[side]) >= least:
                self._acting[side] = duty
        return self._acting[0], self._acting[1]

    def _spared(
        self, heard: tuple[float, float], time_s: float, share: float, after: float
    ) -> tuple[float, float]:
        """Spare motors that have been driven alike for long: give less of such a duty."""
        left = [1.0, 1.0]
        for side, duty in enumerate(heard):
            if duty != self._asked[side][0]:
                self._asked[side] = [duty, time_s]
            elif time_s >= self._asked[side][1] + after:
                left[side] -= share
        return heard[0] * left[0], heard[1] * left[1]

    def _latched(
        self, heard: tuple[float, float], time_s: float, period: float, gone: float
    ) -> tuple[float, float]:
        """Give the command that was there when the firmware last looked: at the end of each period."""
        if time_s >= (self._polls + 1 - gone) * period:
            self._polls, self._polled = math.floor(time_s / period + gone), heard
        return self._polled

    def _rested(self, side: int, duty_pct: float, time_s: float) -> float:
        """Let a motor turn round only when it has rested."""
        way, until = self._last[side]
        turned = duty_pct * way < 0.0
        if turned and time_s < until + self._hidden.reversal_pause:
            return 0.0
        if duty_pct != 0.0:
            self._last[side] = (math.copysign(1.0, duty_pct), time_s)
        return duty_pct

    def _bridged(self, left_pct: float, right_pct: float) -> tuple[float, float]:
        """Give both motors' shares of the voltage."""
        left, right = self._bridge(left_pct), self._bridge(right_pct)
        asked = abs(left) + abs(right)
        if asked > self._hidden.duty_budget:
            left, right = left * self._hidden.duty_budget / asked, right * self._hidden.duty_budget / asked
        keep = 1.0 - self._hidden.shared_drop if left != 0.0 and right != 0.0 else 1.0
        differ = self._hidden.gain_difference / 2.0
        return left * keep * (1.0 - differ), right * keep * (1.0 + differ)

    def _bridge(self, duty_pct: float) -> float:
        """Round, cap, and lose what lies within the dead band."""
        hidden = self._hidden
        if hidden.duty_step_pct > 0.0:
            duty_pct = round(duty_pct / hidden.duty_step_pct) * hidden.duty_step_pct
        size, band = min(abs(duty_pct) / 100.0, DUTY_CAP), hidden.dead_band_pct / 100.0
        if hidden.expo != 0.0:
            size = (1.0 - hidden.expo) * size + hidden.expo * size**3 / DUTY_CAP**2
        lost = 0.0 if hidden.dead_band_is_threshold else band
        return math.copysign(size - lost, duty_pct) if size > band or band == 0.0 else 0.0
