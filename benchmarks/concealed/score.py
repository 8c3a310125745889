"""Score a folder of verdicts against the sealed labels."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.concealed.cases import KINDS, broken_seals
from benchmarks.concealed.judging import Judged, judge
from benchmarks.concealed.plan import read_label
from benchmarks.concealed.sightings import sight_all

STRONG = 10.0  # d': from here on a single effect has to be named
PLAIN = 30.0  # d': from here on what matters has to be named, whatever else is small


@dataclass(frozen=True)
class Figure:
    """One line of the table: what was measured, out of how many, and what was asked for."""

    words: str
    value: float
    count: int
    asked: str
    low: float = math.nan
    high: float = math.nan


def score(out: Path, verdicts: Path, workers: int) -> list[Judged]:
    """Open the labels of every case that has a verdict, and judge.

    Parameters
    ----------
    out
        Holds ``cases/``, ``sealed/`` and ``manifest.sha256``.
    verdicts
        Holds ``NAME/verdict.json`` for any number of cases.
    workers
        Processes.

    Returns
    -------
    list[Judged]
        In the order of the cases' names.

    Raises
    ------
    ValueError
        If a sealed label, or a recording, is not what it was when it was hashed; or there is no verdict.
    """
    names = sorted(path.parent.name for path in verdicts.glob("*/verdict.json"))
    names = [name for name in names if (out / "sealed" / name).is_dir()]
    broken = broken_seals(out)
    if broken or not names:
        message = (
            f"changed since sealed: {', '.join(broken[:5])}"
            if broken
            else f"{verdicts}: no verdict of these cases"
        )
        raise ValueError(message)
    sights = sight_all(out, names, out / "sights.json", workers)
    return [judge(read_label(out, name), _verdict(verdicts, name), sights[name]) for name in names]


def manifest_hash(out: Path) -> str:
    """Give the SHA-256 of the manifest the cases were sealed with."""
    return hashlib.sha256((out / "manifest.sha256").read_bytes()).hexdigest()


def figures(judged: Sequence[Judged]) -> list[Figure]:
    """Boil judged cases down to the table of ``discovery.md``.

    Parameters
    ----------
    judged
        As :func:`score` returns them.

    Returns
    -------
    list[Figure]
        With 95 % intervals (Wilson) where the figure is a share of cases.
    """
    of = {kind: [one for one in judged if one.kind == kind] for kind in KINDS}
    strong = [one for one in of["single"] if loudness(one) >= STRONG]
    plain = [one for one in of["single"] if loudness(one) >= PLAIN and one.material]
    several = of["double"] + of["triple"]
    named = [one for one in of["single"] + several for _ in one.named]
    right = sum(len(one.hits) for one in of["single"] + several)
    found = [one for one in strong if one.hits]
    figures = [
        _share(
            "single, d' >= 30 and material: named, and nothing else", [one.exact for one in plain], ">= 0.90"
        ),
        _share("single, d' >= 10: named right, or in a set", [bool(one.hits) for one in strong], ""),
        _share("the same, and nothing else named", [one.exact for one in strong], ""),
        _share(
            "single, d' < 10: named right", [bool(one.hits) for one in of["single"] if one not in strong], ""
        ),
        _share(
            "names given, single and several, that are right",
            [True] * right + [False] * (len(named) - right),
            ">= 0.97",
        ),
        _share("nothing concealed: names anything", [bool(one.named) for one in of["none"]], "<= 0.02"),
        *(
            _share(f"nothing concealed: says {word}", [one.verdict == word for one in of["none"]], "")
            for word in sorted({one.verdict for one in of["none"]})
        ),
        _share("outside the catalogue: abstains", [one.abstained for one in of["outside"]], ""),
        _share(
            "the same, of what is material",
            [one.abstained for one in of["outside"] if one.all_material],
            "",
        ),
        _share(
            "outside the catalogue: gives a wrong name", [bool(one.named) for one in of["outside"]], "<= 0.03"
        ),
        _share(
            "single, no camera: named right, or said to be invisible",
            [bool(one.hits) or one.invisible for one in of["single"] if not one.camera],
            ">= 0.90",
        ),
        _share("two at once: exact set", [one.exact for one in of["double"]], ">= 0.85"),
        _share(
            "the same, where both are material beside each other",
            [one.exact for one in of["double"] if one.all_material],
            "",
        ),
        _share("two at once: at least one right", [bool(one.hits) for one in of["double"]], ""),
        _share("three at once: exact set", [one.exact for one in of["triple"]], ">= 0.65"),
        _share(
            "the same, where all are material beside each other",
            [one.exact for one in of["triple"] if one.all_material],
            "",
        ),
        _share("mixed: effect named, rest unexplained", [one.half_explained for one in of["mixed"]], ""),
        _share(
            "the same, where both are material",
            [one.half_explained for one in of["mixed"] if one.all_material],
            ">= 0.70",
        ),
        _share("mixed: effect named", [bool(one.hits) for one in of["mixed"]], ">= 0.85"),
        _share("mixed: gives a wrong name", [one.wrong > 0 for one in of["mixed"]], "<= 0.05"),
        _share(
            "95 % intervals cover", [held for one in judged for held in one.covered.values()], "0.92-0.98"
        ),
        _middle("held-out gap closed, named right (median)", [one.gap_closed for one in found], ""),
        _middle(
            "the same over all channels, those of noise alone too (median)",
            [one.gap_closed_over_all for one in found],
            "",
        ),
        _middle("held-out gap closed, all cases (median)", [one.gap_closed for one in judged], ">= 0.90"),
        _share("located: channel right", [one.channel_right for one in strong + of["outside"]], ">= 0.95"),
        _middle(
            "located: regime overlap (median)",
            [one.regime_overlap for one in strong + of["outside"]],
            ">= 0.75",
        ),
    ]
    return [figure for figure in figures if figure.count or figure.asked]


def loudness(one: Judged) -> float:
    """Give a case's d', of the quieter effect where there are two."""
    return min(one.d_prime.values(), default=0.0)


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Give the 95 % interval of a share (Wilson 1927), bounded away from certainty however few the cases."""
    if count == 0:
        return math.nan, math.nan
    z, share = 1.96, hits / count
    middle = share + z * z / (2 * count)
    half = z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    scale = 1 + z * z / count
    return (middle - half) / scale, (middle + half) / scale


def _share(words: str, answers: Iterable[bool | None], asked: str) -> Figure:
    said = [answer for answer in answers if answer is not None]
    hits = sum(said)
    return Figure(words, hits / len(said) if said else math.nan, len(said), asked, *wilson(hits, len(said)))


def _middle(words: str, values: Iterable[float], asked: str) -> Figure:
    said = [value for value in values if not math.isnan(value)]
    return Figure(words, median(said) if said else math.nan, len(said), asked)


def _verdict(verdicts: Path, name: str) -> dict[str, object]:
    verdict: dict[str, object] = json.loads((verdicts / name / "verdict.json").read_text(encoding="utf-8"))
    return verdict
