"""Reference times: the fastest drives an optimiser finds on each course; `python -m benchmarks.reference_times`.

A reference drive has no sensor. It steers by knowing where it is: towards one point after another, the outer wheel
always at full duty. Points, how sharply to steer and when to turn to the next one are found by CMA-ES, on the nominal
robot, with contacts. What the motors were told becomes a program of `motor(left,right,time)` alone, and the time is
that program's, driven as any other.

    python -m benchmarks.reference_times                  # the table, from the drives that are stored
    python -m benchmarks.reference_times --search 3       # search again, 3 starts a course; keep what is faster
    python -m benchmarks.reference_times --renew          # after a change of the simulation: about the drives stored
    python -m benchmarks.reference_times --picture a.png --courses paper,obstacles
"""

from __future__ import annotations

import argparse
import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel
from gecar.files import write_whole
from gecar.language.program import parse_program
from gecar.plots.courses.course import draw_course
from gecar.plots.style import BLUE, GREEN, headline, look, new_figure, save
from gecar.reality.optimisation.cma_es import cma_es
from gecar.world.course.course import Course, list_courses, load_course
from gecar.world.course.reference_times import TABLE, reference_table
from gecar.world.kernel.drive import GOAL, RUNNING, Setup, advance, begin_program, enter_tile
from gecar.world.kernel.state import place
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import Drive, Driver, Outcome, World, simulate

ROBOT = "ev3"
EVERY = 5  # steps a command is held: 10 ms
LONGEST_S = 30.0
UNREACHED = 100.0
SPREAD = np.array(
    [0.03, 0.03, 0.5, 0.05]
)  # of a point [m, m], how sharply to steer (log), how early to turn [m]
FARTHEST = np.array([0.35, 0.35, 3.5, 0.5])
NEAR = 0.1  # of these spreads, about a drive that is stored
SHARP, EARLY_M, OUT_M = (
    3.0,
    0.06,
    0.03,
)  # where the search begins: 3 cm outside of each bend of the shortest way
BETWEEN_M = 0.6  # between points on a long leg of a course with obstacles
TURNS_BACK = math.radians(100.0)  # from here on a bend may be driven as a change of direction

Array = npt.NDArray[np.float64]


