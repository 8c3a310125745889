"""The share of drives that arrive, beside every time to GOAL."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.command import call
from support.courses import course_text

from gecar.cli.actions.run_pictures import _champions
from gecar.cli.inputs import build_world, find_program
from gecar.language.program import parse_program
from gecar.plots.runs.compare_runs import compare_runs
from gecar.plots.runs.convergence import Reference, convergence
from gecar.plots.runs.study_table import convergences, heat_map
from gecar.plots.style import is_whole
from gecar.reality.calibrate.constants import with_constants
from gecar.report.drive import title_of
from gecar.report.runs import run_title
from gecar.report.table import csv_text, markdown, runs_csv
from gecar.results import run
from gecar.results.ancestry import read_ancestry
from gecar.results.arrival import arrives, median_share, percent, share_of, with_share
from gecar.results.cells import cells_of
from gecar.results.config import Config
from gecar.results.folder import read_result
from gecar.results.study import Axis, Study
from gecar.search.chance import REPORT, REPORTED_DRAWS, arrivals
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Drive, Outcome, World

TINY = ("--population", 20, "--generations", 2, "--workers", 1, "--quiet", "--no-pictures")


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A course that many random programs finish: four tiles straight on."""
    path = tmp_path_factory.mktemp("course") / "short.toml"
    path.write_text(course_text("----", "[0, 0]", "[3, 0]", '"right"', start_more="left_m = -0.025"))
    return path


@pytest.fixture(scope="module")
def runs(short):
    """Runs of the paper's search and of the default one."""
    for preset in ("paper", "better"):
        words = ("--preset", preset, "--course", short, "--out", short.with_name(preset))
        assert call("evolve", *words, *TINY) == 0
    return short.parent


@pytest.fixture
def old(runs, tmp_path):
    """A run's folder from before shares were measured."""
    folder = Path(shutil.copytree(runs / "paper", tmp_path / "old"))
    result = read_result(folder)
    del result["arrives"]
    (folder / "result.json").write_text(json.dumps(result))
    return folder


def records(runs, shares):
    """Return a study's records with shares, None for those from before they were measured."""
    told = [{} if share is None else {"arrives": {"share": share}} for share in shares]
    return [
        {
            "fitness_s": 15.0, "solved": True, "seed": run.config.seed, "evaluations": 20, "wall_s": 0.5,
            "distinct_evaluations": 7, "simulated_steps": 900, "found_in_generation": 1, "program": "",
            "history": {"generation": [0, 1], "best": [1e4, 15.0]}, **each,
        }
        for run, each in zip(runs, told, strict=True)
    ]  # fmt: skip


def study(shares):
    """Return a study of one cell, and its cells."""
    seeds = tuple(range(len(shares)))
    asked = Study({}, {}, Axis("elites", (0,)), Axis("mutation_rate", (0.1,)), seeds)
    return asked, cells_of(asked.plan(), records(asked.plan(), shares))


@pytest.mark.parametrize(
    ("share", "words"), [(0.99, "99 %"), (0.995, "99.5 %"), (1.0, "100 %"), (0.0, "0 %"), (None, "- %")]
)
def test_a_share_is_written_in_one_form(share, words):
    assert percent(share) == words
    assert with_share(17.654, share) == f"17.65 s, {words} arrive"


@pytest.mark.parametrize("result", [{}, {"arrives": None}, {"arrives": {}}, {"arrives": {"share": "most"}}])
def test_a_result_without_a_share_has_none(result):
    assert share_of(result) is None
    assert np.isnan(median_share([result, {"arrives": {"share": 1.0}}]))


def test_titles_of_drives_and_runs_say_the_share():
    goal, lost = (Drive(outcome, 16.74, 18, None, 0) for outcome in (Outcome.GOAL, Outcome.OFF_COURSE))
    assert title_of(goal, load_course("paper"), 0.02).endswith("GOAL in 16.74 s, 2 % arrive")
    assert title_of(lost, load_course("paper"), 0.02).endswith("after 16.74 s, 2 % arrive")
    result = {"solved": True, "fitness_s": 16.74, "generations": 50, "arrives": {"share": 0.02}}
    assert run_title(Config(), result).endswith("GOAL in 16.74 s, 2 % arrive")


def test_the_papers_search_says_how_its_winner_fares(gecar, short):
    ended = gecar("evolve", "--preset", "paper", "--course", short, *TINY, "--out", "new")
    told = read_result(Path("new"))["arrives"]
    assert set(told) == {"share", "of", "median_s", "p95_s", "steps"}
    assert (told["of"], len(told["steps"])) == (200, 5)
    assert f"Of 200 drives under random conditions {percent(told['share'])} arrive" in ended.out
    assert "steps of 4 to 0.25 ms it arrives" in ended.out


