import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.plots import style
from gecar.plots.courses.course import draw_course, show_whole
from gecar.plots.drives.animation import FRAMES_PER_S, film
from gecar.plots.drives.path import by_line, every_distance, line_colours, speed_of
from gecar.plots.drives.trajectory import trajectory
from gecar.plots.runs.compare_runs import compare_runs
from gecar.plots.runs.convergence import Reference, convergence
from gecar.plots.runs.population import population_figure
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

EV3 = load_robot("ev3")
SHORT = World(EV3, load_course("paper"), time_limit_s=2.0)
LAPS = parse_program("if(SensorValue > 80):\n    motor(70,100,20)\nelse:\n    motor(-20,-80,170)")
ENDLESS = parse_program("\n".join(f"motor({k % 90},{(k + 7) % 90},10)" for k in range(90)))
REFERENCES = (Reference("the paper's best", 16.74), Reference("lower bound", 11.34))


def history(best):
    generation = np.arange(float(len(best)))
    return {
        "generation": generation,
        "best": np.asarray(best, float),
        "mean": np.full(len(best), 6e3),
        "valid": np.linspace(0.6, 1.0, len(best)),
        "distinct": np.linspace(0.9, 0.2, len(best)),
        "evaluations": 200 * (generation + 1),
    }


def test_sizes_depths_diversity_and_shares_are_drawn_whole():
    rising = {name: np.linspace(1.0, 5.0, 40) for name in ("size", "depth", "entropy")}
    shares = {"valid": np.linspace(0.5, 1.0, 40), "distinct": np.linspace(1.0, 0.1, 40)}
    columns = {"generation": np.arange(40.0), **rising, **shares}
    figure = population_figure(columns, 40, "A title", "a detail")
    assert style.is_whole(figure)
    valid, distinct = figure.axes[-1].get_lines()
    assert (valid.get_ydata()[-1], distinct.get_ydata()[-1]) == pytest.approx((100.0, 10.0))


@pytest.mark.parametrize("program", [LAPS, ENDLESS], ids=["short", "long"])
@pytest.mark.parametrize("colour", ["line", "speed"])
def test_a_trajectory_shows_everything_within_its_edges(program, colour):
    drive = simulate(SHORT, program.opcodes, trace=True)
    figure = trajectory(
        SHORT, program, drive, title="A title", detail="and what it was made with", colour=colour
    )
    assert style.is_whole(figure)


def test_a_program_that_never_moves_has_a_picture_too():
    stuck = parse_program("if(SensorValue > 80):\n    pass")
    drive = simulate(SHORT, stuck.opcodes, trace=True)
    assert style.is_whole(trajectory(SHORT, stuck, drive))


@pytest.mark.parametrize("name", ["paper", "obstacles"])
def test_a_film_is_as_long_as_the_drive(tmp_path, name):
    world = World(EV3, load_course(name), time_limit_s=1.0)
    drive = simulate(world, LAPS.opcodes, trace=True)
    film(world, LAPS, drive, tmp_path / "drive.gif", title="A title", pace=2.0)
    with Image.open(tmp_path / "drive.gif") as image:
        assert image.n_frames == pytest.approx(0.5 * drive.time_s * FRAMES_PER_S, abs=1.5)


def test_a_film_keeps_the_colours_of_the_picture(tmp_path):
    drive = simulate(SHORT, LAPS.opcodes, trace=True)
    film(SHORT, LAPS, drive, tmp_path / "drive.gif", pace=4.0)
    with Image.open(tmp_path / "drive.gif") as image:
        seen = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)
    for colour in (style.BLUE, style.INK):
        assert np.abs(seen - 255 * np.array(to_rgb(colour))).sum(axis=1).min() < 20