@kernel
def pursue(
    points: npt.NDArray[np.float64],
    setup: Setup,
    arrival: npt.NDArray[np.float64],
    duties: npt.NDArray[np.int32],
    every: int,
) -> tuple[int, int, float]:
    """Drive towards points in turn, and write down what the motors are told.

    Parameters
    ----------
    points
        x, y [m], steering [1/rad], how far before it to turn to the next [m], and 1 forwards or -1 backwards,
        shape (n, 5).
    setup
        The robot, the course, and their memory.
    arrival
        Filled with the time each tile of the sequence is reached at [s], shape (k,).
    duties
        Filled with the commands [%], one for each ``every`` steps, shape (m, 2).

    Returns
    -------
    tuple
        (outcome, steps, cost: the time in s, or how far from GOAL it ended).
    """
    p, c, s, k, floor = setup.physics[0], setup.derived[0], setup.state[0], setup.control[0], setup.floor
    x, y = last_x, last_y = setup.start[0], setup.start[1]
    place(s, p, x, y, setup.start[2])
    begin_program(k, 0.0, c.dt, s, p, floor)
    passed, target, outcome = 0, 0, RUNNING
    left = right = 0.0
    steps = duties.shape[0] * every
    n = 0
    while n < steps:
        x, y = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
        outcome, passed = enter_tile(n, s, p, c, k, floor, passed, arrival)
        if outcome != RUNNING:
            break
        if n % every == 0:
            while target < points.shape[0] - 1:
                dx, dy = points[target, 0] - last_x, points[target, 1] - last_y
                along = (points[target, 0] - x) * dx + (points[target, 1] - y) * dy
                if along > points[target, 3] * math.sqrt(dx * dx + dy * dy):
                    break
                last_x, last_y = points[target, 0], points[target, 1]
                target += 1
            ahead = points[target, 4]
            off = math.atan2(ahead * (points[target, 1] - y), ahead * (points[target, 0] - x)) - s.heading
            off -= 2.0 * math.pi * round(off / (2.0 * math.pi))
            turn = min(max(points[target, 2] * off, -2.0), 2.0)
            inner = 1.0 - abs(turn)
            if ahead > 0.0:
                left, right = (inner, 1.0) if turn > 0.0 else (1.0, inner)
            else:
                left, right = (-1.0, -inner) if turn > 0.0 else (-inner, -1.0)
            left, right = round(100.0 * p.duty_cap * left) / 100.0, round(100.0 * p.duty_cap * right) / 100.0
            duties[n // every, 0], duties[n // every, 1] = round(100.0 * left), round(100.0 * right)
        advance(n, s, left, right, p, c, setup.commands, setup.engine)
        n += 1
    if outcome == GOAL:
        return outcome, n, n * c.dt
    goal = floor.sequence[min(passed, floor.sequence.shape[0] - 1)]
    gx, gy = (goal % floor.columns + 0.5) / floor.per_tile, (goal // floor.columns + 0.5) / floor.per_tile
    away = math.sqrt((gx - x) ** 2 + (gy - y) ** 2)
    return outcome, n, 100.0 + (floor.sequence.shape[0] - passed) * 1.0 + away


class Search:
    """The search for the fastest drive of a robot on a course."""

    def __init__(self, robot: Robot, course: Course, longest_s: float = LONGEST_S) -> None:
        self.world = World(robot, course, time_limit_s=longest_s)
        self._driver = Driver(self.world)
        self._arrival = np.zeros(len(self._driver.setup.floor.sequence))
        self._duties = np.zeros((round(longest_s / (EVERY * self.world.step_s)), 2), np.int32)
        self._bends, self._backs = _targets(course)

    def best_of(
        self, seed: int, reverses: bool = False, generations: int = 400, wider: int = 2
    ) -> tuple[float, Array]:
        """Return the best drive from one start of the search.

        Returns
        -------
        tuple
            (its time in s, above `UNREACHED` if none reached GOAL; its points, as `pursue` takes them).
        """
        k = len(self._bends)
        ahead = self._backs if reverses else np.ones(k)
        begin = np.column_stack([self._bends, np.full(k, SHARP), np.full(k, EARLY_M), ahead])
        return self.best_about(begin, seed, generations, wider)

    def best_about(
        self, begin: Array, seed: int, generations: int, wider: int = 2, near: float = 1.0
    ) -> tuple[float, Array]:
        """Return the best drive about another one, as `best_of` does; ``near`` is the share of its spread."""
        k = len(begin)

        def points(numbers: Array) -> Array:
            moved = numbers.reshape(k, 4)
            sharp, early = begin[:, 2] * np.exp(moved[:, 2]), begin[:, 3] + moved[:, 3]
            return np.column_stack([begin[:, :2] + moved[:, :2], sharp, early, begin[:, 4]]).round(5)

        bounds = np.tile(FARTHEST, k)
        best, least = cma_es(
            lambda tried: np.array([self.drive(points(numbers))[0] for numbers in tried]),
            np.zeros(4 * k), np.tile(near * SPREAD, k), (-bounds, bounds),
            np.random.default_rng(seed), generations, wider, patience=60, least_gain=0.002,
        )  # fmt: skip
        return least, points(best)

    @property
    def can_reverse(self) -> bool:
        """Whether the way turns back anywhere."""
        return bool(np.any(self._backs < 0.0))

    def drive(self, points: Array) -> tuple[float, npt.NDArray[np.int32]]:
        """Drive towards points: return the time [s], or what it costs not to get there, and the commands [%]."""
        d = self._driver
        d.reset()
        _, steps, cost = pursue(points, d.setup, self._arrival, self._duties, EVERY)
        return cost, self._duties[: -(-steps // EVERY)]


def _targets(course: Course) -> tuple[Array, Array]:
    """Return points to begin from, shape (n, 2), and whether each would be driven to forwards (1) or backwards (-1)."""
    way = [np.array(course.shortest.path.coords[0])]
    way += [np.array(q) for q in course.shortest.path.coords[1:] if math.dist(q, way[-1]) > 1e-6]
    if course.obstacles:
        way = _with_points_between(way)
    along = [(b - a) / math.dist(a, b) for a, b in pairwise(way)]
    outward = [(a - b) / max(float(np.linalg.norm(a - b)), 1e-9) for a, b in pairwise(along)]
    points = [place + OUT_M * out for place, out in zip(way[1:-1], outward, strict=True)]
    ahead = np.cumprod([1.0] + [-1.0 if a @ b < math.cos(TURNS_BACK) else 1.0 for a, b in pairwise(along)])
    return np.array([*points, way[-1] + 0.1 * along[-1]]), ahead


def _with_points_between(way: list[Array]) -> list[Array]:
    """Return a way with points on its long legs, to steer round what stands there."""
    points = [way[0]]
    for a, b in pairwise(way):
        pieces = max(1, round(math.dist(a, b) / BETWEEN_M))
        points += [a + (b - a) * k / pieces for k in range(1, pieces + 1)]
    return points


def program_of(duties: npt.NDArray[np.int32]) -> str:
    """Return commands of 10 ms each [%] as a program's text."""
    lines, held = [], 1
    for k in range(len(duties)):
        if k + 1 < len(duties) and np.array_equal(duties[k], duties[k + 1]):
            held += 1
            continue
        lines.append(f"motor({duties[k, 0]},{duties[k, 1]},{10 * held})")
        held = 1
    return "\n".join(lines) + "\n"


def drive_of(course: str) -> Drive:
    """Drive a course's reference drive as a program of `motor(left,right,time)` alone, with its trace."""
    hunt = Search(load_robot(ROBOT), load_course(course))
    _, duties = hunt.drive(np.array(reference_table()[course]["points"]))
    return simulate(hunt.world, parse_program(program_of(duties)).opcodes, trace=True)


def search(course: str, starts: range, generations: int) -> None:
    """Search from several starts, and keep what is faster than what is stored."""
    hunt = Search(load_robot(ROBOT), load_course(course))
    for seed in starts:
        for reverses in (False, True) if hunt.can_reverse else (False,):
            time_s, points = hunt.best_of(seed, reverses, generations)
            came = f"{time_s:.3f} s" if time_s < UNREACHED else "did not arrive"
            print(
                f"{course}, start {seed}{', turning back' if reverses else ''}: {came}",
                file=sys.stderr,
                flush=True,
            )
            if time_s < reference_table().get(course, {"time_s": UNREACHED})["time_s"]:
                _keep(course, time_s, points)


def renew(course: str, generations: int) -> None:
    """Search about the drive that is stored, and store what is best now."""
    hunt = Search(load_robot(ROBOT), load_course(course))
    stored = np.array(reference_table()[course]["points"])
    now = hunt.drive(stored)[0]
    found = [hunt.best_about(stored, seed, generations, near=near) for seed, near in enumerate((NEAR, 1.0))]
    time_s, points = min([(now, stored), *found], key=lambda drive: drive[0])
    print(f"{course}: {now:.3f} s, {time_s:.3f} s after the search", file=sys.stderr, flush=True)
    if time_s < UNREACHED:
        _keep(course, time_s, points)


def _keep(course: str, time_s: float, points: Array) -> None:
    """Write the table of reference times with one course's drive in it."""
    found = {**reference_table(), course: {"time_s": round(time_s, 6), "points": points.tolist()}}
    lines = [
        "# Reference times: the fastest drives found by `python -m benchmarks.reference_times --search`, which reads",
        "# points as x, y [m], steering [1/rad], how early to turn to the next [m], 1 forwards or -1 backwards.",
        f'robot = "{ROBOT}"',
    ]
    for name in (name for name in list_courses() if name in found):
        lines += ["", f"[{name}]", f"time_s = {found[name]['time_s']}", "points = ["]
        lines += [f"    {point}," for point in found[name]["points"]] + ["]"]
    write_whole(TABLE, "\n".join(lines) + "\n")
    reference_table.cache_clear()


def rows() -> list[tuple[str, str, str]]:
    """Return the table's rows: course, lower bound, reference and their ratio; each drive is driven again."""
    robot, table = load_robot(ROBOT), []
    for name in (name for name in list_courses() if name in reference_table()):
        bound, drive = load_course(name).lower_bound_s(robot), drive_of(name)
        if drive.outcome != Outcome.GOAL:
            table.append((name, f"its drive {drive.outcome.sentence}", "search again"))
            continue
        above = 100.0 * (drive.time_s / bound - 1.0)
        value = f"lower bound {bound:.3f} s, reference {drive.time_s:.3f} s, {above:.1f} % above it"
        table.append((name, value, "above the bound"))
    return table


def picture(courses: list[str], target: Path) -> None:
    """Draw the reference drives of some courses beside the shortest ways."""
    with look():
        figure = new_figure(5.6 * len(courses), 4.0)
        headline(figure, "Reference drives", "the fastest found; the shortest way through the tiles dashed")
        for axes, name in zip(np.atleast_1d(figure.subplots(1, len(courses))), courses, strict=True):
            course, drive = load_course(name), drive_of(name)
            draw_course(axes, course)
            axes.plot(*course.shortest.path.xy, color=GREEN, linewidth=1.2, linestyle=(0, (4, 2)), zorder=3.0)
            assert drive.trace is not None
            axes.plot(drive.trace["x_m"], drive.trace["y_m"], color=BLUE, linewidth=1.8, zorder=4.0)
            axes.set_title(f"{course.title}: {drive.time_s:.2f} s")
        figure.draw_without_rendering()
        save(figure, target)


def main() -> None:
    """Search, draw, or print the table."""
    parser = argparse.ArgumentParser(description="Reference times: the fastest drives an optimiser finds.")
    parser.add_argument("--courses", default=",".join(list_courses()), help="names, with commas between")
    parser.add_argument(
        "--search", type=int, default=0, metavar="N", help="search from so many starts a course"
    )
    parser.add_argument(
        "--renew", action="store_true", help="search about the stored drives, and store them anew"
    )
    parser.add_argument("--first", type=int, default=0, help="number of the first start")
    parser.add_argument("--generations", type=int, default=400, help="of each search, at most")
    parser.add_argument("--picture", type=Path, help="draw the courses' drives")
    asked = parser.parse_args()
    for name in asked.courses.split(",") if asked.search else ():
        search(name, range(asked.first, asked.first + asked.search), asked.generations)
    for name in asked.courses.split(",") if asked.renew else ():
        renew(name, asked.generations)
    if asked.picture:
        picture(asked.courses.split(","), asked.picture)
    for figure, value, goal in rows():
        print(f"{figure:14} {value}   {goal}")


if __name__ == "__main__":
    main()