def test_a_cells_share_is_the_median_of_its_runs():
    asked, cells = study([0.9, 0.5, 0.98])
    text = markdown(asked, cells, {}, "about")
    assert "| 0 | 15.00, 90 % |" in text
    assert "| 15.00 to 15.00 | 90 % |" in text
    assert next(csv.DictReader(csv_text(asked, cells, {}).splitlines()))["arrives_share"] == "0.9"
    shares = [row["arrives_share"] for row in csv.DictReader(runs_csv(asked, cells).splitlines())]
    assert shares == ["0.9", "0.5", "0.98"]


def test_a_cell_with_a_run_that_does_not_say_has_a_dash():
    asked, cells = study([0.9, None])
    assert "| 0 | 15.00, - % |" in markdown(asked, cells, {}, "about")
    assert next(csv.DictReader(csv_text(asked, cells, {}).splitlines()))["arrives_share"] == ""


@pytest.mark.parametrize("shares", [[0.995], [None]])
def test_a_studys_pictures_show_shares_within_their_edges(shares):
    _, cells = study(shares)
    figures = [draw(cells, ("elites", "mutation"), {}, "A title", "") for draw in (convergences, heat_map)]
    for figure in figures:
        assert is_whole(figure)
        assert any(percent(shares[0]) in text.get_text() for axes in figure.axes for text in axes.texts)


def test_an_older_run_is_drawn_with_a_dash(gecar, old, runs):
    ended = gecar("plot", old, "--html", "--json")
    assert len(ended.json["pictures"]) == 6
    assert "- % arrive" in (old / "drive.html").read_text()
    beside = gecar("plot", old, runs / "better")
    assert "- %" in beside.out
    assert Path("compare.png").exists()


def test_pages_and_titles_of_a_run_say_its_share(gecar, runs, tmp_path):
    assert gecar("plot", runs / "paper", "--html", "--out", tmp_path).code == 0
    share = share_of(read_result(runs / "paper"))
    assert f" s, {percent(share)} arrive" in (tmp_path / "drive.html").read_text()


# What the tutorial's `gecar evolve --seed 1` finds; its rehearsal calibrates the robot to these constants.
TUTORIAL = """
if(SensorValue > 80):
    motor(70,90,10)
else:
    motor(40,-80,10)
if(SensorValue > 80):
    motor(60,90,10)
else:
    motor(40,-80,0)
if(SensorValue > 75):
    motor(80,60,10)
else:
    motor(-50,-80,0)
"""
CALIBRATED = {"battery.voltage": 8.2, "body.track_width": 0.118}


@pytest.mark.parametrize("constants", [{}, CALIBRATED], ids=["as known", "calibrated"])
def test_the_tutorials_program_arrives_at_least_19_times_of_20(constants):
    world = World(with_constants(load_robot("ev3"), constants), load_course("paper"))
    program = parse_program(TUTORIAL)
    for seed in (2, 3, 4):  # draws that no run has seen
        (times,) = arrivals(world, [program.opcodes], REPORTED_DRAWS, (seed, REPORT))
        assert times.share >= 19 / 20


def test_each_program_of_a_film_has_its_own_share(runs):
    file, settings = find_program(runs / "paper")
    world = build_world(settings)
    champions = _champions(read_ancestry(runs / "paper"), world, settings)
    for champion in champions:
        share = arrives(world, champion.program, settings["seed"])["share"]
        assert champion.title.endswith(f"{percent(share)} arrive")
    assert champions[-1].program.source == file.read_text().strip()


def test_who_came_from_whom_is_told_of_the_program_that_was_chosen(short, tmp_path, monkeypatch):
    """The choice on fresh draws need not fall on the program that looked best in the search."""
    monkeypatch.setattr(run, "chosen", lambda _world, programs, *_: len(programs) - 1)
    words = ("--course", short, *TINY, "--population", 60, "--out", tmp_path / "run")
    assert call("evolve", *words) == 0
    ancestry, result = read_ancestry(tmp_path / "run"), read_result(tmp_path / "run")
    assert ancestry.program(ancestry.winner).source == result["program"]
    assert ancestry.winner[0] == result["found_in_generation"]
    best = min(rows["merit"].min() for rows in ancestry.lineage.generations)
    assert ancestry.lineage.merit(ancestry.winner) > best


def history(*best):
    n = len(best)
    columns = {"mean": np.full(n, 6e3), "valid": np.ones(n), "distinct": np.ones(n)}
    return {"generation": np.arange(float(n)), "best": np.array(best), "evaluations": np.arange(n), **columns}


def test_a_convergence_is_labelled_with_the_winner_and_not_with_what_looked_best():
    references = (Reference("the paper's best", 16.74), Reference("lower bound", 11.85))
    winner = Reference("98.5 % arrive", 18.05)
    figure = convergence(history(30.0, 17.15), references, "A title", "a detail", winner)
    assert is_whole(figure)
    assert "18.05 s\n98.5 % arrive" in [text.get_text() for text in figure.axes[0].texts]


def test_runs_beside_each_other_say_what_they_came_to():
    figure = compare_runs({"one": [history(17.15)]}, came_to={"one": "18.05 s, 98 % arrive"})
    assert figure.axes[0].get_legend().get_texts()[0].get_text() == "one: 18.05 s, 98 % arrive"
