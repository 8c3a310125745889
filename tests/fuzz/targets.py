"""What is fuzzed: the readers of strangers' files, each with what is done at once with what it read.

An input is the content of a file. Where a reader takes several files, lines of ``=====`` part them; where a folder
holds files of several kinds, the first line names which one it is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from gecar.errors import InputError
from gecar.language.grammar import read_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import Program, mirrored, parse_program, read_program
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.recording import Recording, read_recording, write_recording
from gecar.reality.recordings.setup import Setup
from gecar.results.checkpoint import unpack
from gecar.results.config import as_toml, configure, read_config
from gecar.results.fitness_table import read_table
from gecar.results.folder import read_history, read_result
from gecar.results.study import read_study
from gecar.world.course.course import load_course
from gecar.world.course.raster import read_image
from gecar.world.robot import Robot, load_robot, read_robot, write_robot
from gecar.world.rollout import World, simulate

GENOMES = np.random.default_rng(1).integers(0, 256, (4, 40), np.uint8)
PARTED = b"\n=====\n"


def grammar(raw: bytes, folder: Path) -> None:
    """Read a grammar, and derive from it."""
    mapper = Mapper(read_grammar(_file(folder, "grammar.bnf", raw)), MappingOptions(max_symbols=2_000))
    mapped = mapper.map(GENOMES)
    for i in range(len(mapped)):
        mapped.program(i)


def program(raw: bytes, folder: Path) -> None:
    """Read a program, drive it for a moment, and read it as it is written."""
    parsed = read_program(_file(folder, "program.txt", raw))
    simulate(_paper(), mirrored(parsed).opcodes)
    _must(_same(parsed), "a program as it is written reads back")


def course(raw: bytes, folder: Path) -> None:
    """Read a course and its picture, follow its line and find its shortest way."""
    content, *picture = raw.split(PARTED, 1)
    _file(folder, "floor.png", picture[0] if picture else None)
    parsed = load_course(_file(folder, "course.toml", content))
    _must(parsed.shortest.length_m >= 0.0 and parsed.length_m >= 0.0, "a way has a length")


def picture(raw: bytes, folder: Path) -> None:
    """Read a picture of a floor."""
    _must(read_image(_file(folder, "floor.png", raw), "image").size > 0, "a picture has pixels")


def recording(raw: bytes, folder: Path) -> None:
    """Read a recording, the TOML beside it and the robot it names; write it, and read it back."""
    parts = [*raw.split(PARTED, 2), None, None][:3]
    for name, part in zip(("run.csv", "run.toml", "robot.toml"), parts, strict=True):
        _file(folder, name, part)
    read = read_recording(folder / "run.csv")
    load_robot(read.setup.robot)
    _must(_reads_back(read, folder), "a recording as it is written reads back")


def log(raw: bytes, folder: Path) -> None:
    """Import one log or more, write the recordings, and read them as strictly as any."""
    paths = [_file(folder, f"file{k}{_ending(part)}", part) for k, part in enumerate(raw.split(PARTED, 2))]
    for imported in import_logs(paths, _ev3(), Setup(rig="bench"), ImportOptions()):
        _must(_reads_back(imported.recording, folder), "what was imported is a recording")


def _ending(raw: bytes) -> str:
    """Return the ending of what a log's content looks like: the reader goes by it."""
    return ".mat" if raw.startswith(b"MATLAB") else ".xlsx" if raw.startswith(b"PK") else ".txt"


def run(raw: bytes, folder: Path) -> None:
    """Read one of the files a run, a study or a check leaves, or a robot."""
    name, _, content = raw.partition(b"\n")
    read = _RUN_FILES.get(name.decode("latin-1"))
    if read is not None:
        read(_file(folder, name.decode("latin-1"), content))


def _config(path: Path) -> None:
    config = configure(read_config(path))
    path.write_text(as_toml(config, {}), encoding="utf-8")
    _must(configure(read_config(path)) == config, "a configuration as it is written reads back")


