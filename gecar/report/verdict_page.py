"""The verdict as one self-contained HTML page: words, tables, and pictures inside."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping

from gecar.reality.verdict import Verdict
from gecar.report.verdict import limits, sentences
from gecar.world.effects import BY_ID

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;color:#1F2933;max-width:60rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}img{max-width:100%;height:auto}
table{border-collapse:collapse;font-size:.9rem}td,th{padding:.25rem .8rem .25rem 0;text-align:left;
border-bottom:1px solid #D8DEE4}td.n{text-align:right;font-variant-numeric:tabular-nums}
"""
_CAPTIONS = {
    "gap": "The gap on recordings set aside", "where": "In what motion", "traces": "When", "map": "At what place",
    "tried": "What was tried",
}  # fmt: skip


def verdict_page(verdict: Verdict, pictures: Mapping[str, bytes]) -> str:
    """Return a verdict as HTML.

    Parameters
    ----------
    verdict
        What to tell.
    pictures
        PNG files by name.
    """
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        f"<meta name='viewport' content='width=device-width'><title>{_text(verdict.case)}</title>",
        f"<style>{_STYLE}</style></head><body>{verdict_html(verdict, pictures)}</body></html>\n",
    ]
    return "\n".join(parts)


def verdict_html(verdict: Verdict, pictures: Mapping[str, bytes]) -> str:
    """Return what stands on a verdict's page, for a page of one's own; parameters as `verdict_page` has them."""
    first, *rest = sentences(verdict)
    parts = [
        f"<h1>{_text(verdict.case)}: {_text(first)}</h1>",
        *(f"<p>{_text(line)}</p>" for line in rest),
        _effects(verdict),
        _channels(verdict),
        _places(verdict),
        _limits(verdict),
        *(_picture(name, png) for name, png in pictures.items()),
        f"<p>Fitted on {_text(', '.join(verdict.fitted_on))}.</p>",
    ]
    return "\n".join(parts)


def _text(words: str) -> str:
    return html.escape(words)


def _table(title: str, head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return ""
    top = "".join(f"<th>{_text(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<h2>{_text(title)}</h2><table><tr>{top}</tr>{body}</table>"


def _effects(verdict: Verdict) -> str:
    rows = [
        [
            BY_ID[f.id].title,
            label,
            f"{i.value:.4g}",
            f"{i.low:.4g} to {i.high:.4g}",
            i.unit,
            " or ".join(f.alternatives),
        ]
        for f in verdict.effects
        for label, i in f.parameters.items()
    ]
    minor = [
        [BY_ID[m.id].title, label, f"{i.value:.4g}", f"{i.low:.4g} to {i.high:.4g}", i.unit]
        for m in verdict.minor
        for label, i in m.parameters.items()
    ]
    heads = ["effect", "parameter", "value", "95 %", "unit", "or"]
    small = _table("Visible, and too small to matter", heads[:5], minor)
    return _table("What is missing", heads, rows) + small


def _channels(verdict: Verdict) -> str:
    channels = verdict.judgement.channels
    rows = [[name, f"{m.before:.4f}", f"{m.after:.4f}", f"{m.floor:.4f}"] for name, m in channels.items()]
    return _table("NRMSE, whole replays, open loop", ["channel", "before", "after", "noise alone"], rows)


def _places(verdict: Verdict) -> str:
    rows = [
        [
            p.channel,
            p.regime,
            f"{p.share:.0%}",
            f"{p.p:.3f}",
            p.recording,
            ", ".join(f"{a:.1f}-{b:.1f}" for a, b in p.times_s[:6]),
        ]
        for p in verdict.located
    ]
    return _table("Where it shows", ["channel", "motion", "share", "p", "recording", "times [s]"], rows)


def _limits(verdict: Verdict) -> str:
    """Return what could have been seen, folded away."""
    lines = "".join(f"<p>{_text(line)}</p>" for line in limits(verdict))
    return (
        f"<details><summary>What these recordings could have shown</summary>{lines}</details>"
        if lines
        else ""
    )


def _picture(name: str, png: bytes) -> str:
    data = base64.b64encode(png).decode()
    caption = _text(_CAPTIONS.get(name, name))
    return f"<h2>{caption}</h2><img alt='{caption}' src='data:image/png;base64,{data}'>"
