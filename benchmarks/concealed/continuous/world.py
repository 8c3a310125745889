"""Drive a concealed robot through continuous time and remember everything, free of noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.continuous import chassis, drive
from benchmarks.concealed.continuous.firmware import Firmware
from benchmarks.concealed.continuous.numbers import gusts, numbers
from benchmarks.concealed.history import ROW_TICKS, TICK_S, Array, Controller, History, Pose, ToppledError
from benchmarks.concealed.robot import Concealed

_FALLEN_S = 0.15  # a contact lifted for so long does not come down again


class Truth:
    """One concealed robot, ready to be driven any number of times.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    """

    def __init__(self, concealed: Concealed) -> None:
        self.concealed = concealed
        self._numbers, self._gusts = numbers(concealed), gusts(concealed)

    def run(
        self,
        start: Pose,
        controller: Controller,
        seconds: float,
        reading_noise: Array | None = None,
        turn_ticks: int = ROW_TICKS,
        ended: Callable[[float, float], bool] | None = None,
    ) -> History:
        """Drive from rest, as `benchmarks.concealed.worlds.Truth.run`."""
        count = round(seconds / TICK_S) + 1
        noise = np.zeros(count) if reading_noise is None else reading_noise
        log, seen, shares = History.blank(count), np.zeros((count + turn_ticks, 7)), np.zeros((turn_ticks, 3))
        n, body, train = self._numbers, chassis.start(self._numbers, *start), np.zeros(drive.SIZE)
        firmware, sensor = Firmware(self.concealed), ColourSensor(self.concealed)
        train[drive.TERMINAL] = n.supply
        chassis.observe(n, body, train, seen[0])
        step = TICK_S / chassis.STEPS / (1.0 + self.concealed.clock_skew)
        for tick in range(count):
            x, y, turn = seen[tick, :3].tolist()
            log.light[tick] = light = sensor.look(x, y, turn)
            log.readings[tick] = reading = min(max(round(light + noise[tick]), 0), 100)
            if tick % turn_ticks:
                continue
            time_s = tick * TICK_S
            command = controller(time_s, int(reading))
            if command is None or (ended is not None and ended(x, y)):
                return _filled(log, seen).until(tick + 1)
            log.commands[tick : tick + turn_ticks] = command
            for k in range(turn_ticks):
                shares[k, :2] = firmware.duties(command, time_s + k * TICK_S)
                shares[k, 2] = firmware.alike
            after = seen[tick + 1 : tick + 1 + turn_ticks]
            chassis.advance(n, body, train, shares, self._gusts, time_s, TICK_S, step, after)
            if body[chassis.LIFTED] > _FALLEN_S:
                message = f"the robot fell over at {time_s:.2f} s"
                raise ToppledError(message)
        return _filled(log, seen)


def _filled(log: History, seen: Array) -> History:
    """Sort what the equations gave into a history."""
    count = len(log.time_s)
    log.pose[:], log.angles[:], log.yaw_rate[:] = seen[:count, :3], seen[:count, 3:5], seen[:count, 5]
    log.terminal_v[:] = seen[1 : count + 1, 6]  # within the tick, not before it
    return log
