"""The gap between simulation and recordings as the paper's tables: for people, for spreadsheets, for programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gecar.reality.compare.gap import CHANNELS, Gap, Trial
from gecar.results.arrival import with_share
from gecar.world.rollout import Outcome


def gap_lines(found: Gap) -> list[str]:
    """Compare the simulation with the recordings, in sentences."""
    count = len(found.trials)
    lines = [_simulated(found)]
    arrived = [t for t in found.trials if t.arrived]
    if arrived:
        times = [t.arrival_s for t in arrived]
        words = f"{len(arrived)} of {count} recordings reached GOAL, in {mean_and_spread(times, 2)} s"
        errors = [t.error_pct for t in arrived if not math.isnan(t.error_pct)]
        lines.append(words + (f": {np.mean(errors):+.1f} % against the simulation." if errors else "."))
    lines += [
        f"{t.name} did not reach GOAL ({t.checkpoints} checkpoints); its time is that of its last sample."
        for t in found.trials
        if not t.arrived and found.course is not None
    ]
    reckoned = [t.name for t in found.trials if t.by_odometry]
    if reckoned:
        lines.append(
            f"No pose was recorded in {', '.join(reckoned)}: its path is computed from the wheels' angles (odometry)."
        )
    lines.append(
        f"Displacement: {_displacement(found.trials)}; correlation x {_pair(found, 0)}, y {_pair(found, 1)}."
    )
    return lines


def _simulated(found: Gap) -> str:
    if found.outcome is None or found.simulated_s is None:
        return "No program: simulation means the recorded commands, replayed open loop."
    if found.outcome == Outcome.GOAL:
        return f"Simulated arrival time: {with_share(found.simulated_s, found.share)}."
    return f"In simulation the robot {found.outcome.sentence} after {with_share(found.simulated_s, found.share)}."


def gap_title(found: Gap) -> str:
    """Return a title: what is compared, and the gap in time if there is one."""
    where = (found.course.title or found.course.name) if found.course else "Blank floor"
    errors = [t.error_pct for t in found.trials if not math.isnan(t.error_pct)]
    if len(errors) < len(found.trials) and any(t.arrived for t in found.trials):
        lost = "" if found.outcome in (None, Outcome.GOAL) else ", the simulation does not"
        return (
            f"{where}: {sum(t.arrived for t in found.trials)} of {len(found.trials)} drives reach GOAL{lost}"
        )
    if errors:
        return f"{where}: the real robot arrives {abs(np.mean(errors)):.1f} % {_late(float(np.mean(errors)))}"
    return f"{where}: {'commands replayed' if found.outcome is None else 'simulation'} and recordings"


def _late(error_pct: float) -> str:
    return "later than simulated" if error_pct >= 0.0 else "earlier than simulated"


def gap_detail(found: Gap) -> str:
    """Say what the picture was made with."""
    count = len(found.trials)
    parts = [
        f"{count} recording{'s' if count > 1 else ''}",
        f"robot {found.robot.name}",
        _frame(found),
        f"correlation x {_pair(found, 0)}, y {_pair(found, 1)}",
    ]
    return " · ".join(parts)


def _frame(found: Gap) -> str:
    if found.outcome is None:
        return "start poses of replays fitted"
    return "positions in the course's frame" if found.in_course else "paths aligned at the start"


def _displacement(trials: Sequence[Trial]) -> str:
    means = [float(np.mean(t.displacement_m)) for t in trials]
    most = max(float(np.max(t.displacement_m)) for t in trials)
    return f"mean {mean_and_spread(means, 3)} m, at most {most:.3f} m"


def _pair(found: Gap, axis: int) -> str:
    return mean_and_spread([t.correlation[axis] for t in found.trials], 4)


def mean_and_spread(values: Sequence[float], places: int) -> str:
    """Return a mean, with the standard deviation where there are several values."""
    known = [v for v in values if not math.isnan(v)]
    if not known:
        return "-"
    if len(known) == 1:
        return f"{known[0]:.{places}f}"
    return f"{np.mean(known):.{places}f} ± {np.std(known, ddof=1):.{places}f}"


def gap_rows(found: Gap) -> list[dict[str, Any]]:
    """Return a row for each trial, one number a column."""
    return [_row(trial) for trial in found.trials]


def _row(trial: Trial) -> dict[str, Any]:
    row: dict[str, Any] = {
        "trial": trial.name,
        "arrived": trial.arrived,
        "arrival_s": trial.arrival_s,
        "error_pct": trial.error_pct,
        "checkpoints": trial.checkpoints,
        "correlation_x": trial.correlation[0],
        "correlation_y": trial.correlation[1],
        "mean_displacement_m": float(np.mean(trial.displacement_m)),
        "largest_displacement_m": float(np.max(trial.displacement_m)),
    }
    for kind, misfits in (("closed_loop", trial.closed_loop), ("open_loop", trial.open_loop)):
        row |= {f"{kind}_nrmse_{column}": value for column, value in misfits.items()}
    return row


def spread(found: Gap) -> dict[str, dict[str, float]]:
    """Return mean, standard deviation, least and largest of each figure over the trials; of times, those arrived."""
    rows = gap_rows(found)
    names = dict.fromkeys(name for row in rows for name in row if name not in ("trial", "arrived"))
    out = {}
    for name in names:
        counted = [row[name] for row in rows if name in row and (row["arrived"] or name != "arrival_s")]
        known = [v for v in counted if not math.isnan(v)]
        if known:
            out[name] = {
                "mean": float(np.mean(known)),
                "sd": float(np.std(known, ddof=1)) if len(known) > 1 else math.nan,
                "min": float(min(known)),
                "max": float(max(known)),
            }
    return out


def gap_table(found: Gap) -> dict[str, Any]:
    """Return all figures, ready for JSON."""
    return {
        "course": found.course.name if found.course else None,
        "robot": found.robot.name,
        "frame": "course" if found.in_course else "start",
        "simulation": {
            "arrival_s": found.simulated_s if found.outcome == Outcome.GOAL else None,
            "time_s": found.simulated_s,
            "outcome": found.outcome.name.lower() if found.outcome else "replay",
            "arrives": found.arrives,
        },
        "trials": gap_rows(found),
        "spread": spread(found),
        "notes": gap_lines(found),
    }


def gap_csv(found: Gap) -> str:
    """Return a row for each trial, and below them mean and standard deviation, as CSV."""
    rows, over = gap_rows(found), spread(found)
    names = list(dict.fromkeys(name for row in rows for name in row))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _cell(value) for name, value in row.items()})
    for kind in ("mean", "sd"):
        writer.writerow({"trial": kind, **{name: _cell(each[kind]) for name, each in over.items()}})
    return stream.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return str(value).lower() if isinstance(value, bool) else value


def gap_markdown(found: Gap) -> str:
    """Return the paper's Tables 6 and 7, and the misfit of each channel, as Markdown."""
    where = found.course.title or found.course.name if found.course else "a blank floor"
    parts = [f"# Simulation and recordings on {where}", "\n\n".join(gap_lines(found))]
    parts += ["## Running time (the paper's Table 6)", _times(found)]
    parts += ["## Correlation of coordinates (Table 7)", _correlations(found)]
    parts += ["## Misfit of each channel (RMSE / standard deviation of what was measured)", _misfits(found)]
    return "\n\n".join(parts) + "\n"


