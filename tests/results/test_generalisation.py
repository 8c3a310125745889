"""Programs on several courses: evolved on them, and tested on courses they have not seen."""

import pickle
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.command import Command
from support.courses import make_course

from gecar.api import evolve
from gecar.errors import InputError
from gecar.evolution.scores import UNSOLVED
from gecar.language.program import parse_program
from gecar.plots.courses.many import courses_figure
from gecar.plots.style import is_whole
from gecar.results import run as results_run
from gecar.results.config import configure
from gecar.results.generalisation import (
    DRAWS,
    CourseDrive,
    drives_csv,
    drives_on,
    read_drives,
    sentence,
    summed_up,
    unseen_courses,
)
from gecar.results.run import finish, load_task, resume, start
from gecar.search.chance import arrivals
from gecar.search.courses import paces, spread, way_m
from gecar.search.evaluation import DriveEvaluator
from gecar.world.course.course import course_names, load_course, load_courses
from gecar.world.perturbation import drawn_conditions
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

COURSES = load_courses("paper+random:3")
WORLDS = [World(load_robot("ev3"), course) for course in COURSES]
FOLLOWS = parse_program("if(SensorValue > 75):\n    motor(50,60,10)\nelse:\n    motor(30,-60,10)")
"""Follows the line's right edge on the first of the two, and loses it on the second."""
SMALL = {
    "executor": "serial",
    "course": "paper+random:3",
    "search": {"population": 8, "generations": 1, "codons": 200, "draws": 3, "arrival_share": 0.0},
}


def test_several_courses_are_named_by_plus_and_by_a_range_of_seeds(tmp_path):
    assert course_names("paper+random:7") == ["paper", "random:7"]
    assert course_names("random:9-11") == ["random:9", "random:10", "random:11"]
    (tmp_path / "a+b.toml").touch()
    assert course_names(str(tmp_path / "a+b.toml")) == [str(tmp_path / "a+b.toml")]
    for wrong in ("paper+paper", "random:9-8", "random:1-5000", "random:1-3+random:2"):
        with pytest.raises(InputError, match="--course"):
            course_names(wrong)
    with pytest.raises(InputError, match="expected one"):
        load_course("random:1-2")


def test_drawn_conditions_are_spread_evenly_and_start_where_their_course_does():
    under, course = spread(WORLDS, 10, (1, 2))
    assert Counter(course.tolist()) == {0: 5, 1: 5}
    for row, here in enumerate(course):
        assert np.abs(under.start[row] - WORLDS[here].start).max() < 0.15
    assert (spread(WORLDS, 10, (1, 3))[1] != course).any()


def test_on_one_course_the_conditions_are_those_always_drawn():
    under, course = spread(WORLDS[:1], 5, 7)
    assert not course.any()
    for ours, plain in zip(under, drawn_conditions(WORLDS[0], 5, 7), strict=True):
        assert ours.tobytes() == plain.tobytes()


def test_times_are_scaled_by_the_lines_lengths():
    ways = [world.course.length_m for world in WORLDS]
    assert paces(WORLDS).tolist() == [1.0, ways[0] / ways[1]]
    bare = make_course("...", "[0, 0]", "[2, 0]", '"right"', "checkpoints = [[1, 0]]")
    assert way_m(bare) == pytest.approx(0.6)


def test_a_program_that_drives_one_of_two_courses_fails_and_comes_half_way():
    alone = DriveEvaluator(WORLDS[0], draws=9, required_share=0.9)([FOLLOWS.opcodes], [1])[0]
    both = DriveEvaluator(WORLDS[0], draws=9, required_share=0.9, others=tuple(WORLDS[1:]))
    score = both([FOLLOWS.opcodes], [1])[0]
    assert alone["merit"] < 60.0
    assert score["fitness_s"] == alone["fitness_s"]
    assert score["merit"] == UNSOLVED
    assert 0.5 < score["share"] < alone["share"]
    assert pickle.loads(pickle.dumps(both))([FOLLOWS.opcodes], [1])[0].tobytes() == score.tobytes()


