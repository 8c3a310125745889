"""What laws are worth: the catalogue's effects taken out in turn, physics in no list, and nothing at all.

python -m benchmarks.concealed plan --seed 1 --world continuous:none=6,single=36,outside=12 --out runs/cases
python -m benchmarks.invention runs/cases --out runs/invention

Each case with one effect is looked at with a catalogue without it (``gecar discover --without``); all others with the
whole catalogue; and a law is asked for in each (``--invent``). Of every case: the gap closed on recordings set aside,
open loop; whether a law stands at a port where that physics acts (`PORTS_OF`, written before any case was drawn), and
looks at the variables it depends on; the time it took. Goes on where it was stopped, and writes table.md. With
``--material`` cases are left out whose concealed physics is too small to ask for a law: most, where robots have a
background.
"""

from __future__ import annotations

import json
import time
from argparse import ArgumentParser
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.sizes import is_material, sizes_in
from gecar.files import json_ready, write_whole
from gecar.reality.discovery import discover
from gecar.reality.invent.sentences import physics_grammar
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.recordings.recording import read_case
from gecar.reality.verdict import Judgement, Verdict
from gecar.report.table import piped
from gecar.world.effects import CATALOGUE
from gecar.world.robot import write_robot

_MOTOR = ("motor_torque", "command", "gear_friction")
_FORCE = ("force_x", "force_y", "force_toward")
# Where each physics acts, and what it depends on; "": nothing. What has no port is left out of the count of ports.
PORTS_OF: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "coulomb_friction": (("gear_friction", "motor_torque"), ("", "speed")),
    "viscous_friction": (("motor_torque", "gear_friction"), ("speed",)),
    "static_friction": (("gear_friction", "motor_torque"), ("speed",)),
    "friction_asymmetry": (_MOTOR, ("speed", "command")),
    "dead_band": (("command", "motor_torque"), ("command",)),
    "full_duty": (("command", "supply_voltage", "motor_torque"), ("command",)),
    "command_slew": (("command",), ("store", "command")),
    "actuation_delay": (("command",), ("store", "command")),
    "pose_delay": (("pose_late", "pose_x", "pose_y", "pose_heading"), ("", "ahead", "turn_rate")),
    "motor_gain_asymmetry": (("command", "motor_torque"), ("command", "side")),
    "supply_voltage": (("supply_voltage", "command"), ("", "command")),
    "battery_resistance": (("supply_voltage",), ("draw", "current")),
    "battery_drain": (("supply_voltage",), ("time",)),
    "torque_ripple": (_MOTOR, ("angle",)),
    "speed_limit": (_MOTOR, ("speed",)),
    "wheel_radius": (("rolling_radius",), ("",)),
    "backlash": (("gear_play",), ("",)),
    "track_width": (("track_width",), ("",)),
    "sensor_position": (("sensor_ahead", "sensor_aside"), ("",)),
    "sensor_delay": (("sensor_ahead", "sensor_aside"), ("ahead", "turn_rate")),
    "line_shift": (("sensor_ahead", "sensor_aside"), ("heading",)),
    "wheel_radius_difference": (("rolling_radius",), ("side",)),
    "tyre_friction": (("tyre_grip", "wheel_load"), ("",)),
    "slippery_patch": (("tyre_grip", "wheel_load"), ("x", "y")),
    "caster_drag": (("caster_friction",), ("",)),
    "rolling_resistance": (("gear_friction", "motor_torque", "force_ahead"), ("", "speed", "ahead", "load")),
    "floor_tilt": (_FORCE, ("", "distance")),
    "load_transfer": (("wheel_load", "tyre_grip"), ("ahead", "aside", "turn_rate", "load")),
    "com_offset": (("yaw_moment", "wheel_load", "force_aside"), ("turn_rate", "ahead", "aside")),
    "sensor_gain": (("colour_reading",), ("", "reading")),
    "viscous_asymmetry": (("motor_torque", "gear_friction"), ("speed",)),
    "constant_torque": (("motor_torque",), ("",)),
    "dead_band_asymmetry": (("command", "motor_torque"), ("command", "side")),
    "duty_curve": (("command", "supply_voltage", "motor_torque"), ("command",)),
    "off_centre_wheels": (("rolling_radius",), ("angle",)),
    "oval_wheels": (("rolling_radius",), ("angle",)),
    "tether": (_FORCE, ("distance", "x", "y")),
    "magnet": (_FORCE, ("distance", "x", "y")),
    "wavy_floor": ((*_FORCE, "force_ahead"), ("x", "y")),
    "air_drag": (("force_ahead", "motor_torque"), ("ahead", "speed")),
    "floor_ridge": ((*_FORCE, "tyre_grip", "wheel_load"), ("distance", "x", "y")),
    "camera_lens": (("pose_x", "pose_y", "pose_toward"), ("x", "y", "distance")),
    "ambient_light": (("colour_reading",), ("heading",)),
    "pose_drift": (("pose_turn", "pose_x", "pose_y", "pose_heading"), ("time",)),
    "motor_heat": (("motor_torque", "supply_voltage", "command"), ("store", "time")),
    "loosening_wheel": (("gear_play",), ("time",)),
    "current_limit": (("motor_torque", "command"), ("current",)),
    "yaw_pull": (("yaw_moment",), ("",)),
    "shared_drop": (("supply_voltage",), ("draw", "current", "command")),
    "carpet_pile": ((*_FORCE, "force_ahead", "yaw_moment"), ("heading", "")),
    "duty_steps": (("command", "motor_torque"), ("command",)),
    "dusty_tyres": (("tyre_grip", "wheel_load"), ("time", "x", "y")),
    "damaged_tooth": (_MOTOR, ("angle",)),
    "rubber_band": (_MOTOR, ("angle",)),
    "hopping_wheel": (("tyre_grip", "wheel_load"), ("angle",)),
    "coasting": (_MOTOR, ("command", "speed")),
    "swinging_sensor": (("sensor_ahead", "sensor_aside"), ("ahead", "turn_rate")),
    "swivel_caster": (("force_aside", "yaw_moment"), ("turn_rate", "ahead", "aside")),
    "frame_count": (("pose_late", "pose_x", "pose_y", "pose_heading"), ("time",)),
    "keystone": (("pose_toward", "pose_x", "pose_y"), ("x", "y", "distance")),
    "frame_rub": (_MOTOR, ("turn_rate",)),
    "lossy_gears": (_MOTOR, ("current",)),
    "grooved_floor": (("caster_friction", *_FORCE, "force_ahead", "yaw_moment"), ("heading",)),
    "slow_sag": (("supply_voltage",), ("store",)),
    "position_hold": (("command", "motor_torque"), ("angle",)),
}
NO_LAW = ("gusts", "radio_dropouts", "flicker", "camera_bump")
"""Noise by nature, or a thing that happened once: nothing is to be invented."""


