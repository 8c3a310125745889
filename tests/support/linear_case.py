"""A case whose residuals are linear in a few effects: stages of the selection can be tested without a replay."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.parameters import free
from gecar.reality.materiality import DEFAULT, Material, Size
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.replay.channels import ResidualIndex
from gecar.reality.selection.problem import Problem
from gecar.world.robot import load_robot

EV3 = load_robot("ev3")
ROW_S, SECONDS = 0.01, 6.0


def run() -> Recording:
    """Return a recording of commands."""
    t_s = np.arange(0.0, SECONDS, 0.1)
    return make_recording("made", dict.fromkeys(("t_s", "left_duty_pct", "right_duty_pct"), t_s))


@dataclass(frozen=True)
class LinearResiduals:
    """Residuals of one channel: noise, and responses to effects, one for each size worth a name."""

    responses: Mapping[str, np.ndarray]
    truth: Mapping[str, float]
    noise: np.ndarray
    count: int
    sensor: bool = False

    @property
    def recordings(self) -> tuple[Any, ...]:
        return tuple(SimpleNamespace(recording=run()) for _ in range(self.count))

    def instrument_errors(self, physics: np.ndarray) -> np.ndarray:
        return np.zeros((len(self.noise), 7))

    def part(self, numbers: Sequence[int]) -> LinearResiduals:
        rows = np.isin(self.index.recording, numbers)
        responses = {effect: response[rows] for effect, response in self.responses.items()}
        return replace(self, responses=responses, noise=self.noise[rows], count=len(numbers))

    @property
    def reading_sd(self) -> np.ndarray:
        return np.ones(len(self.noise))

    @property
    def clock_offsets_s(self) -> np.ndarray:
        return np.zeros(self.count)

    def with_clock_offsets(self, offsets_s: np.ndarray) -> LinearResiduals:
        return self  # no camera

    mark = (0.0, 0.0, 0.0)

    def with_mark(self, mark: Sequence[float]) -> LinearResiduals:
        return self

    def later(self, seconds: float) -> LinearResiduals:
        return self  # no steps

    @property
    def index(self) -> ResidualIndex:
        rows = len(self.noise) // self.count
        recording = np.repeat(np.arange(self.count, dtype=np.int32), rows)
        return ResidualIndex(
            recording, np.zeros(len(self.noise), np.int32), np.tile(np.arange(rows) * ROW_S, self.count)
        )

    def regimes(self, physics: np.ndarray) -> Mapping[str, np.ndarray]:
        return defaultdict(lambda: np.zeros(len(self.noise), bool))  # no motion

    def errors(self, physics: np.ndarray) -> np.ndarray:
        return self.errors_of_each(physics)[0]

    def errors_of_each(self, physics: np.ndarray) -> np.ndarray:
        out = np.tile(self.noise, (len(physics), 1))
        for effect, response in self.responses.items():
            c = free(EV3, [effect]).coordinates[0]
            for row, value in enumerate(physics[c.parameter.field] / c.parameter.si):
                out[row] += response * (self.truth.get(effect, 0.0) - c.at(float(value)))
        return out


@dataclass(frozen=True)
class LinearSizes:
    """A standard deviation of the noise is a centimetre."""

    residuals: LinearResiduals

    def of(self, residuals: LinearResiduals) -> LinearSizes:
        return LinearSizes(residuals)

    def apart(self, one: np.ndarray, other: np.ndarray) -> Size:
        change = self.residuals.errors(one) - self.residuals.errors(other)
        return Size(mm_1m=10.0 * float(np.sqrt(np.mean(change**2))))

    def are_apart(self, one: np.ndarray, other: np.ndarray, material: Material) -> bool:
        return material.times(self.apart(one, other)) >= 1.0

    def left(self, physics: np.ndarray, repeatedly: bool = False, inflation: object = None) -> Size:
        beyond = np.mean(self.residuals.errors(physics) ** 2) - 1.0
        return Size(mm_1m=10.0 * float(np.sqrt(max(beyond, 0.0))))


def bumps(seed: int, count: int, size: float) -> np.ndarray:
    """Return a smooth response: random values every half second, filled straight."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, SECONDS, ROW_S)
    knots = np.arange(0.0, SECONDS + 0.5, 0.5)
    return np.concatenate([np.interp(t, knots, rng.normal(0.0, size, len(knots))) for _ in range(count)])


def linear(
    truth: Mapping[str, float], responses: Mapping[str, np.ndarray], seed: int = 0, count: int = 4
) -> LinearResiduals:
    rows = int(SECONDS / ROW_S) * count
    return LinearResiduals(responses, truth, np.random.default_rng(seed).normal(0.0, 1.0, rows), count)


def linear_problem(residuals: LinearResiduals) -> Problem:
    estimator = Estimator(residuals, EV3, np.random.default_rng(0))  # type: ignore[arg-type]
    sizes, effects = LinearSizes(residuals), tuple(residuals.responses)
    return Problem(estimator, effects, DEFAULT, sizes, estimator.known(), lambda line: None)  # type: ignore[arg-type]
