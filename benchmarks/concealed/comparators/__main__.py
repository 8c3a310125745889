"""``python -m benchmarks.concealed.comparators NAME CASE --out OUT``: one comparator's verdict on one case."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.concealed.comparators.methods import METHODS, changed
from benchmarks.concealed.comparators.sparse import sparse_regression
from gecar.files import json_text, write_whole
from gecar.reality import discovery
from gecar.reality.recordings.recording import Case, read_case


def main() -> None:
    """Write ``OUT/verdict.json`` in the form of `gecar discover`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.concealed.comparators", description=__doc__)
    parser.add_argument("name", choices=[*METHODS, "sparse"])
    parser.add_argument("case", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--holdout", default="", help="recordings set aside, with commas between")
    chosen = parser.parse_args()
    verdict = _verdict(chosen.name, read_case(chosen.case), chosen.holdout.split(","))
    chosen.out.mkdir(parents=True, exist_ok=True)
    write_whole(chosen.out / "verdict.json", json_text(verdict))


def _verdict(name: str, case: Case, holdout: list[str]) -> Mapping[str, Any]:
    if name == "sparse":
        return sparse_regression(case, holdout)
    with changed(name):
        return discovery.discover(case, holdout, workers=1).as_json()


if __name__ == "__main__":
    main()
