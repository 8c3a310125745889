import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w

from gecar.results.fitness_table import FitnessTable, moves, read_table, write_table

SHIPPED = Path(__file__).parents[2] / "benchmarks/fitness_table.toml"
NEW = """\
[[drive]]
program = "motor(80,80,100)"

[[search]]
seeds = [1]
search = { population = 10, generations = 1, codons = 50 }
"""


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(NEW)
    return path


def test_a_new_table_is_filled_and_then_holds(gecar, table):
    assert gecar("check", table, "--workers", 1).code == 1
    ended = gecar("check", table, "--update", "--workers", 1)
    assert ended.code == 0
    assert "7 moved, 2 within what is allowed" in ended.out
    again = gecar("check", table, "--workers", 1, "--json")
    assert (again.code, again.json["moved"], again.json["passed"]) == (0, [], True)


def test_what_moved_is_told_by_how_much(gecar, table):
    gecar("check", table, "--update", "--workers", 1)
    table.write_text(table.read_text().replace("time_s = 1.", "time_s = 2."))
    ended = gecar("check", table, "--workers", 1, "--json")
    assert ended.code == 1
    assert [(move["figure"], move["percent"] < -20) for move in ended.json["moved"]] == [("time_s", True)]


def test_pins_are_the_versions_of_the_table(gecar):
    words = gecar("check", SHIPPED, "--pins").out.splitlines()
    assert words[0].startswith("numba==")
    assert len(words) == 5


def test_other_versions_excuse_small_moves_and_no_large_ones():
    drive = {"program": "motor(1,1,1)", "outcome": "goal", "time_s": 10.0, "checkpoints": 18}
    search = {"seeds": [1, 2, 3], "fitness_s": [15.0, 16.0, 17.0], "simulated": [5, 5, 5]}
    drive["arrives_share"], search["arrives_share"] = 0.9, [0.9, 0.2, 0.95]
    before = FitnessTable({"numba": "1"}, (drive,), (search,))
    for scale, matters in ((1.005, False), (1.2, True)):
        times = [time * scale for time in search["fitness_s"]]
        now = FitnessTable(
            {"numba": "2"}, ({**drive, "time_s": 10.0 * scale},), ({**search, "fitness_s": times},)
        )
        assert [move.matters for move in moves(before, now)] == [matters] * 2
        assert all(move.matters for move in moves(before, replace(now, versions={"numba": "1"})))


def test_shares_are_guarded_and_a_table_from_before_them_still_holds(gecar, table):
    gecar("check", table, "--update", "--workers", 1)
    filled = table.read_text()
    before = tomllib.loads(filled)
    for row in before["drive"] + before["search"]:
        del row["arrives_share"]
    table.write_text(tomli_w.dumps(before))
    older = gecar("check", table, "--workers", 1, "--json")
    assert older.code == 0
    assert [move["figure"] for move in older.json["moved"]] == ["arrives_share"] * 2
    table.write_text(filled.replace("arrives_share = 0.0", "arrives_share = 0.5"))
    assert gecar("check", table, "--workers", 1).code == 1


@pytest.mark.parametrize(("share", "matters"), [(0.85, False), (0.7, True)])
def test_other_versions_may_move_a_share_a_little(share, matters):
    row = {"program": "motor(1,1,1)", "outcome": "goal", "time_s": 10.0, "checkpoints": 18}
    before, now = (
        FitnessTable({"numba": version}, ({**row, "arrives_share": each},), ())
        for version, each in (("1", 0.9), ("2", share))
    )
    assert [(move.figure, move.matters) for move in moves(before, now)] == [("arrives_share", matters)]


def test_the_shipped_table_reads_back_as_it_was_written(tmp_path):
    table = read_table(SHIPPED)
    write_table(tmp_path / "again.toml", table)
    assert read_table(tmp_path / "again.toml") == table
    assert (tmp_path / "again.toml").read_text() == SHIPPED.read_text()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "nothing to run"),
        ("[[drive]]\ncourse = 'paper'\n", "no program"),
        ("[[search]]\nseeds = []\n", "no seeds"),
        ("[[search]]\nseeds = [1]\ncolour = 3\n", "colour"),
        ("[[search]]\nseeds = [1]\nsearch = { elites = -1 }\n", "elites"),
        ("[other]\n", "other"),
        ("[[", "not TOML"),
    ],
)
def test_a_table_that_is_wrong_is_one_line(gecar, tmp_path, text, named):
    (tmp_path / "wrong.toml").write_text(text)
    assert named in gecar.error("check", "wrong.toml", "--workers", 1)


def test_the_guarded_table_holds(gecar):
    ended = gecar("check", SHIPPED, "--json")
    assert ended.json["moved"] == []
    assert ended.code == 0