@pytest.mark.parametrize(
    ("name", "pace", "named"), [("x.avi", 1.0, ".gif or .mp4"), ("x.gif", 0.0, "--pace")]
)
def test_a_film_that_can_not_be_made_says_why(tmp_path, name, pace, named):
    drive = simulate(SHORT, LAPS.opcodes, trace=True)
    with pytest.raises(InputError, match=named):
        film(SHORT, LAPS, drive, tmp_path / name, pace=pace)


def test_an_mp4_needs_ffmpeg(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    drive = simulate(SHORT, LAPS.opcodes, trace=True)
    with pytest.raises(InputError, match="no ffmpeg"):
        film(SHORT, LAPS, drive, tmp_path / "x.mp4")


@pytest.mark.parametrize(
    "best",
    [[1e4] * 5, [1e4], [14.2], [1e4, 1e4, 24.0, 18.0, 14.2], [16.8, 16.74, 16.7]],
    ids=["never", "never, one generation", "one generation", "late", "at once"],
)
def test_convergence_shows_everything_within_its_edges(best):
    figure = convergence(history(best), REFERENCES, "A title", "and what it was made with")
    assert style.is_whole(figure)


def test_convergence_says_when_nobody_is_at_goal():
    words = [text.get_text() for text in convergence(history([1e4, 1e4])).axes[0].texts]
    assert "no program reaches GOAL yet" in words
    words = [text.get_text() for text in convergence(history([20.0, 14.2])).axes[0].texts]
    assert words == ["14.20 s"]


def test_the_legend_names_the_times_to_compare_with():
    for figure in (
        convergence(history([1e4]), REFERENCES),
        compare_runs({"one": [history([20.0])]}, REFERENCES),
    ):
        words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
        assert {"the paper's best, 16.74 s", "lower bound, 11.34 s"} <= set(words)


def test_words_over_the_edge_are_found():
    figure = style.new_figure(2.0, 1.0)
    assert style.is_whole(figure)
    figure.text(0.5, 0.5, "words that are wider than the picture they stand in")
    assert not style.is_whole(figure)


def test_runs_beside_each_other_show_everything_within_their_edges():
    late, soon, never = history([1e4, 1e4, 20.0]), history([30.0, 20.0]), history([1e4])
    figure = compare_runs({"one": [late, soon, never], "other": [never]}, REFERENCES, "A title", "a detail")
    assert style.is_whole(figure)


def test_a_run_without_goal_counts_as_slower_than_any_other():
    figure = compare_runs({"both": [history([20.0, 20.0]), history([1e4, 1e4]), history([1e4, 30.0])]})
    median = figure.axes[0].get_lines()[0].get_ydata()
    assert np.isnan(median[0])
    assert median[1] == 30.0


def test_each_line_that_drives_has_a_colour_of_its_own():
    trace = simulate(SHORT, LAPS.opcodes, trace=True).trace
    colours = line_colours(trace)
    assert set(colours) == {2, 4}
    assert len(set(colours.values())) == 2
    assert by_line(trace).rgb.shape == (len(trace["t_s"]), 3)


def test_robots_are_drawn_a_distance_apart():
    trace = simulate(SHORT, LAPS.opcodes, trace=True).trace
    at = every_distance(trace, 0.1)
    assert at[-1] == len(trace["t_s"]) - 1
    assert len(at) == pytest.approx(np.sum(speed_of(trace)) * 0.01 / 0.1, abs=2)


def test_pictures_are_the_same_every_time(tmp_path):
    drawn = [
        style.save(convergence(history([20.0, 14.2])), tmp_path / f"{k}.png").read_bytes() for k in (1, 2)
    ]
    assert drawn[0] == drawn[1]


def test_a_path_that_leaves_the_course_is_in_the_picture():
    axes = style.new_figure(4.0, 3.0).add_subplot()
    draw_course(axes, SHORT.course)
    inside = axes.get_xlim()
    show_whole(axes, np.array([[0.1, 0.1], [0.1, SHORT.course.height_m + 1.0]]))
    assert axes.get_ylim()[1] > SHORT.course.height_m + 1.0
    assert axes.get_xlim() == inside
