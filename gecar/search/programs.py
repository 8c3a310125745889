"""The problem of evolving robot programs: what a derivation drives, which programs are one, and how drives compare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.evolution.problem import Problem, seed_of
from gecar.evolution.scores import UNSOLVED, Floats, Scores
from gecar.language.mapping import Derivation
from gecar.language.opcodes import LINE, MAX_DUTY_PCT, MOTOR_UNTIL, OP, A, B
from gecar.language.program import Program
from gecar.search.chance import add_drives, n_times, wants_more
from gecar.search.fitness import score_type
from gecar.search.goals import goals_of
from gecar.search.settings import Settings


@dataclass(frozen=True)
class RobotPrograms(Problem[Program]):
    """Robot programs, scored by drives.

    Attributes
    ----------
    n_arrivals
        How many arrival times scores hold, for ``lexicase``.
    n_times
        How many times under drawn conditions scores hold.
    arrival_share, partial_credit
        As `arrival_share` and `checkpoint_credit` of `gecar.search.settings.Settings`.
    duty_cap_pct
        Duty beyond which commands do the same [%]: programs that differ only there are one program.
    goals
        What programs are compared by, if by several; see `gecar.search.goals`.
    """

    n_arrivals: int = 0
    n_times: int = 0
    arrival_share: float = 1.0
    partial_credit: bool = False
    duty_cap_pct: int = MAX_DUTY_PCT
    goals: tuple[str, ...] = ()

    @classmethod
    def of(cls, settings: Settings, n_arrivals: int = 0, duty_cap_pct: int = MAX_DUTY_PCT) -> RobotPrograms:
        """Return the problem that an evolution with these settings solves."""
        draws, credit = n_times(settings.draws), settings.checkpoint_credit
        return cls(n_arrivals, draws, settings.required_share, credit, duty_cap_pct, settings.goals)

    @property
    def score_type(self) -> np.dtype[np.void]:
        """See `gecar.search.fitness.score_type`."""
        return score_type(self.n_arrivals, self.n_times, 2 if self.goals else 0)

    @property
    def failure(self) -> float:
        """10^4, as in eq. 1."""
        return UNSOLVED

    @property
    def rescored(self) -> bool:
        """Whether programs are driven under drawn conditions, and again under others when met again."""
        return self.n_times > 0

    @property
    def n_cases(self) -> int:
        """Goals; or, for ``lexicase``, checkpoints and GOAL."""
        return len(self.goals) or self.n_arrivals

    def read(self, derivation: Derivation) -> Program | None:
        """Return the program; None where the text is none."""
        return derivation.mapped.program(derivation.index)

    def meaning(self, program: Program, derivation: Derivation | None = None) -> bytes:  # noqa: ARG002
        """Return opcodes without line numbers, duties cut at the cap."""
        rows, cap = program.opcodes[:, :LINE].copy(), self.duty_cap_pct
        drives = rows[:, OP] <= MOTOR_UNTIL
        rows[drives, A : B + 1] = np.clip(rows[drives, A : B + 1], -cap, cap)
        return rows.tobytes()

    def seed(self, program: Program, digest: bytes, seed: int) -> int:  # noqa: ARG002
        """Return the seed of the noise a program is driven with; see `noise_seed`."""
        return noise_seed(seed, program)

    def failed(self, n: int) -> Scores:
        """Return the scores of n genomes that map to no program."""
        return _without_drives(super().failed(n))

    def from_merits(self, merits: npt.NDArray[Any]) -> Scores:
        """Make scores of fitness [s] alone; the course was then passed or not."""
        return _without_drives(super().from_merits(merits))

    def cases(self, scores: Scores) -> Floats:
        """Return what programs reach of each goal; or the times from checkpoint to checkpoint [s]."""
        if self.goals:
            return goals_of(scores, self.goals)
        return segment_times(scores["arrival_s"]) if self.n_arrivals else super().cases(scores)

    def wants_more(self, score: np.void) -> bool:
        """Whether a program met again is to be driven under fresh conditions: it arrived often enough so far."""
        return self.rescored and wants_more(score)

    def add(self, known: np.void, told: np.void) -> None:
        """Add the drives of a program met again to those it had."""
        add_drives(known, told, self.arrival_share)


def noise_seed(seed: int, program: Program) -> int:
    """Return the seed of the noise a program is driven with: its own, and the same whenever the run meets it."""
    return seed_of(program.canonical, seed)


def segment_times(arrival_s: Floats) -> Floats:
    """Turn arrival times [s] into the time from checkpoint to checkpoint, inf where it was not reached."""
    reached = np.where(np.isnan(arrival_s), np.inf, arrival_s)
    before = np.concatenate([np.zeros((len(reached), 1)), reached[:, :-1]], axis=1)
    return np.where(np.isinf(reached), np.inf, reached - np.where(np.isinf(before), 0.0, before))


def _without_drives(scores: Scores) -> Scores:
    """Return scores with a fitness and no arrival."""
    scores["fitness_s"] = scores["merit"]
    scores["arrival_s"] = scores["drawn_s"] = np.nan
    return scores
