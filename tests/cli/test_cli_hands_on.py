"""Small things that people run into first: misspelt names, where files go, a robot of one's own, completion."""

import io
import re

import numpy as np
import pytest
from rich.console import Console

from gecar.cli.progress import Steps
from gecar.errors import InputError
from gecar.reality.recordings.recording import Case, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.recordings.split import hold_out
from gecar.world.robot import load_robot

PROGRAM = "motor(70,70,100)\n"


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        (("course", "show", "hairpn"), "did you mean 'hairpin'?"),
        (("robot", "show", "papr"), "did you mean 'paper'?"),
        (("grammar", "check", "nestd"), "did you mean 'nested'?"),
        (("effects", "show", "backlsh"), "did you mean 'backlash'?"),
        (("discover", "monday", "--about", "backlsh"), "did you mean 'backlash'?"),
    ],
)
def test_a_misspelt_name_is_asked_about(gecar, words, asked):
    assert asked in gecar.error(*words)
    assert "did you mean" not in gecar.error(*words[:-1], "qqqqq")


def test_a_folder_above_the_one_meant_says_where_to_look(gecar, tmp_path):
    (tmp_path / "week/monday").mkdir(parents=True)
    (tmp_path / "week/monday/run.csv").touch()
    assert "week: found no .csv file, but some in monday/, expected" in gecar.error("discover", "week")
    assert "week: found a folder without config.toml, expected the folder of a run" in gecar.error(
        "plot", "week"
    )


def test_a_mark_at_the_beginning_of_a_file_from_windows_is_no_text(gecar, tmp_path):
    gecar("robot", "new", "mine.toml")
    (tmp_path / "marked.toml").write_text((tmp_path / "mine.toml").read_text(), encoding="utf-8-sig")
    assert load_robot(tmp_path / "marked.toml").motor == load_robot("ev3").motor


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n"])
def test_an_empty_program_is_refused(gecar, tmp_path, text):
    (tmp_path / "empty.txt").write_text(text)
    assert "empty.txt: found an empty program" in gecar.error("simulate", "empty.txt", "--no-picture")


def test_simulate_draws_beside_the_program_or_where_told(gecar, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/program.txt").write_text(PROGRAM)
    assert gecar("simulate", "mine/program.txt", "--json").json["picture"] == "mine/trajectory.png"
    assert (
        gecar("simulate", "mine/program.txt", "--out", "there", "--json").json["picture"]
        == "there/trajectory.png"
    )
    assert gecar("simulate", "mine/program.txt", "--picture", "a.png", "--json").json["picture"] == "a.png"
    assert not (tmp_path / "trajectory.png").exists()


def test_a_robot_of_ones_own_begins_with_the_ev3s_file(gecar, tmp_path):
    assert "Wrote mine.toml. Edit it" in gecar("robot", "new", "mine.toml").out
    mine, nominal = load_robot(tmp_path / "mine.toml"), load_robot("ev3")
    assert mine.name == "mine"
    assert mine.model_copy(update={"name": "ev3"}) == nominal
    assert "a file that exists" in gecar.error("robot", "new", "mine.toml")
    assert gecar("robot", "new", "like.toml", "--like", "paper").code == 0


def test_recordings_are_set_aside_by_the_beginnings_of_their_names():
    columns = {"t_s": np.array([0.0, 1.0]), "left_duty_pct": np.ones(2)}
    names = ("run_1_line", "run_2_line", "sine")
    case = Case("case", tuple(make_recording(name, columns, Setup(rig="bench")) for name in names))
    assert [r.name for r in hold_out(case, ["run_2", "si"]).held] == ["run_2_line", "sine"]
    with pytest.raises(InputError, match="as run_1_line and run_2_line begin, expected more of the name"):
        hold_out(case, ["run"])
    with pytest.raises(InputError, match="did you mean 'sine'"):
        hold_out(case, ["sinus"])


def test_shells_can_complete_commands(gecar):
    assert "--install-completion" in gecar("--help").out


def test_the_steps_of_a_long_command_take_one_line_of_a_terminal_and_few_of_a_file():
    lines, screen = [], io.StringIO()
    for terminal in (False, True):
        with Steps(
            lines.append, Console(file=screen, force_terminal=terminal, width=80, color_system=None)
        ) as tell:
            tell("backlash: gains 12")
            tell("intervals")
            tell.ended(1, 3)
            tell("backlash again")
    assert lines == ["backlash: gains 12"]  # the next comes 15 s later
    assert re.search(r"0:0\d:\d\d 1 of 3, 0:00 left  backlash again", screen.getvalue())


def test_the_line_of_one_case_says_when_it_is_usually_done():
    screen = io.StringIO()
    shown = Console(file=screen, force_terminal=True, width=80, color_system=None)
    with Steps(print, shown, within_s=75.0) as tell:
        tell("intervals")
    assert "usually done by 1:15  intervals" in screen.getvalue()
