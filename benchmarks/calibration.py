"""How often calibration's 95 % intervals hold the truth: ``python -m benchmarks.calibration [--cases 120]``.

Every case is a robot whose own constants, and whose camera's mark, are drawn anew, driven by the 3D engine of
`benchmarks.concealed` (MuJoCo, extra ``bench``), which shares no code with gecar: five recordings to fit on and one to
judge by, with a noise level, a colour and a camera of its own. An honest interval of 95 % holds the truth in 95 cases
of 100; of 120 cases, between 109 and 118 (95 % of binomial draws).

On 20 cases, what moves the robot, white and black and the camera's mark are held in 18 to 20. Not honest yet: where the
sensor and the course lie (held in 7 to 10), which line following along two sides and one corner hardly tells apart, so
that a path that is off by half a millimetre moves all of them together by 1 to 5 mm; and ``gain_ratio`` (held in 10),
where the worlds differ: here a gain changes the torque, in gecar the voltage, which also loads the battery. The
difference is 0.10 x gain x battery resistance [ohm] to 0.00015.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.concealed.commands import SECONDS, line_follower, script
from benchmarks.concealed.history import ROW_TICKS, Array, replayed
from benchmarks.concealed.recording import Conditions, channels, noise, write_recording
from benchmarks.concealed.robot import SHAFT_INERTIA, SUPPLY, TRACK_WIDTH, WHEEL_RADIUS, Concealed
from benchmarks.concealed.truth import Truth
from gecar.reality.calibrate.calibration import calibrate
from gecar.reality.calibrate.constants import BY_NAME
from gecar.reality.recordings.recording import read_case

RUNS = ("holds", "holds", "sines", "line", "line", "reversals")
HELD = "run_6_reversals"
SHARED = 4  # of ten cases have noise that lingers


@dataclass(frozen=True)
class Drawn:
    """A robot in the engine's terms, how a camera sees it, and the truth by name.

    ``mark``: ahead and left of the axle's centre [m], turned [rad]. ``course``: where the camera's frame has the
    course's origin, x and y [m], and by how much it has it turned [rad].
    """

    robot: Concealed
    mark: tuple[float, float, float]
    course: tuple[float, float, float]
    truth: dict[str, float]


def drawn(rng: np.random.Generator) -> Drawn:
    """Draw a robot: each constant evenly over what small robots differ by."""
    supply, inertia, radius, track = rng.uniform((0.85, 0.7, 0.94, 0.94), (1.08, 1.5, 1.06, 1.06)).tolist()
    friction, resistance, grip = rng.uniform((0.008, 0.1, 0.3), (0.035, 1.0, 0.9)).tolist()
    direction, sides = rng.uniform(-0.04, 0.04, 2).tolist()
    level, dark = rng.uniform((70.0, 2.0), (94.0, 10.0)).tolist()
    ahead, left, spot = rng.uniform((0.071, -0.01, 0.006), (0.091, 0.01, 0.014)).tolist()
    mark = rng.uniform((-0.03, -0.03, -0.05), (0.03, 0.03, 0.05)).tolist()
    course = rng.uniform((-0.006, -0.006, -0.008), (0.006, 0.006, 0.008)).tolist()
    robot = Concealed(
        supply_scale=supply, inertia_scale=inertia, radius_scale=radius, track_scale=track,
        coulomb_friction=friction, battery_resistance=resistance, tyre_friction=grip, direction_gain=direction,
        gain_difference=sides, sensor_gain=(level - dark) / 100.0, sensor_offset_pct=dark, sensor_ahead=ahead,
        sensor_left=left, spot_diameter=spot,
    )  # fmt: skip
    truth = {
        "battery.voltage": SUPPLY * supply, "motor.inertia": SHAFT_INERTIA * inertia,
        "motor.coulomb_friction": friction, "body.wheel_radius": WHEEL_RADIUS * radius,
        "body.track_width": TRACK_WIDTH * track, "battery.resistance": resistance, "tyre.friction": grip,
        "effects.friction_asymmetry.gain_ratio": direction, "effects.motor_gain_asymmetry.right_minus_left": sides,
        "colour_sensor.white": level, "colour_sensor.black": dark, "colour_sensor.ahead": ahead,
        "colour_sensor.left": left, "colour_sensor.spot_diameter": spot,
        "camera.ahead": mark[0], "camera.left": mark[1], "camera.turn": mark[2],
        "camera.course_x": course[0], "camera.course_y": course[1], "camera.course_turn": course[2],
    }  # fmt: skip
    return Drawn(robot, tuple(mark), tuple(course), truth)


def record(folder: Path, seed: int) -> None:
    """Draw one case and write it: recordings, and ``truth.json``; one that is there already stays."""
    if (folder / "truth.json").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng((20260701, seed))
    case, conditions = drawn(rng), _conditions(rng)
    world = Truth(case.robot)
    for k, kind in enumerate(RUNS):
        if kind == "line":
            start, controller = line_follower(kind, rng)
        else:
            start, commands = script(kind, rng)
            controller = replayed(commands)
        rows = round(SECONDS * 100) + 1
        reading = np.repeat(noise("reflection_pct", rows, conditions, rng), ROW_TICKS)
        history = world.run(start, controller, SECONDS, reading[: (rows - 1) * ROW_TICKS + 1])
        clean = _filmed(channels(history, case.robot), case)
        write_recording(folder / f"run_{k + 1}_{kind}.csv", history, clean, conditions, rng)
    (folder / "truth.json").write_text(json.dumps(case.truth, indent=1) + "\n", encoding="utf-8")


def _conditions(rng: np.random.Generator) -> Conditions:
    """Draw a noise level, a colour in four cases of ten, and a camera's rate; as the concealed exam does."""
    return Conditions(
        noise_level=float(2.0 ** rng.uniform(-1.0, 1.0)),
        coloured_share=float(rng.uniform(0.2, 0.6)) if rng.integers(10) < SHARED else 0.0,
        coloured_time_s=float(rng.uniform(0.05, 0.5)),
        camera_hz=float(rng.choice([25.0, 30.0, 100.0 / 3.0, 50.0])),
    )