def test_arrivals_on_several_courses_are_those_on_each():
    (both,) = arrivals(WORLDS[0], [FOLLOWS.opcodes], 6, 5, WORLDS[1:])
    _, course = spread(WORLDS, 6, 5)
    assert np.isfinite(both.times_s[course == 0]).all()
    assert np.isinf(both.times_s[course == 1]).all()


def test_unseen_courses_are_none_of_those_trained_on():
    assert unseen_courses(COURSES, 3) == "random:1000001-1000003"
    seen = replace(load_course("random:1000002"), name="copy")
    assert unseen_courses([*COURSES, seen], 3) == "random:1000004-1000006"


def test_drives_on_several_courses_are_summed_up_and_kept(tmp_path):
    drives = drives_on(WORLDS[0], FOLLOWS, "paper+random:3", 1)
    assert [drive.driven for drive in drives] == [1, 0]
    assert drives[0].time_s == simulate(WORLDS[0], FOLLOWS.opcodes).time_s
    told = summed_up(drives)
    assert (told["driven"], told["of"], told["share"]) == (1, 2, 0.5)
    assert told["low"] < 0.05
    assert told["high"] > 0.95
    assert "Of 2 unseen random courses it drives 1" in sentence(told)
    (tmp_path / "drives.csv").write_text(drives_csv(drives))
    assert [drive.course for drive in read_drives(tmp_path / "drives.csv")] == ["paper", "random:3"]


@pytest.mark.parametrize("line", ["x", "a,1,1.0,2,3,4.0", "a,1,nan,2,3,4.0,1", "a,1,1.0,5,3,4.0,1"])
def test_a_damaged_table_of_drives_is_refused(tmp_path, line):
    (tmp_path / "drives.csv").write_text(",".join(CourseDrive._fields) + f"\n{line}\n")
    with pytest.raises(InputError, match="line 2"):
        read_drives(tmp_path / "drives.csv")


def test_the_picture_of_many_courses_is_whole():
    courses = load_courses("random:1-23")
    assert is_whole(
        courses_figure(courses, {"random:3": 0, "random:5": 4}, "21 of 23 courses driven", "detail")
    )


def test_a_run_on_several_courses_reports_unseen_ones_and_goes_on_to_the_same_end(tmp_path, monkeypatch):
    monkeypatch.setattr(results_run, "unseen_courses", lambda trained: unseen_courses(trained, 2))
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    result = finish(start(configure(SMALL), whole))
    assert result["unseen"]["of"] == 2
    assert len(read_drives(whole / "unseen.csv")) == 2
    assert 'course = "paper+random:3"' in (whole / "config.toml").read_text()
    start(configure(SMALL), stopped)
    again = finish(resume(stopped))
    del result["wall_s"], again["wall_s"]
    assert again == result


def test_several_courses_ask_for_more_than_the_nominal_drive():
    few = {**SMALL, "search": {"draws": 1}}
    with pytest.raises(InputError, match="draws: found 1 with 2 courses"):
        load_task(configure(few))
    with pytest.raises(InputError, match="one course, with a fitness of your own"):
        evolve("paper+random:3", fitness=lambda drive: drive.time_s)


def test_simulate_tells_which_courses_a_program_drives(gecar: Command, tmp_path):
    (tmp_path / "best.txt").write_text(FOLLOWS.source)
    ended = gecar("simulate", "best.txt", "--course", "paper+random:3", "--json")
    assert [drive["driven"] for drive in ended.json["drives"]] == [1, 0]
    assert all(0 <= drive["arrived"] <= DRAWS for drive in ended.json["drives"])
    assert (tmp_path / "courses.png").is_file()
    assert "--animate" in gecar.error("simulate", "best.txt", "--course", "random:1-2", "--animate", "x.gif")
