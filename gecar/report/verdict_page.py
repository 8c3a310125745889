"""A verdict as HTML: the first screen, the findings below it, and the statistics in a collapsed section."""

from __future__ import annotations

import base64
import csv
import html
import io
import math
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from gecar.reality.compare.choices import Choice
from gecar.reality.compare.side_by_side import (
    PLACE,
    READING,
    UNITS,
    WHEELS,
    Beside,
    measure_of,
    root_mean,
    side_by_side,
    typical,
)
from gecar.reality.verdict import Found, Invented, Minor, Verdict
from gecar.report.law import law_sentence
from gecar.report.units import amount
from gecar.report.verdict import (
    CHANNEL_WORDS,
    does,
    failure,
    in_units,
    limits,
    set_aside,
    sizes_of,
    title,
    unexplained,
)
from gecar.world.effects import BY_ID

_STYLE = """
.verdict{font:16px/1.5 system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;color:#1F2933;overflow-wrap:anywhere}
.verdict h2{font-size:1.15rem;margin:1.6rem 0 .4rem}.verdict h3{font-size:1rem;margin:1rem 0 .2rem}
.verdict p,.verdict ul{margin:.3rem 0}.verdict .soft{color:#5A6672;font-size:.88rem}
.verdict .bar{display:grid;grid-template-columns:minmax(9rem,18rem) minmax(0,1fr) 5rem;gap:.2rem .8rem;
align-items:center;margin:.25rem 0}
.verdict .bar i{display:block;height:14px;border-radius:4px;background:#8C96A0;min-width:2px}
.verdict .bar.taken i{background:#0072B2}.verdict .bar.none i{background:#D55E00}.verdict .bar.taken{font-weight:700}
.verdict .bar b{text-align:right;font-weight:inherit;font-variant-numeric:tabular-nums;white-space:nowrap}
.verdict .was strong{color:#B84E00}.verdict .now strong{color:#0072B2}
.verdict .wide{overflow-x:auto}.verdict .wide img{min-width:640px;max-width:860px;width:100%;height:auto;display:block}
.verdict table{border-collapse:collapse;font-size:.9rem}.verdict td,.verdict th{padding:.2rem .9rem .2rem 0;
text-align:left;border-bottom:1px solid #D8DEE4;vertical-align:top;overflow-wrap:normal}
.verdict details{margin:.6rem 0;border-top:1px solid #D8DEE4;padding-top:.6rem}
.verdict summary{cursor:pointer;font-weight:600;min-height:32px}
.verdict .fails{border-left:6px solid #D55E00;padding-left:.8rem}
@media (max-width:560px){.verdict .bar{grid-template-columns:minmax(0,1fr) 5rem}.verdict .bar span{grid-column:1/3}}
"""
_CAPTIONS = {
    "gap": "The gap on held-out recordings", "where": "In which motion", "traces": "Measured, before and after",
    "map": "At which place", "tried": "Candidates, and the error each leaves", "law": "The law that was written",
    "law_map": "Where the law acts",
}  # fmt: skip
NO_TABLES: Mapping[str, str] = MappingProxyType({})
_KINDS = {PLACE: "", WHEELS: " of a wheel's turn", READING: " of a reading"}


def verdict_html(verdict: Verdict, pictures: Mapping[str, bytes]) -> str:
    """Return a verdict for a notebook, or a page of one's own: words, lists and pictures (PNG files by name)."""
    beside = side_by_side(verdict, only_set_aside=True) if verdict.evidence is not None else ()
    shown = "".join(picture_of(name, png) for name, png in pictures.items())
    return f"<div class='verdict'>{first_screen(verdict, beside)}{shown}</div>{article(verdict)}"


def first_screen(verdict: Verdict, shown: Sequence[Beside]) -> str:
    """Return the first screen: one sentence, and one number if recordings with their simulations are given."""
    parts = [f"<p class='soft'>{_text(verdict.case)}</p>", f"<h1>{_text(title(verdict))}</h1>"]
    if verdict.judgement.failed:
        parts.append(f"<p class='fails'>{_text(failure(verdict))}</p>")
    number = the_number(verdict, shown)
    parts += [f"<p id='number'>{number}</p>"] if number else []
    return "\n".join(parts)


