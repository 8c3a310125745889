"""Write scores down: a Markdown report and a picture of the confusion matrix."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Picture

from benchmarks.concealed.effects import EFFECTS
from benchmarks.concealed.judging import Judged
from benchmarks.concealed.kinds import ALL_OUTSIDE
from benchmarks.concealed.score import Figure, figures, loudness

NOTHING, UNEXPLAINED = "(nothing)", "(unexplained)"
_LONE = ("none", "single", "outside")
_BANDS = (0.0, 5.0, 10.0, 30.0, 100.0, 300.0, 1000.0, math.inf)


def report(judged: Sequence[Judged], title: str, source: str, sealed: int) -> str:
    """Write the scores as Markdown.

    Parameters
    ----------
    judged
        As :func:`benchmarks.concealed.score.score` returns them.
    title
        Whose verdicts these are.
    source
        Hash of the manifest the cases were sealed with.
    sealed
        How many cases it holds; those without a verdict are not scored, so their number is stated.

    Returns
    -------
    str
    """
    about = f"{len(judged)} of {sealed} sealed cases have a verdict; manifest {source}"
    parts = [f"# {title}\n\n{about}\n", _figure_table(figures(judged))]
    worlds = sorted({one.world for one in judged})
    if len(worlds) > 1:
        for world in worlds:
            inside = [one for one in judged if one.world == world]
            parts += [f"## In the {world} world\n", _figure_table(figures(inside)), _band_table(inside)]
    parts += ["## By loudness\n", _band_table(judged), "## By effect\n", _effect_table(judged)]
    parts += [
        "## Outside the catalogue\n",
        _outside_table(judged),
        "## Confusion\n",
        _confusion_table(judged),
    ]
    parts += ["## What went wrong\n", _mistakes(judged)]
    return "\n".join(parts)


def confusion(judged: Sequence[Judged]) -> dict[str, Counter[str]]:
    """Count what was said for what was there.

    Parameters
    ----------
    judged
        As :func:`benchmarks.concealed.score.score` returns them; cases with several things are left out.

    Returns
    -------
    dict[str, Counter[str]]
        By truth (effect, kind outside the catalogue, or ``(nothing)``): how often each name came first in a set; a
        set that holds the truth counts as the truth. Cases without names count as nothing or unexplained.
    """
    said: dict[str, Counter[str]] = defaultdict(Counter)
    for one in judged:
        if one.kind in _LONE:
            truth = one.truth[0] if one.truth else NOTHING
            said[truth].update(_names(one))
    return said


def draw(judged: Sequence[Judged], path: Path) -> None:
    """Draw the confusion matrix.

    Parameters
    ----------
    judged
        As for :func:`confusion`.
    path
        Of the PNG file.
    """
    said = confusion(judged)
    rows = [truth for truth in (*EFFECTS, NOTHING, *ALL_OUTSIDE) if truth in said]
    columns = [
        name
        for name in (*EFFECTS, NOTHING, UNEXPLAINED)
        if name in rows or any(name in said[r] for r in rows)
    ]
    shares = np.array([[said[row][column] / max(said[row].total(), 1) for column in columns] for row in rows])
    picture = Picture(figsize=(3.5 + 0.24 * len(columns), 2.5 + 0.24 * len(rows)), layout="constrained")
    FigureCanvasAgg(picture)
    axes = picture.subplots()
    image = axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), [f"{row} ({said[row].total()})" for row in rows], fontsize=7)
    axes.set_xlabel("said")
    axes.set_ylabel("concealed")
    picture.colorbar(image, ax=axes, shrink=0.5, label="share")
    picture.savefig(path, dpi=150)


def _names(one: Judged) -> list[str]:
    if not one.named:
        return [UNEXPLAINED if one.abstained else NOTHING]
    return [next((t for t in one.truth if t in names and t in one.hits), min(names)) for names in one.named]


def _figure_table(lines: Sequence[Figure]) -> str:
    head = "| figure | reached | 95 % interval | of | asked |\n|---|---|---|---|---|\n"
    body = (
        f"| {one.words} | {_number(one.value)} | {_range(one)} | {one.count} | {one.asked} |\n"
        for one in lines
    )
    return head + "".join(body)


def _band_table(judged: Sequence[Judged]) -> str:
    text = "| d' | single | named right | nothing else |\n|---|---|---|---|\n"
    for low, high in pairwise(_BANDS):
        band = [one for one in judged if one.kind == "single" and low <= loudness(one) < high]
        if band:
            right, exact = sum(bool(one.hits) for one in band), sum(one.exact for one in band)
            text += f"| {low:g}-{high:g} | {len(band)} | {right} | {exact} |\n"
    return text


def _effect_table(judged: Sequence[Judged]) -> str:
    text = "| effect | single | named right | intervals cover | d' |\n|---|---|---|---|---|\n"
    for effect in EFFECTS:
        cases = [one for one in judged if one.kind == "single" and one.truth == (effect,)]
        if cases:
            held = [ok for one in cases for ok in one.covered.values()]
            sizes = sorted(loudness(one) for one in cases)
            right = sum(bool(one.hits) for one in cases)
            text += f"| `{effect}` | {len(cases)} | {right} | {sum(held)} of {len(held)} "
            text += f"| {sizes[0]:.0f}-{sizes[-1]:.0f} |\n"
    return text


def _outside_table(judged: Sequence[Judged]) -> str:
    text = "| kind | cases | abstains | names something | d' |\n|---|---|---|---|---|\n"
    for kind in ALL_OUTSIDE:
        cases = [one for one in judged if one.kind == "outside" and one.truth == (kind,)]
        if cases:
            sizes = sorted(loudness(one) for one in cases)
            abstained, named = sum(one.abstained for one in cases), sum(bool(one.named) for one in cases)
            text += f"| `{kind}` | {len(cases)} | {abstained} | {named} | {sizes[0]:.0f}-{sizes[-1]:.0f} |\n"
    return text


def _confusion_table(judged: Sequence[Judged]) -> str:
    text = "| concealed | said |\n|---|---|\n"
    for truth, said in confusion(judged).items():
        text += f"| {truth} | {', '.join(f'{name} {times}' for name, times in said.most_common())} |\n"
    return text


def _mistakes(judged: Sequence[Judged]) -> str:
    text = "| case | concealed | said | d' |\n|---|---|---|---|\n"
    for one in judged:
        if not one.right:
            said = (
                "; ".join(" or ".join(sorted(names)) for names in one.named) or one.verdict or "(no verdict)"
            )
            sizes = ", ".join(f"{size:.0f}" for size in one.d_prime.values())
            text += f"| {one.name} | {', '.join(one.truth) or NOTHING} | {said} | {sizes} |\n"
    return text


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3f}"


def _range(one: Figure) -> str:
    return "" if math.isnan(one.low) else f"{one.low:.2f}-{one.high:.2f}"