def _concealed(label: dict[str, Any]) -> tuple[list[str], str]:
    """Return the effects that a label says are concealed, and the physics outside the catalogue."""
    return [effect["id"] for effect in label["effects"]], (label.get("outside") or {}).get("id", "")


def judged(folder: Path, label: dict[str, Any], seed: int = 0) -> Verdict:
    """Return a case's verdict with laws asked for; if it conceals one effect alone, by a catalogue without it."""
    concealed, outside = _concealed(label)
    single = len(concealed) == 1 and not outside
    return discover(
        read_case(folder),
        seed=seed,
        workers=1,
        catalogue=[effect for effect in CATALOGUE if not single or effect.id not in concealed],
        language=physics_grammar(),
        invents=True,
    )


def look_at(folder: Path, label: dict[str, Any], out: Path, seed: int = 0) -> dict[str, Any]:
    """Return what a case's verdict says with laws asked for, and what it is worth; ``out`` gets the robot's file."""
    concealed, outside = _concealed(label)
    began = time.process_time(), time.perf_counter()
    verdict = judged(folder, label, seed)
    table = verdict.as_json()
    write_robot(verdict.robot, out / f"{folder.name}.toml")
    return json_ready(
        {
            "kind": "outside" if outside or len(concealed) > 1 else "single" if concealed else "none",
            "concealed": outside or (concealed[0] if concealed else ""),
            "verdict": verdict.verdict,
            "effects": [found.id for found in verdict.effects],
            "material": verdict.residual.material,
            "clocks_fitted": verdict.evidence.motion.problem.clocks_fitted,
            "gap_closed": verdict.judgement.gap_closed,
            "gap_closed_at_best": closed_at_best(verdict, label) if concealed and not outside else None,
            "invented": table["invented"],
            "typeset": [law.term.typeset for law in verdict.invented],
            "seconds": time.process_time() - began[0],
            "wall_s": time.perf_counter() - began[1],
        }
    )


def closed_at_best(verdict: Verdict, label: dict[str, Any]) -> float | None:
    """Return the gap that the concealed effects close at their true sizes, as the catalogue describes them.

    The rest is the case's background, and where the catalogue's law is not that of the world.
    """
    evidence, judgement = verdict.evidence, verdict.judgement
    true = {
        effect["id"]: {name: number["value"] for name, number in effect["parameters"].items()}
        for effect in label["effects"]
    }
    best = Contender(evidence.before.with_effects(true), evidence.held)
    channels = judge(Contender(evidence.before, evidence.held_before), best)
    return Judgement(judgement.recordings, judgement.by_time, channels).gap_closed


def asks_for_a_law(label: dict[str, Any]) -> bool:
    """Whether what a case conceals is material; one that conceals nothing asks that none is written, and counts."""
    sizes = [size for name, size in sizes_in(label).items() if name != "background"]
    return not sizes or any(map(is_material, sizes))