def the_number(verdict: Verdict, shown: Sequence[Beside]) -> str:
    """Return, as HTML, the simulation's error in a typical held-out recording, before and now."""
    measure = measure_of(verdict) if shown else ""
    run = typical(shown, measure)
    if run is None:
        return ""
    off, unit = run.off(measure), UNITS[measure]
    was, now, noise = (f"<strong>{_text(amount(v, unit))}</strong>" for v in off)
    when = f"over {run.duration_s - run.from_s:.0f} s (root mean square)"
    noise_words = f"{'the camera' if measure == PLACE else 'the sensor'}'s noise is {noise}"
    where = (
        f"<span class='soft'>{_text(run.name)}, not used for the fit{_turned(run, measure, verdict)}</span>"
    )
    if not verdict.found:
        return f"Off by <span class='was'>{was}</span>{_KINDS[measure]} {when}; {noise_words}. {where}"
    return (
        f"Off by <span class='was'>{was}</span>{_KINDS[measure]} {when}; now "
        f"<span class='now'>{now}</span>; {noise_words}. {where}"
    )


def _turned(run: Beside, measure: str, verdict: Verdict) -> str:
    """Say the same in degrees where the number is in millimetres, and the other way round."""
    if measure == PLACE and "heading" in run.curves:
        one = run.curves["heading"]
        told = one.t_s >= run.from_s
        was, now = (root_mean((one.measured - s)[told]) for s in (one.before, one.after))
        unit = "deg"
    elif measure == WHEELS:
        mm = math.radians(1e3) * verdict.robot.body.wheel_radius
        was, now = (mm * v for v in run.off(WHEELS)[:2])
        unit = "mm"
    else:
        return ""
    words = f"{amount(was, unit)}" if not verdict.found else f"{amount(was, unit)}, now {amount(now, unit)}"
    return f"; {'heading' if unit == 'deg' else 'rolled'}: {words}"


def article(
    verdict: Verdict,
    made: Sequence[Choice] = (),
    tables: Mapping[str, str] = NO_TABLES,
    shown: str = "",
    laws: str = "",
) -> str:
    """Return what follows: what was found, the other candidates, what to record next, and how it was found.

    Parameters
    ----------
    verdict
        What to tell.
    made
        What candidates leave.
    tables
        The data behind pictures as CSV, by name, to be downloaded.
    shown
        HTML of pictures, for the statistics.
    laws
        HTML of pictures of the laws.
    """
    commands = _csv_link("next_recording", _next(verdict), "The commands")
    parts = [
        _found(verdict, laws),
        _why(made),
        f"<h2>What to record next</h2><p>{_text(_capital(_in_words(verdict.next_recording.why)))}. {commands}</p>",
        _how(verdict, tables, shown),
    ]
    return f"<div class='verdict'><style>{_STYLE}</style>{''.join(parts)}</div>"


def _text(words: str) -> str:
    return html.escape(words)


def _in_words(sentence: str) -> str:
    """Return a sentence with effects by their titles, in quotation marks, instead of by their ids."""
    return re.sub(r"\b[a-z]+(?:_[a-z]+)+\b|\bbacklash\b", _quoted_title, sentence)


def _quoted_title(found: re.Match[str]) -> str:
    name = found.group()
    return f"“{BY_ID[name].title}”" if name in BY_ID else name


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _found(verdict: Verdict, laws: str) -> str:
    parts = []
    if verdict.found:
        cards = [_card(found, verdict) for found in verdict.effects] + [_law(law) for law in verdict.invented]
        parts.append("<h2>What was found</h2>" + "".join(cards) + laws)
    if verdict.residual.material or verdict.verdict.endswith("unexplained"):
        parts.append(f"<h2>The remaining error</h2><p>{_text(unexplained(verdict))}</p>")
    if verdict.minor:
        rows = "".join(f"<li>{_one(minor, verdict)}</li>" for minor in verdict.minor)
        parts.append(f"<h2>Visible, but too small to be named</h2><ul>{rows}</ul>")
    notes = "".join(f"<li>{_text(_in_words(note))}</li>" for note in verdict.notes)
    return "".join(parts) + (f"<h2>Notes</h2><ul>{notes}</ul>" if notes else "")


