"""What strangers' files may cost; docs/bounds.md has the table."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gecar.errors import InputError
from gecar.files import read_text
from gecar.language.grammar import load_grammar, parse_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import parse_program
from gecar.reality.recordings.recording import read_recording
from gecar.results.config import configure
from gecar.results.fitness_table import read_table
from gecar.results.folder import read_history
from gecar.world.course.course import COURSES, load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome, World, simulate


def test_an_endless_derivation_ends_at_the_most_symbols() -> None:
    for text in ("<a> ::= <a><a> | motor(1,1,10)\n", "<a> ::= <a> | motor(1,1,10)\n"):
        mapper = Mapper(parse_grammar(text), MappingOptions(wraps=1_000_000))
        began = time.monotonic()
        assert not mapper.map(np.zeros((50, 100), np.uint8)).valid.any()
        assert time.monotonic() - began < 10.0


def test_a_million_statements_are_refused_unread() -> None:
    with pytest.raises(InputError, match="expected a program of at most 100000"):
        parse_program("motor(1,1,10)\n" * 1_000_000)


def test_a_loop_that_takes_no_time_and_commands_nothing_is_stuck() -> None:
    world = World(load_robot("ev3"), load_course("paper"))
    assert simulate(world, parse_program("motor(0,0,0)\n" * 7_000).opcodes).outcome == Outcome.STUCK


def test_a_recording_of_a_gigabyte_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    with path.open("wb") as stream:
        stream.truncate(1_000_000_000)  # a hole: it takes no room on the disk
    with pytest.raises(InputError, match="found 1000 MB, expected at most 67 MB"):
        read_recording(path)


@pytest.mark.parametrize("edge", [8_000, 20_000])
def test_a_picture_that_unpacks_to_much_is_refused_unpacked(edge: int, tmp_path: Path) -> None:
    Image.new("1", (edge, edge)).save(tmp_path / "bomb.png")
    course = (
        COURSES / "paper.toml"
    ).read_text() + '\n[image]\nfile = "bomb.png"\npixels_per_metre = 1000.0\n'
    (tmp_path / "course.toml").write_text(course)
    with pytest.raises(InputError, match=r"image: found .*(pixels|bomb)"):
        load_course(tmp_path / "course.toml")
    (tmp_path / "course.toml").write_text("# " + "x" * 1_000_000)
    with pytest.raises(InputError, match="expected a course file of at most 1000000"):
        load_course(tmp_path / "course.toml")


def test_a_cell_of_strange_blanks_is_named(tmp_path: Path) -> None:
    (tmp_path / "blanks.csv").write_bytes(b"t_s,left_duty_pct,right_duty_pct\n0,1,1\n1,\r\r,1\n")
    with pytest.raises(InputError, match=r"line 3, column left_duty_pct: found '\\r\\r', expected a number"):
        read_recording(tmp_path / "blanks.csv")


def test_a_recording_of_days_is_refused_before_a_replay_simulates_them(tmp_path: Path) -> None:
    (tmp_path / "days.csv").write_text("t_s,left_duty_pct,right_duty_pct\n0,1,1\n1,1,1\n1e9,1,1\n")
    with pytest.raises(
        InputError, match=r"column t_s: found 1e\+09 s from first to last, expected at most 36000 s"
    ):
        read_recording(tmp_path / "days.csv")


@pytest.mark.parametrize("name", ["x" * 5_000, "a\0b", "a\nb"])
def test_names_that_no_file_can_have_are_refused_in_one_line(name: str) -> None:
    for load in (load_grammar, load_course, load_robot, lambda name: configure({"preset": name})):
        with pytest.raises(InputError, match=r"^[^\n\0]*$"):
            load(name)
    assert configure({"course": name}).course == name
    with pytest.raises(InputError, match=r"^[^\n\0]*$"):
        read_text(Path(name), "a text")


@pytest.mark.parametrize("text", ["drive = [1]", "[[drive]]\nprogram = 5", "[[search]]\nseeds = 5",
                                  '[[search]]\nseeds = ["a"]', "versions = 3\n[[search]]\nseeds = [1]"])  # fmt: skip
def test_a_fitness_table_of_the_wrong_kinds_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_text(text)
    with pytest.raises(InputError, match=r"table.toml, (drive|search|versions)"):
        read_table(tmp_path / "table.toml")


def test_a_history_with_a_field_of_any_length_is_refused(tmp_path: Path) -> None:
    (tmp_path / "history.csv").write_text('generation\n"' + "1" * 200_000)
    with pytest.raises(InputError, match="found no table"):
        read_history(tmp_path)
