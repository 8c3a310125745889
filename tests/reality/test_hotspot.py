"""Structure that gathers at one place on the floor: simulated recordings with a kick at one place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support.concealing import EV3, recorded

from gecar.reality.discovery import discover
from gecar.reality.locate.hotspot import strongest_place
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.selection.thresholds import HOTSPOT

KICK_RAD = 0.03


def kicked(run: Recording, at_x_m: float) -> Recording:
    """Turn a robot a little whenever it drives across a line on the floor: a ridge does that."""
    x = np.interp(run.t_s, run.t_s[~np.isnan(run.x_m)], run.x_m[~np.isnan(run.x_m)])
    crossings = np.cumsum(np.abs(np.diff(x > at_x_m, prepend=x[0] > at_x_m)))
    return replace(run, heading_rad=run.heading_rad + KICK_RAD * crossings)


def test_a_kick_at_one_place_is_unexplained_though_hardly_anything_is_left_on_the_whole() -> None:
    runs = [recorded(EV3, seed) for seed in range(5)]
    middle = float(np.nanmedian(np.concatenate([r.x_m for r in runs])))
    verdict = discover(Case("made", tuple(kicked(r, middle) for r in runs)))
    assert verdict.verdict == "unexplained"
    motion = verdict.evidence.motion.problem
    score, spot = strongest_place(motion, motion.known)
    assert score > HOTSPOT
    assert abs(spot[0] - middle) < 0.25
    assert {place.regime for place in verdict.located if place.channel == "heading"} == {"place on the floor"}


def test_noise_stands_out_nowhere() -> None:
    verdict = discover(Case("made", tuple(recorded(EV3, seed) for seed in range(5))))
    motion = verdict.evidence.motion.problem
    assert strongest_place(motion, motion.known)[0] < 0.7 * HOTSPOT


def test_without_poses_there_is_no_place() -> None:
    runs = [recorded(EV3, seed) for seed in range(3)]
    gone = np.full_like(runs[0].t_s, np.nan)
    blind = [replace(r, x_m=gone, y_m=gone, heading_rad=gone) for r in runs]
    verdict = discover(Case("made", tuple(blind)))
    assert strongest_place(verdict.evidence.motion.problem, verdict.evidence.motion.problem.known)[0] == 0.0