def _card(found: Found, verdict: Verdict) -> str:
    doubt = ""
    if found.alternatives:
        others = " or ".join(BY_ID[other].title for other in found.alternatives)
        doubt = f"<p>These recordings cannot distinguish it from: {_text(others)}.</p>"
    return (
        f"<h3>{_text(_capital(BY_ID[found.id].title))}</h3><p>{_one(found, verdict, named=False)}</p>{doubt}"
    )


def _law(law: Invented) -> str:
    """Return a law that was written: its name, its formula, and in words what is known of it."""
    words = law_sentence(law).partition(": ")[2].removeprefix(law.term.typeset).lstrip(" ;.")
    return (
        f"<h3>{_text(_capital(law.looks_like))}</h3><p><strong>{_text(law.term.typeset)}</strong><br>"
        f"<span class='soft'>{_text(words)}</span></p>"
    )


def _one(found: Found | Minor, verdict: Verdict, named: bool = True) -> str:
    name = f"{_capital(BY_ID[found.id].title)}: " if named else ""
    sizes = "; ".join(sizes_of(found, verdict))
    size = f"{_capital(does(found.size, verdict))}."
    return f"{_text(name + _capital(sizes))}.<br><span class='soft'>{_text(size)}</span>"


def _why(made: Sequence[Choice]) -> str:
    """Return the errors that chosen effects and runners-up leave, as bars."""
    if not made:
        return ""
    taken = any(rival.taken for choice in made for rival in choice.rivals)
    parts = [f"<h2>{'Compared with other effects' if taken else 'Effects of the catalogue'}</h2>"]
    parts.append(
        "<p class='soft'>The simulation's error on held-out recordings (root mean square), "
        "with each candidate fitted in turn: shorter is better.</p>"
    )
    parts += [_bars(choice, len(made) == 1) for choice in made]
    rows = [["choice", "candidate", "left", "unit", "taken"]]
    for number, choice in enumerate(made, start=1):
        unit = UNITS[choice.measure]
        rows.append([str(number), "none", f"{choice.before:.4g}", unit, ""])
        rows += [
            [str(number), r.effect, f"{r.left:.4g}", unit, "yes" if r.taken else ""] for r in choice.rivals
        ]
    return "".join(parts) + f"<p>{_csv_link('why', _csv(rows))}</p>"


def _bars(choice: Choice, alone: bool) -> str:
    """Return one choice as bars, the longest first."""
    unit, winner = UNITS[choice.measure], next((r for r in choice.rivals if r.taken), None)
    bars = [("none", "nothing added" if alone else "without it", choice.before)]
    bars += [("taken" if r.taken else "", BY_ID[r.effect].title, r.left) for r in choice.telling]
    most = max(left for *_, left in bars) or 1.0
    parts = []
    if winner and not alone:
        parts.append(f"<h3>{_text(_capital(BY_ID[winner.effect].title))}, compared with the others</h3>")
    for kind, name, left in sorted(bars, key=lambda bar: -bar[2]):
        parts.append(
            f"<div class='bar {kind}'><span>{_text(name)}</span><i style='width:{100.0 * left / most:.1f}%'></i>"
            f"<b>{_text(amount(left, unit))}</b></div>"
        )
    if winner and winner.left >= choice.before:
        parts.append(
            "<p class='soft'>At the end of these recordings it does not help; "
            "it was chosen for what it gains earlier.</p>"
        )
    elif winner and any(rival.left < winner.left for rival in choice.telling):
        parts.append(
            "<p class='soft'>A shorter bar gained less where it was fitted, or not as much in each recording.</p>"
        )
    faint = [rival for rival in choice.rivals if rival not in choice.telling]
    if faint:
        best = min(faint, key=lambda rival: rival.left)
        words = f"The best of the {choice.tried - len(choice.telling)} other candidates"
        leaves = f"{BY_ID[best.effect].title}, leaves {amount(best.left, unit)}"
        parts.append(f"<p class='soft'>{_text(words)}, {_text(leaves)}.</p>")
    elif choice.tried > len(choice.rivals):
        parts.append(f"<p class='soft'>{choice.tried - len(choice.rivals)} more candidates gained less.</p>")
    return "".join(parts)


