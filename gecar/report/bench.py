"""A motor on a bench beside its simulation: for people, for spreadsheets, for programs."""

from __future__ import annotations

import csv
import io
import math
from typing import Any

import numpy as np

from gecar.reality.compare.bench import BenchGap, Shaft
from gecar.report.gap import grid


def bench_lines(found: BenchGap) -> list[str]:
    """Say in sentences how the simulation stands beside the recordings."""
    worst = max(found.shafts, key=lambda shaft: shaft.rms_deg)
    apart = (
        f"Off by {_mean(found):.1f} deg (root mean square, mean of {_count(found)}); most in {worst.trial}: "
        f"{worst.rms_deg:.1f} deg, {worst.end_deg:+.1f} deg at its end."
    )
    lines = [
        "On the bench, recorded commands are replayed open loop and compared with the shafts' angles.",
        apart,
    ]
    measured, simulated = np.array([shaft.speeds_dps for shaft in found.shafts]).T
    moved = np.abs(measured) > 1.0
    if moved.any():
        ratio = 100.0 * (simulated[moved] / measured[moved] - 1.0)
        span = (
            f"{ratio.min():+.1f} %" if np.ptp(ratio) < 0.1 else f"{ratio.min():+.1f} to {ratio.max():+.1f} %"
        )
        lines.append(f"Simulated speed against measured speed: {span}.")
    return lines


def _mean(found: BenchGap) -> float:
    return float(np.mean([shaft.rms_deg for shaft in found.shafts]))


def _count(found: BenchGap) -> str:
    return f"{len(found.shafts)} recordings" if len(found.shafts) > 1 else "1 recording"


def bench_title(found: BenchGap) -> str:
    """Say in a few words how far apart they are."""
    return f"On the bench: simulated and measured angles are {_mean(found):.1f} deg apart"


def bench_detail(found: BenchGap) -> str:
    """Say what the picture was made with."""
    return f"{_count(found)} · robot {found.robot.name} · commands replayed open loop"


def bench_rows(found: BenchGap) -> list[dict[str, Any]]:
    """Return a row for each shaft, one number a column."""
    return [_row(shaft) for shaft in found.shafts]


def _row(shaft: Shaft) -> dict[str, Any]:
    measured, simulated = shaft.speeds_dps
    return {
        "trial": shaft.trial,
        "side": shaft.side,
        "duty_pct": shaft.held_pct,
        "rms_deg": shaft.rms_deg,
        "end_deg": shaft.end_deg,
        "nrmse": shaft.nrmse,
        "speed_dps": measured,
        "simulated_speed_dps": simulated,
    }


def bench_table(found: BenchGap) -> dict[str, Any]:
    """Return all figures, ready for JSON."""
    return {
        "robot": found.robot.name,
        "rig": "bench",
        "trials": bench_rows(found),
        "notes": bench_lines(found),
    }


def bench_csv(found: BenchGap) -> str:
    """Return a row for each shaft, as CSV."""
    rows, stream = bench_rows(found), io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _cell(value) for name, value in row.items()})
    return stream.getvalue()


def _cell(value: object) -> object:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else value


def bench_markdown(found: BenchGap) -> str:
    """Return the figures as Markdown."""
    head = (
        "Recording",
        "duty (%)",
        "off by, rms (deg)",
        "at its end (deg)",
        "measured (deg/s)",
        "simulated (deg/s)",
    )
    rows = [
        (
            shaft.trial if shaft.side == "left" else f"{shaft.trial}, {shaft.side}",
            "changes" if shaft.held_pct is None else f"{shaft.held_pct:g}",
            f"{shaft.rms_deg:.1f}",
            f"{shaft.end_deg:+.1f}",
            *(f"{speed:.1f}" for speed in shaft.speeds_dps),
        )
        for shaft in found.shafts
    ]
    words = "Speeds are means over the second half."
    parts = [
        "# Simulation and recordings on a bench",
        "\n\n".join(bench_lines(found)),
        grid(head, rows),
        words,
    ]
    return "\n\n".join(parts) + "\n"
