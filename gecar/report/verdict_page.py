"""The verdict as one self-contained HTML page, and its pictures as PNG."""

from __future__ import annotations

import html
from pathlib import Path

from gecar.files import write_whole
from gecar.reality.verdict import Verdict
from gecar.report.verdict import sentences


def write_page(verdict: Verdict, folder: Path) -> None:
    """Write ``report.html``."""
    body = "".join(f"<p>{html.escape(line)}</p>" for line in sentences(verdict))
    write_whole(
        folder / "report.html",
        f"<!doctype html><meta charset='utf-8'><title>{html.escape(verdict.case)}</title>{body}",
    )