def _how(verdict: Verdict, tables: Mapping[str, str], shown: str) -> str:
    """Return the statistics, in a collapsed section."""
    judged = [
        [
            CHANNEL_WORDS[name.rsplit("_", 1)[0]],
            *in_units(name, m),
            *(f"{v:.4f}" for v in m.as_json().values()),
        ]
        for name, m in verdict.judgement.channels.items()
    ]
    evidence = [
        [f.id, f"{f.holdout_gain:.4g}", f"{f.null_95:.3g}", f"{f.p:.3g}"]
        for f in verdict.effects
    ]  # fmt: skip
    places = [
        [CHANNEL_WORDS.get(p.channel, p.channel), p.regime, f"{p.share:.0%}", f"{p.p:.3f}", p.recording,
         ", ".join(f"{a:.1f}-{b:.1f}" for a, b in p.times_s[:6])]
        for p in verdict.located
    ]  # fmt: skip
    white = "passes" if verdict.residual.white else "does not pass"
    closed = verdict.judgement.gap_closed
    gap = "" if closed is None or verdict.verdict == "nothing" else f" Gap closed: {closed:.2f}."
    judged_on = f"Judged on {set_aside(verdict)}; fitted on {', '.join(verdict.fitted_on)}.{gap}"
    size = does(verdict.residual.size, verdict)
    left = f"The remaining error {white} for white noise (p = {verdict.residual.p:.3g}), and {size}."
    heads = ["channel", "before", "now", "noise alone", "NRMSE before", "now", "noise alone"]
    links = " · ".join(_csv_link(name, text, f"{name}.csv") for name, text in tables.items())
    parts = [
        _table("Error on held-out recordings: whole replays, open loop, root mean square", heads, judged),
        f"<p class='soft'>{_text(judged_on)} {_text(left)}</p>",
        _table("Evidence", ["effect", "gain, held out", "largest gain by chance (95 %)", "p"], evidence),
        _table(
            "Where the error occurs", ["channel", "motion", "share", "p", "recording", "times [s]"], places
        ),
        shown,
        "".join(f"<p>{_text(line)}</p>" for line in limits(verdict)),
        f"<p>Data behind the pictures: {links}</p>" if links else "",
    ]
    return f"<details><summary>How this was found</summary>{''.join(parts)}</details>"


def _table(name: str, head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return ""
    top = "".join(f"<th>{_text(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<h3>{_text(name)}</h3><div class='wide'><table><tr>{top}</tr>{body}</table></div>"


def picture_html(name: str, png: bytes, words: str) -> str:
    """Return a picture inside a page, with what it shows in words."""
    source = f"data:image/png;base64,{base64.b64encode(png).decode()}"
    image = f"<img alt='{html.escape(words)}' src='{source}'>"
    return f"<h3>{_text(name)}</h3><div class='wide'>{image}</div>"


def picture_of(name: str, png: bytes) -> str:
    """Return one of a verdict's pictures inside a page, under its title."""
    return picture_html(_CAPTIONS.get(name, name), png, _CAPTIONS.get(name, name))


def _next(verdict: Verdict) -> str:
    rows = [["t_s", "left_duty_pct", "right_duty_pct"]]
    return _csv(rows + [[f"{v:g}" for v in row] for row in verdict.next_recording.commands])


def _csv(rows: list[list[str]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def _csv_link(name: str, text: str, words: str = "Data") -> str:
    """Return a link that saves data inside the page as a file."""
    data = base64.b64encode(text.encode()).decode()
    return f"<a download='{name}.csv' href='data:text/csv;base64,{data}'>{_text(words)} (CSV)</a>"
