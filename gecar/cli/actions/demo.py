"""What ``gecar demo`` does: evolve, drive, compare, discover, evolve again, and one page that tells it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gecar.calling import command
from gecar.cli.actions.discover import draw, keep_still, teller, write
from gecar.cli.actions.evolve import begin, finish_watched, say_if_cold
from gecar.cli.actions.run_pictures import draw_run
from gecar.cli.output import Output
from gecar.cli.progress import Steps
from gecar.errors import expected
from gecar.files import write_whole
from gecar.language.program import Program, read_program
from gecar.plots.reality.gap import gap_figure
from gecar.plots.reality.replay_page import replay_page
from gecar.plots.style import save
from gecar.reality.advise.next_recording import LIBRARY
from gecar.reality.compare.gap import gap
from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Recording, read_case, write_recording
from gecar.reality.recordings.synthetic import exercise, rehearsal
from gecar.reality.verdict import Verdict
from gecar.report.demo import (
    HONEST,
    Concealed,
    Round,
    concealed,
    demo_article,
    demo_head,
    predicted_and_driven,
)
from gecar.report.gap import gap_detail, gap_table, gap_title
from gecar.report.verdict import title
from gecar.results.arrival import arrives
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World, simulate

TRUTH = "worn_ev3"
TRUTH_STEP_S = 0.001  # half of what evolution simulates with
SENSOR_NOISE_PCT, MOTOR_NOISE_PCT = 1.0, 1.0
DRAWS = 4  # drives per evaluation: a quarter of the preset's, for four times the programs a minute
DRIVES = 3
EXERCISES = ("reversals", "arcs to both sides", "full steps", "spins at rising speeds")


@dataclass(frozen=True)
class Demo:
    """A demonstration and where it is told.

    Attributes
    ----------
    output
        Where words go.
    out
        Its folder, new.
    seed, generations
        Of both evolutions.
    quiet
        Whether to show no progress.
    """

    output: Output
    out: Path
    seed: int
    generations: int
    quiet: bool

    def perform(self) -> None:
        """Do all of it.

        Raises
        ------
        InputError
            If the folder exists, or a setting is out of bounds.
        """
        if self.out.exists():
            raise expected("--out", f"{self.out}, which exists", "a new folder")
        self.output.print(HONEST)
        say_if_cold()
        self._chapter("1 of 4  Evolve for the robot as it is known")
        program = self._evolved("first", "ev3")
        self._chapter("2 of 4  The real robot drives it")
        first = self._driven(program, "ev3", self.out / "recordings")
        self._chapter("3 of 4  Discover what the simulation lacks")
        verdict, faults = self._discovered()
        self._chapter("4 of 4  Evolve again, for the robot found, and drive")
        found = str(self.out / "verdict" / "robot.toml")
        second = self._driven(self._evolved("second", found), found, self.out / "recordings_second")
        page = self._write_page(first, second, verdict, faults)
        self._chapter(f"The whole story on one page: {page}")
        by_hand = (f"  {line}" for line in self._commands(command()))
        self.output.print("\n".join(["The same, step by step:", *by_hand]))
        self.output.print_json(_table(self.out, page, (first, second), verdict, faults))

    def _chapter(self, words: str) -> None:
        self.output.print(f"\n{words}", style="bold")

    def _evolved(self, name: str, robot: str) -> Program:
        """Evolve into a folder, draw, and show the program."""
        search = {"generations": self.generations, "draws": DRAWS}
        changes = {"robot": robot, "seed": self.seed, "search": search}
        started = begin(None, changes, self.out / name, again=False)
        finish_watched(started, self.quiet)
        draw_run(started.folder.path)
        program = read_program(started.folder.path / "best.txt")
        self.output.print("\n".join(f"    {line}" for line in program.source.splitlines()))
        return program

    def _driven(self, program: Program, robot: str, folder: Path) -> Round:
        """Let the real robot drive a program, record that, and compare it with its simulation."""
        world, known = _truth(), load_robot(robot)
        drives = [
            rehearsal(world, program, simulate(world, program.opcodes, k, trace=True), f"drive_{k}")
            for k in range(1, DRIVES + 1)
        ]
        _record(drives, folder)
        found = gap(drives, known, world.course, program, in_course=True)
        found = replace(found, arrives=arrives(World(known, world.course), program, self.seed))
        self.output.print(predicted_and_driven(each := Round(program, found)))
        return each

    def _discovered(self) -> tuple[Verdict, list[Concealed]]:
        """Record other driving, discover what is missing, judged by the program's drives, write that and say it."""
        folder, world = self.out / "recordings", _truth()
        _record(
            [exercise(world, LIBRARY[name], name.replace(" ", "_"), k) for k, name in enumerate(EXERCISES)],
            folder,
        )
        case = read_case(folder)
        with nullcontext(keep_still) if self.quiet else Steps(teller(self.output)) as tell:
            verdict = discover(case, _drives(), tell=tell)
        write(verdict, self.out / "verdict")
        faults = concealed(world.robot, verdict)
        self.output.print(title(verdict))
        for fault in faults:
            self.output.print(f"  {fault.title}: concealed {fault.size}; found {fault.found}")
        return verdict, faults

    def _write_page(self, first: Round, second: Round, verdict: Verdict, faults: Sequence[Concealed]) -> Path:
        """Draw the verdict and the gaps, and write the page."""
        shown = draw(verdict, self.out / "verdict")
        gaps = [
            save(
                gap_figure(each.gap, gap_title(each.gap), gap_detail(each.gap)), self.out / f"gap_{name}.png"
            )
            for name, each in (("first", first), ("second", second))
        ]
        pictures = [path.read_bytes() for path in (self.out / "first" / "trajectory.png", *gaps)]
        told = demo_article(first, second, faults, shown.article, pictures, self._commands("gecar"))
        head = demo_head(first, second, shown.recordings)
        page = self.out / "demo.html"
        write_whole(page, replay_page(verdict, shown.recordings, head, told, "gecar demo"))
        return page

    def _commands(self, gecar: str) -> list[str]:
        """Return what to type to do the same, beginning with what starts gecar."""
        out = self.out.as_posix()
        search = f"--generations {self.generations} --draws {DRAWS} --seed {self.seed}"
        recordings, names = f"{out}/recordings", ",".join(_drives())
        return [
            f"{gecar} evolve {search} --out my/first",
            f"{gecar} compare {recordings}/drive_1.csv --program {out}/first --out my/gap",
            f"{gecar} discover {recordings} --holdout {names} --out my/verdict",
            f"{gecar} evolve {search} --robot my/verdict/robot.toml --out my/second",
            f"{gecar} simulate my/second --robot {TRUTH}",
        ]


def _truth() -> World:
    """Return the real robot on its course."""
    noise = Noise(SENSOR_NOISE_PCT, 0.01 * MOTOR_NOISE_PCT)
    return World(load_robot(TRUTH), load_course("paper"), step_s=TRUTH_STEP_S, noise=noise)


def _drives() -> list[str]:
    return [f"drive_{k}" for k in range(1, DRIVES + 1)]


def _record(recordings: Sequence[Recording], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for each in recordings:
        write_recording(each, folder / f"{each.name}.csv")


def _table(
    out: Path, page: Path, rounds: Sequence[Round], verdict: Verdict, faults: Sequence[Concealed]
) -> dict[str, Any]:
    """Return what came of it, ready for JSON."""
    first, second = (gap_table(each.gap) | {"program": each.program.source} for each in rounds)
    return {
        "folder": str(out),
        "page": str(page),
        "first": first,
        "verdict": verdict.verdict,
        "found": [effect.id for effect in verdict.effects],
        "faults": [fault._asdict() for fault in faults],
        "second": second,
    }
