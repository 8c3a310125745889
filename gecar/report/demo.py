"""The demonstration in words and as HTML: two programs, the gap between simulation and drives, and what closed it."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from gecar.language.program import Program
from gecar.reality.compare.gap import Gap
from gecar.reality.compare.side_by_side import PLACE, Beside
from gecar.reality.verdict import Interval, Verdict
from gecar.report.gap import gap_lines, mean_and_spread
from gecar.report.units import quantities
from gecar.report.verdict import sizes_of
from gecar.report.verdict_page import picture_html
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot
from gecar.world.rollout import Outcome

HONEST = (
    "The “real” robot of this demonstration is simulated, too: by gecar, with faults that evolution and discovery are "
    "not told of. What gecar is worth on robots that it did not simulate is in docs/discover.md."
)
_HEAD = """<h1>A robot that is not its simulation</h1>
<p>First program: {first}<br>Second, evolved with what was found: {second}</p>
<p class='soft'>{honest}</p>
<p id='number'>{number}</p>"""
_STORY = """<div class='verdict'>
<h2>1. A program is evolved, in the simulation as it is known</h2>
{program}{drive}
<h2>2. The real robot drives it</h2>
<p>{first}</p>{gap}
<h2>3. gecar discover: what was left out?</h2>
<p>Learned from recordings of other driving; the drives above were set aside, and only judged by. At its top the page
plays them beside both simulations.</p>
<div class='wide'><table><tr><th>fault of the real robot</th><th>its size</th><th>found (95 % interval)</th></tr>
{faults}</table></div>
<details><summary>The whole verdict</summary>{verdict}</details>
<h2>4. Evolved again, for the robot that was found</h2>
{program_again}
<p>{second}</p>{gap_again}
<h2>The same, step by step</h2>
<div class='wide'><pre>{commands}</pre></div>
</div>"""


class Round(NamedTuple):
    """A program, and its simulation beside its drives on the real robot."""

    program: Program
    gap: Gap


class Concealed(NamedTuple):
    """A fault of the real robot: what it is, its size, and what was found of it."""

    title: str
    size: str
    found: str


def predicted_and_driven(each: Round) -> str:
    """Say in a sentence when a program was to arrive, and when it did."""
    found, trials = each.gap, each.gap.trials
    arrived = [trial.arrival_s for trial in trials if trial.arrived]
    predicted = f"{found.simulated_s:.2f} s" if found.outcome == Outcome.GOAL else "not to arrive"
    words = f"Predicted {predicted}"
    if not arrived:
        return f"{words}; driven, it did not arrive."
    driven = f"driven {mean_and_spread(arrived, 2)} s"
    if len(arrived) < len(trials):
        driven += f", with {len(arrived)} of {len(trials)} drives at GOAL"
    errors = [trial.error_pct for trial in trials if not np.isnan(trial.error_pct)]
    return f"{words}, {driven}{f': {np.mean(errors):+.1f} %' if errors else ''}."


def concealed(truth: Robot, verdict: Verdict) -> list[Concealed]:
    """Return the real robot's faults beside what was found of them; what was found and is no fault of it comes last."""
    found = {each.id: "; ".join(sizes_of(each, verdict)) for each in verdict.effects}
    minor = {each.id: f"too small to matter: {'; '.join(sizes_of(each, verdict))}" for each in verdict.minor}
    known = {**minor, **found}
    faults = [
        Concealed(BY_ID[effect].title, _size(effect, truth), known.get(effect, "not found"))
        for effect in truth.effects
    ]
    return faults + [
        Concealed(BY_ID[effect].title, "none", found[effect])
        for effect in found
        if effect not in truth.effects
    ]


def _size(effect: str, truth: Robot) -> str:
    exact = {
        p.label: Interval(*(truth.effects[effect][p.label],) * 3, p.unit)
        for p in BY_ID[effect].parameters
        if p.label in truth.effects[effect]
    }
    return "; ".join(f"{q.what} {q.now:.4g} {q.unit}".rstrip() for q in quantities(effect, exact, truth))


def demo_head(first: Round, second: Round, shown: Sequence[Beside]) -> str:
    """Return, as HTML, what stands above the drive that the page plays."""
    return _HEAD.format(
        first=_text(predicted_and_driven(first)),
        second=_text(predicted_and_driven(second)),
        honest=_text(HONEST),
        number=_apart(shown),
    )


def demo_article(
    first: Round,
    second: Round,
    faults: Iterable[Concealed],
    verdict_html: str,
    pictures: Sequence[bytes],
    commands: Sequence[str],
) -> str:
    """Return the story in four chapters, as HTML.

    Parameters
    ----------
    first, second
        The program evolved for the nominal robot, and the one for the robot found.
    faults
        What the real robot had, and what was found.
    verdict_html
        The verdict's own article.
    pictures
        PNG files: the first program's drive, its gap, and the second program's gap.
    commands
        What to type to do the same.
    """
    drive, gap, gap_again = pictures
    compared = "Ways, arrival times, and distance over time"
    return _STORY.format(
        program=_program(first),
        drive=picture_html(
            "Its drive in the simulation", drive, "The way, the sensor and the motors, by line"
        ),
        first=_text(" ".join(gap_lines(first.gap)[:2])),
        gap=picture_html("Prediction and drives", gap, compared),
        faults="".join(f"<tr>{''.join(f'<td>{_text(cell)}</td>' for cell in row)}</tr>" for row in faults),
        verdict=verdict_html,
        program_again=_program(second),
        second=_text(" ".join(gap_lines(second.gap)[:2])),
        gap_again=picture_html("Prediction and drives", gap_again, compared),
        commands=_text("\n".join(commands)),
    )


def _apart(shown: Sequence[Beside]) -> str:
    """Say how far replays keep from the drives set aside: on average, for a loop ends where it began."""
    drives = [each.apart(PLACE) for each in shown if each.set_aside and each.has(PLACE)]
    if not drives:
        return ""
    before, after = (np.mean([np.nanmean(drive[k]) for drive in drives]) for k in (1, 2))
    return (
        f"Its commands replayed, the simulation is off by <span class='was'><strong>{before:.0f} mm</strong></span> on "
        f"average; with what was found, by <span class='now'><strong>{after:.0f} mm</strong></span>."
    )


def _program(each: Round) -> str:
    return f"<div class='wide'><pre>{_text(each.program.source)}</pre></div>"


def _text(words: str) -> str:
    return html.escape(words)
