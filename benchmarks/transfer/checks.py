"""Whether the robots drive as mechanics says, and alike: ``python -m benchmarks.transfer.checks``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import fsolve

from benchmarks.transfer import bullet_robot as nominal
from benchmarks.transfer.bullet_robot import BulletRobot
from benchmarks.transfer.mujoco_robot import MujocoRobot
from gecar.report.table import piped

Duties = tuple[float, float]
Spots = npt.NDArray[np.float64]

HOLD_S = 0.05  # commands change at multiples of this, a whole number of every step tried
STEPS_S = (1 / 240, 1 / 500, 1 / 1000, 1 / 2000, 1 / 4000)
SECONDS = 12.0
SEED, DRIVES = 7, 5
STEADY: tuple[Duties, ...] = ((80, 80), (60, -60), (80, 40), (80, 0))
_DAMPING = nominal.KT * nominal.KE / nominal.RESISTANCE  # N m s / rad


@dataclass(frozen=True)
class Runner:
    """A robot, and how to drive it for 50 ms."""

    robot: BulletRobot | MujocoRobot
    hold: Callable[[Duties], None]

    def drive(self, commands: Sequence[Duties]) -> Spots:
        """Drive from the origin; return the poses at the end of each command, heading unwrapped (n, 3)."""
        self.robot.place(0.0, 0.0, 0.0)
        poses = []
        for duties in commands:
            self.hold(duties)
            poses.append(self.robot.pose())
        return _unwrapped(np.array(poses))


def in_mujoco() -> Runner:
    """Return the robot in MuJoCo."""
    robot = MujocoRobot()
    return Runner(robot, lambda duties: _repeat(round(HOLD_S / 0.001), robot.advance, duties))


def in_bullet(step_s: float) -> Runner:
    """Return the robot in PyBullet at a step [s]."""
    robot = BulletRobot(step_s=step_s)
    return Runner(robot, lambda duties: _repeat(round(HOLD_S / step_s), robot.step, duties))


def steady(duties: Duties) -> tuple[float, float]:
    """Solve for the speed [m/s] and yaw rate [rad/s] of a steady circle without slip.

    The centre of mass, c ahead of the axle, needs the force m (-w^2 c, w v), in the robot's frame; the moment about it
    is nil, (F_r - F_l) l/2 - c m w v = 0; on each shaft Kt (u V - Ke n) / R = dry friction + F r.
    """
    half, radius, ahead = nominal.TRACK / 2.0, nominal.RADIUS, nominal.COM_AHEAD
    stalls = [nominal.KT * nominal.SUPPLY_V * duty / 100.0 / nominal.RESISTANCE for duty in duties]

    def missing(unknown: Spots) -> list[float]:
        speed, rate = unknown
        shafts = (speed - rate * half) / radius, (speed + rate * half) / radius
        left, right = (
            (stall - _DAMPING * shaft - _friction(shaft)) / radius
            for stall, shaft in zip(stalls, shafts, strict=True)
        )
        force = left + right + nominal.MASS * rate**2 * ahead
        return [force, (right - left) * half - ahead * nominal.MASS * rate * speed]

    guess = [sum(duties) / 400.0, (duties[1] - duties[0]) / 25.0]
    speed, rate = fsolve(missing, guess, xtol=1e-12)
    return float(speed), float(rate)


def _friction(shaft: float) -> float:
    """Return dry friction [N m]; a shaft at rest carries what it must, by turning next to nothing."""
    return nominal.DRY_FRICTION * math.tanh(shaft / 1e-3)


def stopping() -> tuple[float, float]:
    """Return how far [m] the robot rolls from full speed with the motors at 0 %, and for how long [s].

    (J + m r^2 / 2) w' = -D w - dry friction, from w0: t = T ln(1 + w0 D / f), way = r (T w0 - f t / D), T = J / D.
    """
    fall = nominal.DRY_FRICTION / _DAMPING
    spin = 0.5 * nominal.WHEEL_MASS * nominal.RADIUS**2
    inertia = nominal.ROTOR_INERTIA + spin + 0.5 * nominal.MASS * nominal.RADIUS**2
    lag, start = inertia / _DAMPING, steady((80, 80))[0] / nominal.RADIUS
    time_s = lag * math.log(1.0 + start / fall)
    return nominal.RADIUS * (lag * start - fall * time_s), time_s


def commands(seed: int) -> list[Duties]:
    """Draw 12 s of held duties [%], 0.2 to 0.8 s each: full-speed reversals, pivots and bends among them."""
    rng, drawn = np.random.default_rng(seed), list[Duties]()
    while len(drawn) < round(SECONDS / HOLD_S):
        left, right = rng.integers(-8, 9, 2) * 10
        drawn += [(float(left), float(right))] * int(rng.integers(4, 17))
    return drawn[: round(SECONDS / HOLD_S)]


def gentle(seed: int) -> list[Duties]:
    """Draw 12 s of a line follower's kind: ahead fast, and short turns to the right that hardly slip."""
    rng, drawn = np.random.default_rng(seed), list[Duties]()
    while len(drawn) < round(SECONDS / HOLD_S):
        left, right = rng.integers(3, 9, 2) * 10
        drawn += [(float(left), float(right))] * int(rng.integers(4, 17))
    return drawn[: round(SECONDS / HOLD_S)]


