"""Which robot a case records, how often, and how coarsely: ordinary in most cases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.concealed.robot import BASES, EV3, Base

# Six recordings to learn from and two to be judged by, of kinds that the six do not hold.
RUNS = ("holds", "holds", "holds_gentle", "sines", "line", "line", "reversals", "line_smooth")
_UNUSUAL = 0.25  # share of cases with another robot, a slower log or coarser encoders
_RECORDINGS = {8: 0.80, 1: 0.06, 2: 0.09, 30: 0.05}


@dataclass(frozen=True)
class Setting:
    """What a case's recordings are of.

    Parameters
    ----------
    base
        The robot as its file states it.
    runs
        Kind of each recording.
    log_hz
        Rows a second; the controller turns as often.
    encoder_step_deg
        What the encoders resolve [deg].
    """

    base: Base = EV3
    runs: tuple[str, ...] = RUNS
    log_hz: float = 100.0
    encoder_step_deg: int = 1

    def as_label(self) -> dict[str, object]:
        """Say it in a label's words."""
        return {
            "robot": self.base.name,
            "recordings": len(self.runs),
            "log_hz": self.log_hz,
            "encoder_step_deg": self.encoder_step_deg,
        }


def draw_setting(rng: np.random.Generator, lone: str) -> Setting:
    """Draw a setting.

    Parameters
    ----------
    rng
        Source of randomness.
    lone
        The kind of recording that shows what is concealed, when there is one alone.

    Returns
    -------
    Setting
    """
    count = int(rng.choice(list(_RECORDINGS), p=list(_RECORDINGS.values())))
    learned = tuple(RUNS[k % len(RUNS)] for k in range(count - 2))
    runs = (*learned, *RUNS[-2:]) if count >= len(RUNS) else (lone, RUNS[6])[:count]
    if rng.random() >= _UNUSUAL:
        return Setting(runs=runs)
    which, step = rng.integers(4), int(rng.integers(2, 6))
    if which < 2:
        return Setting(base=BASES[("large", "spike")[which]], runs=runs)
    return Setting(runs=runs, log_hz=20.0) if which == 2 else Setting(runs=runs, encoder_step_deg=step)