def _times(found: Gap) -> str:
    rows = [
        (t.name, f"{t.arrival_s:.2f}" + ("" if t.arrived else " (last sample)"), _percent(t.error_pct))
        for t in found.trials
    ]
    arrived = [t for t in found.trials if t.arrived]
    if arrived:
        times, errors = [t.arrival_s for t in arrived], [t.error_pct for t in arrived]
        rows.append(("mean ± sd", mean_and_spread(times, 2), mean_and_spread(errors, 1)))
    return grid(("Experiment", "Arrival time (s)", "Error (%)"), rows)


def _percent(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1f}"


def _correlations(found: Gap) -> str:
    rows = [(t.name, *(mean_and_spread([c], 4) for c in t.correlation)) for t in found.trials]
    rows.append(("mean ± sd", _pair(found, 0), _pair(found, 1)))
    return grid(("Experiment", "x-coordinate", "y-coordinate"), rows)


def _misfits(found: Gap) -> str:
    columns = [
        c for c in CHANNELS.values() if any(c in t.open_loop or c in t.closed_loop for t in found.trials)
    ]
    rows = [
        (c, _over([t.closed_loop for t in found.trials], c), _over([t.open_loop for t in found.trials], c))
        for c in columns
    ]
    return grid(("Channel", "closed loop", "open loop, recorded commands"), rows)


def _over(misfits: Sequence[Mapping[str, float]], column: str) -> str:
    return mean_and_spread([m[column] for m in misfits if column in m], 4)


def grid(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown: the first column to the left, numbers to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