def mechanics() -> Iterator[list[str]]:
    """Compare both robots with mechanics: rows of what, expected, MuJoCo, PyBullet."""
    runners = (in_mujoco(), in_bullet(nominal.STEP_S))
    for duties in STEADY:
        speed, rate = steady(duties)
        found = [_measured(runner, duties) for runner in runners]
        what = f"{duties[0]:.0f} %, {duties[1]:.0f} %"
        if abs(speed) > 0.01:
            yield [
                f"speed at {what} [mm/s]",
                *(f"{1000 * each:.2f}" for each in (speed, *(f[0] for f in found))),
            ]
        if abs(rate) > 0.01:
            turning = [math.degrees(each) for each in (rate, *(f[1] for f in found))]
            yield [f"yaw rate at {what} [deg/s]", *(f"{each:.2f}" for each in turning)]
    way, time_s = stopping()
    rolled = [_rolled(runner) for runner in runners]
    yield [f"way to stop ({time_s:.3f} s) [mm]", *(f"{1000 * each:.2f}" for each in (way, *rolled))]


def apart(one: Spots, other: Spots) -> tuple[float, float]:
    """Return how far apart two drives come [mm], and how differently they head [deg], at most."""
    far = np.hypot(*(one - other)[:, :2].T).max()
    return 1000.0 * float(far), math.degrees(float(np.abs((one - other)[:, 2]).max()))


def convergence() -> Iterator[list[str]]:
    """Compare PyBullet at several steps with itself at the finest, and with MuJoCo: medians and worst of drives."""
    drives = [draw(SEED + k) for draw in (gentle, commands) for k in range(DRIVES)]
    reference = [in_mujoco().drive(each) for each in drives]
    at_steps = {step_s: [in_bullet(step_s).drive(each) for each in drives] for step_s in STEPS_S}
    finest = at_steps[STEPS_S[-1]]
    for step_s, paths in at_steps.items():
        row = [f"1/{1 / step_s:.0f}"]
        for others in (finest, reference):
            for kind in (slice(0, DRIVES), slice(DRIVES, None)):
                gaps = np.array([apart(a, b) for a, b in zip(paths[kind], others[kind], strict=True)])
                (mm, deg), (most_mm, most_deg) = np.median(gaps, axis=0), gaps.max(axis=0)
                row.append(f"{mm:.1f} mm, {deg:.2f} deg ({most_mm:.1f}, {most_deg:.2f})")
        yield row


def _measured(runner: Runner, duties: Duties) -> tuple[float, float]:
    """Return speed of the axle's centre [m/s] and yaw rate [rad/s] over the last of three seconds."""
    poses = runner.drive([duties] * round(3.0 / HOLD_S))[-round(1.0 / HOLD_S) - 1 :]
    turned = float(poses[-1, 2] - poses[0, 2])
    steps = np.diff(poses[:, :2], axis=0)
    ways = steps[:, 0] * np.cos(_middles(poses[:, 2])) + steps[:, 1] * np.sin(_middles(poses[:, 2]))
    half = turned / len(steps) / 2.0
    return float(ways.sum()) / np.sinc(half / math.pi), turned  # a chord is shorter than its arc


def _rolled(runner: Runner) -> float:
    poses = runner.drive([(80, 80)] * 60 + [(0, 0)] * 20)
    return float(poses[-1, 0] - poses[59, 0])


def _middles(values: Spots) -> Spots:
    middles: Spots = (values[1:] + values[:-1]) / 2.0
    return middles


def _repeat(count: int, advance: Callable[[Duties], None], duties: Duties) -> None:
    for _ in range(count):
        advance(duties)


def _unwrapped(poses: Spots) -> Spots:
    poses[:, 2] = np.unwrap(poses[:, 2])
    return poses


def main() -> None:
    """Print both tables."""
    print(piped([["", "mechanics", "MuJoCo", "PyBullet"], *mechanics()]))
    head = ["step [s]", "to 1/4000, gentle", "to 1/4000, hard", "to MuJoCo, gentle", "to MuJoCo, hard"]
    print(piped([head, *convergence()]))
    print(
        f"Greatest distance and difference in heading within 12 s, open loop; median (worst) of {DRIVES} drives."
    )


if __name__ == "__main__":
    main()