def _filmed(clean: dict[str, Array], case: Drawn) -> dict[str, Array]:
    """Return what a camera reports of a mark on the robot, in a frame that is not quite the course's."""
    heading, (ahead, left, turned) = np.radians(clean["heading_deg"]), case.mark
    x = clean["x_m"] + ahead * np.cos(heading) - left * np.sin(heading)
    y = clean["y_m"] + ahead * np.sin(heading) + left * np.cos(heading)
    dx, dy, angle = case.course
    cos, sin = math.cos(angle), math.sin(angle)
    seen = clean["heading_deg"] + math.degrees(turned + angle)
    return {**clean, "x_m": cos * x - sin * y + dx, "y_m": sin * x + cos * y + dy, "heading_deg": seen}


def calibrated(folder: Path) -> dict[str, list[float]]:
    """Calibrate a case; return value, low and high of each constant fitted. Kept in ``calibrated.json``."""
    kept = folder / "calibrated.json"
    if not kept.exists():
        result = calibrate(read_case(folder), [HELD])
        fitted = {f.constant.name: [f.value, f.low, f.high] for f in result.fitted}
        kept.write_text(json.dumps(fitted, indent=1) + "\n", encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Coverage:
    """Of one constant: cases where it was fitted and where its interval held the truth; errors; half widths."""

    fitted: int
    held: int
    error: float
    width: float


def coverage(cases: Sequence[tuple[dict[str, float], dict[str, list[float]]]], name: str) -> Coverage:
    """Count over (truth, fitted) of every case; error and half width are medians, in the constant's unit."""
    pairs = [(truth[name], *fitted[name]) for truth, fitted in cases if name in fitted]
    if not pairs:
        return Coverage(0, 0, math.nan, math.nan)
    true, value, low, high = np.array(pairs).T
    held = int(np.sum((low <= true) & (true <= high)))
    return Coverage(
        len(pairs), held, float(np.median(np.abs(value - true))), float(np.median(0.5 * (high - low)))
    )


def table(cases: Sequence[tuple[dict[str, float], dict[str, list[float]]]]) -> str:
    """Return the coverage of every constant as a Markdown table."""
    lines = [
        "| constant | fitted | interval holds the truth | median error | median half width |",
        "|---|---|---|---|---|",
    ]
    for name in cases[0][0]:
        c = coverage(cases, name)
        share = f"{c.held} of {c.fitted} ({100 * c.held / c.fitted:.0f} %)" if c.fitted else "-"
        lines.append(
            f"| {name} | {c.fitted} of {len(cases)} | {share} | {c.error:.2g} {BY_NAME[name].unit} "
            f"| {c.width:.2g} {BY_NAME[name].unit} |".replace(" -", "")
        )
    return "\n".join(lines)


def main() -> None:
    """Draw cases, calibrate them, and print the table; what is there already is not made again."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.calibration", description=__doc__)
    parser.add_argument("--cases", type=int, default=120)
    parser.add_argument("--out", type=Path, default=Path("runs/calibration"))
    asked = parser.parse_args()
    cases = []
    for k in range(asked.cases):
        folder = asked.out / f"c{k:03d}"
        record(folder, k)
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        cases.append((truth, calibrated(folder)))
        print(f"\r{k + 1} of {asked.cases}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(table(cases))


if __name__ == "__main__":
    main()
