"""A drive in one picture: the way on the course, the program beside it, sensor and motors below."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from gecar.errors import expected
from gecar.language.program import Program
from gecar.plots.courses.robot import RobotArtist, shape_of
from gecar.plots.drives.obstacles import draw_moved
from gecar.plots.drives.path import Colouring, by_line, by_speed, draw_path, every_distance
from gecar.plots.drives.program_listing import Listing
from gecar.plots.drives.traces import HEIGHT_RATIOS, draw_traces
from gecar.plots.style import INK, SPEED_COLOURS, headline, look, new_figure
from gecar.world.rollout import Drive, Outcome, World

WIDTH_IN = 11.0
MAP_WIDTH_IN = 7.8
TRACES_HEIGHT_IN = 3.3
ROBOT_SPACING_M = 0.30
COLOURINGS = ("auto", "line", "speed")


def trajectory(
    world: World,
    program: Program,
    drive: Drive,
    *,
    title: str = "",
    detail: str = "",
    colour: str = "auto",
    others: Sequence[Drive] = (),
) -> Figure:
    """Draw a drive.

    Parameters
    ----------
    world, program, drive
        Who drove where, with what program, and what came of it; the drive holds its trace.
    title, detail
        What to write above and below.
    colour
        ``"line"``: the way's colour says which line of the program drives; ``"speed"``: how fast it is.
        ``"auto"``: by line, where there are few enough to tell apart.
    others
        Drives of the same program under other conditions, with traces: drawn thin behind it.

    Raises
    ------
    InputError
        If the drive holds no trace, or the colouring is unknown.
    """
    if drive.trace is None:
        raise expected("drive", "no trace", "one simulated with trace=True")
    colouring = choose(world, drive, colour)
    course = world.course
    map_height = min(max(MAP_WIDTH_IN * course.height_m / course.width_m, 2.6), 6.5)
    with look():
        figure = new_figure(WIDTH_IN, map_height + TRACES_HEIGHT_IN + 0.9)
        headline(figure, title, detail)
        ratios = (map_height, *(TRACES_HEIGHT_IN * r / sum(HEIGHT_RATIOS) for r in HEIGHT_RATIOS))
        grid = figure.add_gridspec(
            5, 2, height_ratios=ratios, width_ratios=(MAP_WIDTH_IN, WIDTH_IN - MAP_WIDTH_IN)
        )
        traces = [figure.add_subplot(grid[row, :]) for row in range(1, 5)]
        draw_traces(traces, drive.trace, colouring, program.opcodes)
        floor = figure.add_subplot(grid[0, 0])
        _draw_others(floor, others)
        draw_map(floor, world, drive, colouring)
        if not colouring.lines:
            _speed_key(figure, floor, world)
        Listing(figure.add_subplot(grid[0, 1]), program.source, colouring.lines)
    return figure


def check_colour(colour: str) -> None:
    """Check that there is such a colouring.

    Raises
    ------
    InputError
        If there is none.
    """
    if colour not in COLOURINGS:
        raise expected("--colour", repr(colour), " or ".join(COLOURINGS))


def choose(world: World, drive: Drive, colour: str) -> Colouring:
    """Colour a drive's samples; see `trajectory`."""
    check_colour(colour)
    assert drive.trace is not None
    lines = by_line(drive.trace)
    few = len(lines.lines) <= 7
    if colour == "line" or (colour == "auto" and few):
        return lines
    return by_speed(drive.trace, top_speed(world))


def top_speed(world: World) -> float:
    """Return the speed that two free wheels at full duty would drive at [m/s], to scale colours."""
    physics = world.robot.physics[0]
    return float(
        physics["wheel_radius"] * physics["voltage"] * physics["duty_cap"] / physics["back_emf_constant"]
    )


def draw_map(axes: Axes, world: World, drive: Drive, colouring: Colouring) -> None:
    """Draw the course, the way on it, and the robot at intervals."""
    trace = drive.trace
    assert trace is not None
    draw_moved(axes, world.course, drive)
    draw_path(axes, trace, colouring)
    at = every_distance(trace, ROBOT_SPACING_M * max(1.0, world.course.length_m / 8.0))
    for sample in at:
        last = sample == at[-1]
        robot = RobotArtist(axes, shape_of(world.robot), 1.0 if last else 0.22, 6.0 if last else 3.0)
        robot.move(trace["x_m"][sample], trace["y_m"][sample], trace["heading_rad"][sample])


def _draw_others(axes: Axes, others: Sequence[Drive]) -> None:
    """Draw the ways of other drives, and where those ended that missed GOAL."""
    for other in others:
        if other.trace is not None:
            x, y = other.trace["x_m"], other.trace["y_m"]
            axes.plot(x, y, color=INK, linewidth=0.5, alpha=0.22, zorder=2.2)
            if other.outcome != Outcome.GOAL:
                axes.plot(x[-1], y[-1], "x", color=INK, markersize=5, zorder=4)


def _speed_key(figure: Figure, axes: Axes, world: World) -> None:
    colours = ScalarMappable(Normalize(0.0, top_speed(world)), SPEED_COLOURS)
    bar = figure.colorbar(colours, ax=axes, location="bottom", aspect=50, pad=0.02, shrink=0.5)
    bar.set_label("speed [m/s]", size=8)