def _checkpoint(path: Path) -> None:
    body = path.read_bytes()
    head = b"gecar checkpoint 2 " + hashlib.sha256(body).hexdigest().encode()
    unpack(head + b"\n" + body, "1", path)


def _robot(path: Path) -> None:
    robot = read_robot(path)
    write_robot(robot, path)
    _must(read_robot(path) == robot, "a robot as it is written reads back")


_RUN_FILES: dict[str, Callable[[Path], object]] = {
    "config.toml": _config,
    "checkpoint": _checkpoint,
    "history.csv": lambda path: read_history(path.parent),
    "result.json": lambda path: read_result(path.parent),
    "study.json": lambda path: read_study(path.parent),
    "fitness.toml": read_table,
    "robot.toml": _robot,
}

TARGETS: dict[str, Callable[[bytes, Path], None]] = {
    read.__name__: read for read in (grammar, program, course, picture, recording, log, run)
}

WORDS = {
    "grammar": '<code> ::= | "motor(" \\n GE_RANGE: # <a> <b> \' \\ <=',
    "program": "motor( motorUntil( if( if else { } == <= AND OR NOT && ( ) SensorValue(0) int( ; \t - * 100, "
    "while( r0 = r7 PreviousValue Timer reset_timer() def f() f() and or not( 0.4 / 0 99999",
    "course": 'map=\'\'\' goal=[ [start] tile=[ heading="up" [[walls]] from_m=[ to_m=[ [[obstacles]] at_m=[ kind="box" '
    'kind="disc" size_m=[ diameter_m= heading_deg= mass_kg= movable=false checkpoints=[ tile_size_m= field_m=[ '
    "line_width_m= [image] file= pixels_per_metre= marks_px=[ marks_m=[ F- 7 L J | # . + > < = : ~ S [ ] 1e308 inf",
    "picture": "IHDR IDAT IEND PLTE tRNS iCCP zTXt GIF89a BM II* P5 P6 P2 RIFF JFIF",
    "recording": "t_s, left_duty_pct right_duty_pct left_angle_deg reflection_pct x_m heading_deg battery_v rig= "
    'course= robot="robot.toml" program= duty_cap= [noise] ===== 1e308 -1e-320 ,, [motor] [battery] [drive]',
    "log": "t_s ms time left right duty angle x y heading deg rad nan ; , \t # ===== 1e308 -1 0.01 reflection DataLog "
    "pwm enc speed mm/s rpm trial %time field.header.stamp.nsecs orientation.z 12:30:01.020 2026-11-21T12:00:00 left:1",
    "run": "config.toml checkpoint history.csv result.json study.json fitness.toml robot.toml fitness_s {} [] null NaN "
    "1e999 [[drive]] [[search]] seeds= program= [search] population= genomes rows codons n_arrivals -1 [effects. seed=",
}
"""Words of each target's language that chance would not come upon soon."""


def _file(folder: Path, name: str, content: bytes | None) -> Path:
    """Write a file, or see to it that there is none."""
    path = folder / name
    if content is None:
        path.unlink(missing_ok=True)
    else:
        path.write_bytes(content)
    return path


def _must(holds: bool, what: str) -> None:
    if not holds:
        raise AssertionError(f"not so: {what}")


def _same(parsed: Program) -> bool:
    try:
        return parse_program(str(parsed)) == parsed
    except InputError:
        return False


def _reads_back(read: Recording, folder: Path) -> bool:
    path = folder / "again.csv"
    write_recording(read, path)
    try:
        return len(read_recording(path).t_s) == len(read.t_s)
    except InputError:
        return False


@cache
def _ev3() -> Robot:
    return load_robot("ev3")


@cache
def _paper() -> World:
    return World(_ev3(), load_course("paper"), step_s=0.01, time_limit_s=0.5)