def port_right(case: dict[str, Any]) -> bool | None:
    """Whether a law, or one that can not be told from it, stands where the physics acts; None where nothing says."""
    if case["concealed"] not in PORTS_OF or not case["invented"]:
        return None
    wanted = PORTS_OF[case["concealed"]][0]
    return any(
        law["port"] in wanted or any(o["port"] in wanted for o in law["or"]) for law in case["invented"]
    )


def variables_right(case: dict[str, Any]) -> bool | None:
    """Whether a law looks at what the physics depends on."""
    if case["concealed"] not in PORTS_OF or not case["invented"]:
        return None
    wanted = PORTS_OF[case["concealed"]][1]
    return any(
        any(name in law["variables"] for name in wanted) or ("" in wanted and not law["variables"])
        for law in case["invented"]
    )


def table(cases: dict[str, dict[str, Any]]) -> str:
    """Write a case a row, and what they come to."""
    rows = [["case", "concealed", "verdict", "named", "laws", "gap closed", "at best", "port", "CPU s"]]
    for name, case in sorted(cases.items(), key=lambda item: (item[1]["kind"], item[1]["concealed"])):
        closed, best = (
            "-" if case.get(name) is None else f"{case[name]:.2f}"
            for name in ("gap_closed", "gap_closed_at_best")
        )
        port = {None: "-", True: "yes", False: "no"}[port_right(case)]
        laws = "; ".join(f"`{words}`" for words in case["typeset"]).replace("|", "\\|") or "-"
        named = ", ".join(case["effects"]) or "-"
        what = case["concealed"] or "nothing"
        rows.append([name, what, case["verdict"], named, laws, closed, best, port, f"{case['seconds']:.0f}"])
    return piped(rows) + "\n" + _summary(list(cases.values()))


def _summary(cases: list[dict[str, Any]]) -> str:
    lines = []
    lawful = [c for c in cases if c["concealed"] in PORTS_OF]
    written_in = [c for c in lawful if c["invented"] and c["gap_closed"] is not None]
    for kind in ("single", "outside"):
        closed = [case["gap_closed"] for case in written_in if case["kind"] == kind]
        written = sum(bool(c["invented"]) for c in lawful if c["kind"] == kind)
        of = sum(c["kind"] == kind for c in lawful)
        middle = f"{np.median(closed):.2f}" if closed else "-"
        best = [
            each
            for c in written_in
            if c["kind"] == kind and (each := c.get("gap_closed_at_best")) is not None
        ]
        if best:
            middle += f" (the effect itself: {np.median(best):.2f})"
        lines.append(
            f"{kind}: a law in {written} of {of} that have a port; gap closed there, median {middle}"
        )
    for words, right in (("port", port_right), ("variables", variables_right)):
        judged = [right(c) for c in cases if right(c) is not None]
        lines.append(f"{words} right: {sum(map(bool, judged))} of {len(judged)}")
    for words, some in (
        ("nothing concealed", [c for c in cases if c["kind"] == "none"]),
        ("noise by nature", [c for c in cases if c["concealed"] in NO_LAW]),
    ):
        lines.append(
            f"{words}: something invented in {sum(bool(c['invented']) for c in some)} of {len(some)}"
        )
    lines.append(f"processor time a case: median {np.median([c['seconds'] for c in cases]):.0f} s")
    return "".join(f"- {line}\n" for line in lines)


def main() -> None:
    """Look at all cases that were not looked at yet, and write the table."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path, help="as benchmarks.concealed draws them: cases/ and sealed/")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--material", action="store_true", help="leave out what is too small to ask for a law"
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    labels = {
        f.parent.name: json.loads(f.read_text())
        for f in sorted((given.cases / "sealed").glob("*/label.json"))
    }
    if given.material:
        labels = {name: label for name, label in labels.items() if asks_for_a_law(label)}
    waiting = [name for name in labels if not (given.out / f"{name}.json").exists()]
    with ProcessPoolExecutor(given.workers) as pool:
        jobs = {
            pool.submit(look_at, given.cases / "cases" / name, labels[name], given.out): name
            for name in waiting
        }
        for job in as_completed(jobs):
            if job.exception() is not None:
                print(f"{jobs[job]}: no verdict: {job.exception()}", flush=True)
                continue
            write_whole(given.out / f"{jobs[job]}.json", json.dumps(job.result(), indent=1) + "\n")
            print(
                f"{jobs[job]}: {job.result()['concealed'] or 'nothing'} -> {job.result()['typeset']}",
                flush=True,
            )
    kept = {name: given.out / f"{name}.json" for name in labels}
    found = {name: json.loads(file.read_text()) for name, file in kept.items() if file.exists()}
    write_whole(given.out / "table.md", table(found))
    print(table(found))


if __name__ == "__main__":
    main()
