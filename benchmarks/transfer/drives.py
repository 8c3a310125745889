"""All drives of a benchmark, each kept as soon as it is over."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from benchmarks.transfer.driving import Drive, Robot, drive
from benchmarks.transfer.floor import Floor, load_floor
from benchmarks.transfer.sealing import Winner
from benchmarks.transfer.variations import NOMINAL, Variation, draw
from gecar.errors import expected
from gecar.files import write_whole

ENGINES = {"mujoco": "MuJoCo", "pybullet": "PyBullet"}
_CLASSES = {"mujoco": ("mujoco_robot", "MujocoRobot"), "pybullet": ("bullet_robot", "BulletRobot")}
_HERE = Path(__file__).parent
_SOURCES = [
    *(_HERE / f"{name}.py" for name in ("floor", "driving", "variations", "bullet_robot", "mujoco_robot")),
    *(_HERE.parent / "concealed" / f"{name}.py" for name in ("body", "drive_train", "robot")),
]

Key = tuple[str, str, int]
"""Winner's name, engine, and 0 for the nominal robot or the number of the variation."""


class Drives:
    """A folder of finished drives.

    Parameters
    ----------
    out
        The benchmark's folder.
    variations
        How many robots beside the nominal one.
    """

    def __init__(self, out: Path, variations: int) -> None:
        self._folder = out / "drives"
        self._robots = [NOMINAL, *draw(variations)]
        self._floors: dict[str, Floor] = {}

    def plan(self, winners: Sequence[Winner], engines: Sequence[str]) -> list[tuple[Winner, str, int]]:
        """Return all drives, nominal robots first, so that a benchmark that is stopped has seen every winner.

        Raises
        ------
        InputError
            If an engine is not installed, or a course can not be built here.
        """
        for engine in engines:
            robot_class(engine)
        for winner in winners:
            self._floors.setdefault(winner.course, load_floor(winner.course))
        numbers = range(len(self._robots))
        return [(winner, engine, k) for k in numbers for winner in winners for engine in engines]

    def perform(self, winner: Winner, engine: str, number: int) -> Drive:
        """Return a drive that is kept, or drive and keep it; winners of the same program share theirs."""
        course = self._floors[winner.course].name
        path = self._folder / f"{winner.sha256[:16]}_{course}_{engine}_{number}.json"
        mark = {"program": winner.sha256, "limit_s": winner.limit_s, "instrument": instrument(engine)}
        kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        if {name: kept.pop(name, "") for name in mark} == mark:
            return Drive(**kept)
        made = self._drive(winner, engine, self._robots[number])
        self._folder.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps({**mark, **asdict(made)}) + "\n", durable=False)
        return made

    def _drive(self, winner: Winner, engine: str, variation: Variation) -> Drive:
        robot: Robot = robot_class(engine)(variation)
        try:
            return drive(robot, winner.rows, self._floors[winner.course], variation, winner.limit_s)
        finally:
            robot.close()


@cache
def robot_class(engine: str) -> Callable[[Variation], Robot]:
    """Return the robot of an engine.

    Raises
    ------
    InputError
        If the engine is not installed.
    """
    module, name = _CLASSES[engine]
    try:
        found: Callable[[Variation], Robot] = getattr(import_module(f"benchmarks.transfer.{module}"), name)
    except ModuleNotFoundError as error:
        raise expected("engine", f"no {error.name}", "it installed: pip install -e '.[bench]'") from None
    return found


@cache
def instrument(engine: str) -> str:
    """Return a hash of everything that decides a drive but the program: a drive made by another is made again."""
    digest = hashlib.sha256(f"{engine} {version(engine)}\n".encode())
    for source in _SOURCES:
        digest.update(source.read_bytes())
    return digest.hexdigest()
