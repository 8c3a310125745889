"""An examination's results: a Markdown report with the comparators beside `gecar`, its picture, a CSV row a case."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from benchmarks.concealed.exam import COMPARATORS, GECAR, Terms
from benchmarks.concealed.judging import Judged
from benchmarks.concealed.score import loudness, manifest_hash, score
from benchmarks.concealed.tables import draw, report

WORDS = {
    GECAR: "`gecar discover`",
    "bic": "forward selection by BIC",
    "everything": "all effects fitted at once",
    "sparse": "sparse regression on differentiated residuals (SINDy)",
    "no_discrepancy": "`gecar` without model discrepancy",
    "no_whitening": "`gecar` without whitening",
    "no_null": "`gecar` without the null",
    "no_refit": "`gecar` without refits (screening alone)",
}
_COLUMNS = (
    "tool", "case", "world", "kind", "concealed", "d_prime", "verdict", "said", "right", "channel_right",
    "regime_overlap", "gap_closed", "intervals_right", "intervals", "cpu_s",
)  # fmt: skip


def write_results(out: Path, terms: Terms, path: Path, workers: int) -> None:
    """Open the labels of all cases that have a verdict, and write ``path``, and a PNG and a CSV of the same stem.

    Parameters
    ----------
    out
        The examination's folder.
    terms
        What it was begun with.
    path
        Of the Markdown file.
    workers
        Processes.
    """
    tools = [tool for tool in (GECAR, *COMPARATORS) if any((out / "verdicts" / tool).glob("*/verdict.json"))]
    judged = {tool: score(out, out / "verdicts" / tool, workers) for tool in tools}
    times = {tool: times_taken(out / "outcomes" / f"{tool}.jsonl") for tool in tools}
    sealed = sum(1 for folder in (out / "sealed").iterdir() if folder.is_dir())
    path.parent.mkdir(parents=True, exist_ok=True)
    text = report(judged.get(GECAR, []), "Concealed cases: results", manifest_hash(out), sealed)
    head, rest = text.split("\n## ", 1)
    parts = [head, _about(terms, times.get(GECAR, {})), "## Beside others\n", _comparison(judged, times)]
    path.write_text("\n".join([*parts, "## " + rest]), encoding="utf-8", newline="\n")
    if judged.get(GECAR):
        draw(judged[GECAR], path.with_suffix(".png"))
    _write_rows(path.with_suffix(".csv"), judged, times)


def times_taken(journal: Path) -> dict[str, float]:
    """Read the processor time of each case [s]; nan where it ended without a verdict. A case's last line counts."""
    if not journal.exists():
        return {}
    lines = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines() if line]
    return {line["case"]: float(line["cpu_s"]) if line["verdict"] else math.nan for line in lines}


def _about(terms: Terms, times: Mapping[str, float]) -> str:
    kinds = {"none": "nothing", "single": "one effect", "double": "two", "triple": "three", "mixed": "mixed"}
    kinds["outside"] = "outside"
    planned = "; ".join(
        f"{world}: " + ", ".join(f"{getattr(each, kind)} {words}" for kind, words in kinds.items())
        for world, each in terms.counts.items()
    )
    known = [time for time in times.values() if not math.isnan(time)]
    pace = f"{median(known):.0f} s of processor time a case (median)" if known else "-"
    return (
        f"Seed {terms.seed}; planned: {planned}. `gecar discover` took {pace}; {len(times) - len(known)} cases ended "
        "without a verdict. Made by `make concealed`; the CSV file of the same name has a row a case.\n"
    )


def _comparison(judged: Mapping[str, Sequence[Judged]], times: Mapping[str, Mapping[str, float]]) -> str:
    """Tabulate all tools on the cases all of them have seen."""
    seen = [frozenset(one.name for one in each) for each in judged.values()]
    common = frozenset.intersection(*seen) if seen else frozenset()
    text = f"On the {len(common)} cases that all of them have seen. Right: all that is concealed is named, and nothing "
    text += (
        "else; wrong: a name that is not there; missed: the rest. Those that can not abstain never do.\n\n"
    )
    text += "| tool | one effect: right | wrong | missed | two: right | wrong | missed | nothing: names something "
    text += "| outside: abstains | names something | processor s a case |\n" + "|---" * 11 + "|\n"
    for tool, cases in judged.items():
        of = {k: [c for c in cases if c.kind == k and c.name in common] for k in _KINDS}
        cells = [
            *_thirds(of["single"]),
            *_thirds(of["double"]),
            _of(of["none"], [bool(c.named) for c in of["none"]]),
        ]
        cells += [_of(of["outside"], [c.abstained for c in of["outside"]])]
        cells += [_of(of["outside"], [bool(c.named) for c in of["outside"]])]
        spent = [times[tool][name] for name in common if not math.isnan(times[tool].get(name, math.nan))]
        text += f"| {WORDS[tool]} | {' | '.join(cells)} | {median(spent) if spent else math.nan:.0f} |\n"
    return text


_KINDS = ("none", "single", "double", "outside")


def _thirds(cases: Sequence[Judged]) -> list[str]:
    right, wrong = [c.exact for c in cases], [c.wrong > 0 for c in cases]
    missed = [not (a or b) for a, b in zip(right, wrong, strict=True)]
    return [_of(cases, right), _of(cases, wrong), _of(cases, missed)]


def _of(cases: Sequence[Judged], answers: Sequence[bool]) -> str:
    return f"{sum(answers)} of {len(cases)}"


def _write_rows(
    path: Path, judged: Mapping[str, Sequence[Judged]], times: Mapping[str, Mapping[str, float]]
) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(_COLUMNS)
        for tool, cases in judged.items():
            for one in cases:
                rows.writerow([tool, *_row(one), times[tool].get(one.name, "")])


def _row(one: Judged) -> list[object]:
    said = "; ".join(" or ".join(sorted(names)) for names in one.named)
    numbers = ["" if math.isnan(n) else round(n, 3) for n in (one.regime_overlap, one.gap_closed)]
    channel = "" if one.channel_right is None else int(one.channel_right)
    loud = round(loudness(one), 1)
    return [
        one.name, one.world, one.kind, " + ".join(one.truth), loud, one.verdict, said, int(one.right), channel,
        *numbers, sum(one.covered.values()), len(one.covered),
    ]  # fmt: skip
