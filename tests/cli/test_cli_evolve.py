import contextlib
import json
import os
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.command import call, start

from gecar.cli.progress import line
from gecar.evolution.history import Generation
from gecar.results.folder import read_history

TINY = ("--population", 20, "--generations", 2, "--workers", 1)
FILES = {
    "config.toml",
    "history.csv",
    "result.json",
    "best.txt",
    "convergence.png",
    "trajectory.png",
    "checkpoint",
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A small run."""
    folder = tmp_path_factory.mktemp("evolve") / "run"
    assert call("evolve", *TINY, "--out", folder, "--quiet") == 0
    return folder


@pytest.fixture
def run(finished, tmp_path):
    """A copy of it."""
    return Path(shutil.copytree(finished, tmp_path / "runs/one"))


def test_a_run_leaves_everything_in_its_folder(gecar, tmp_path):
    ended = gecar("evolve", *TINY, "--json")
    folder = tmp_path / "runs/paper-better-seed1"
    assert ended.json["folder"] == "runs/paper-better-seed1"
    assert {path.name for path in folder.iterdir()} == FILES
    assert "The best program, found in generation" in ended.err
    assert " simulate runs/paper-better-seed1" in ended.err
    assert ended.json["verified_on_pymunk"]
    assert ended.json["evaluations"] == 60
    with Image.open(folder / "convergence.png") as picture:
        assert picture.width > 1000


def test_the_program_is_printed_as_it_is_saved(gecar, tmp_path):
    ended = gecar("evolve", *TINY, "--out", "new", "--no-pictures")
    program = (tmp_path / "new/best.txt").read_text()
    assert "".join(f"    {each}\n" for each in program.splitlines()) in ended.out
    assert not (tmp_path / "new/trajectory.png").exists()


def test_a_run_is_driven_again_exactly_as_it_was_scored(gecar):
    assert (
        gecar("evolve", *TINY, "--out", "noisy", "--noise", 4, "--time-limit", 9, "--no-pictures").code == 0
    )
    again = gecar("simulate", "noisy", "--no-picture", "--json").json
    assert again["checkpoints_of"] == 18
    assert again["seed"] != 1
    twice = gecar("simulate", "noisy/best.txt", "--no-picture", "--json").json
    assert twice == again


def test_a_runs_config_serves_for_another_run(gecar, run, tmp_path):
    ended = gecar("evolve", run / "config.toml", "--seed", 5, "--out", "other", "--no-pictures", "--json")
    assert ended.json["seed"] == 5
    assert ended.json["generations"] == 2
    assert ended.json["evaluations"] == 60


def test_options_override_the_file_and_settings_have_names(gecar, tmp_path):
    (tmp_path / "mine.toml").write_text("seed = 3\n[search]\npopulation = 10\ngenerations = 9\n")
    words = (
        "evolve",
        "mine.toml",
        "--generations",
        1,
        "--set",
        "duplicates=generation",
        "--set",
        "checkpoint_credit=true",
    )
    assert gecar(*words, "--workers", 1, "--out", "new", "--no-pictures").code == 0
    config = (tmp_path / "new/config.toml").read_text()
    for said in (
        "seed = 3",
        "population = 10",
        "generations = 1",
        'duplicates = "generation"',
        "checkpoint_credit = true",
    ):
        assert said in config


def test_a_finished_run_resumed_says_the_same(gecar, run):
    before = json.loads((run / "result.json").read_text())
    assert gecar("evolve", "--resume", "--out", run, "--no-pictures", "--workers", 1).code == 0
    assert json.loads((run / "result.json").read_text())["program"] == before["program"]


def test_plot_draws_a_run_again(gecar, run, tmp_path):
    (run / "trajectory.png").unlink()
    assert gecar("plot", run, "--json").json["pictures"] == [
        str(run / f"{name}.png")
        for name in ("convergence", "trajectory", "locality", "population", "tree", "genealogy")
    ]
    assert (run / "trajectory.png").exists()


def test_plot_sets_runs_beside_each_other(gecar, run, tmp_path):
    for seed, rate in ((2, 0.05), (3, 0.2)):
        gecar(
            "evolve", *TINY, "--seed", seed, "--mutation-rate", rate, "--out", f"runs/{seed}", "--no-pictures"
        )
    ended = gecar("plot", run, "runs/2", "runs/3", "--out", "figures", "--json")
    assert {name: group["runs"] for name, group in ended.json["groups"].items()} == {
        "mutation 0.05": 2,
        "mutation 0.2": 1,
    }
    assert (tmp_path / "figures/compare.png").exists()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--workers", "0"), "workers"),
        (("--population", "1"), "population"),
        (("--generations", "-1"), "generations"),
        (("--mutation-rate", "1.5"), "mutation_rate"),
        (("--crossover-rate", "nan"), "crossover_rate"),
        (("--elites", "200"), "elites"),
        (("--seed", "-1"), "seed"),
        (("--preset", "best"), "best"),
        (("--set", "colour=blue"), "colour"),
        (("--set", "crossover"), "NAME=VALUE"),
        (("--grammar", "table1"), "table1.bnf"),
        (("--course", "nowhere"), "nowhere"),
        (("--engine", "steam"), "steam"),
        (("--noise", "-1"), "noise"),
        (("--wraps", "-1"), "wraps"),
        (("--out", "."), "exists"),
        (("nowhere.toml",), "nowhere.toml"),
        (("broken.toml",), "broken.toml"),
        (("--resume", "--out", "nowhere"), "nowhere"),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, tuple) else "",
)
def test_bad_input_is_one_line_and_leaves_nothing(gecar, tmp_path, words, named):
    (tmp_path / "broken.toml").write_text("seed = \n")
    assert named in gecar.error("evolve", *words)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("words", [("nowhere",), (".", "."), (".",)])
def test_plot_of_what_is_no_run_is_one_line(gecar, words):
    assert "config.toml" in gecar.error("plot", *words)


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
def test_a_run_that_is_stopped_is_saved_and_goes_on_to_the_same_end(gecar, tmp_path):
    """Ctrl-C on the command and its workers, as a terminal sends it."""
    small = ("--population", "40", "--generations", "30", "--draws", "1", "--no-pictures", "--workers", "2")
    process = start("evolve", *small, "--out", "stopped", cwd=tmp_path, start_new_session=True)
    _wait_for((tmp_path / "stopped/checkpoint").exists, process)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "Traceback" not in said
    assert "--resume --out stopped" in said
    _wait_for(lambda: not _members(process.pid), None)
    assert len(read_history(tmp_path / "stopped")["best"]) < 31
    assert gecar("evolve", "--resume", "--out", "stopped", "--no-pictures", "--workers", 1).code == 0
    assert gecar("evolve", *small[:-1], 1, "--out", "whole").code == 0
    stopped, whole = (read_history(tmp_path / name) for name in ("stopped", "whole"))
    for column in set(whole) - {"wall_s"}:
        assert np.array_equal(stopped[column], whole[column], equal_nan=True), column


def _wait_for(condition, process, seconds=90.0):
    until = time.monotonic() + seconds
    while not condition():
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.02)


def _members(group):
    """Count the processes of a group that are more than a dead one's record."""
    stats = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            stats.append(path.read_text().rpartition(")")[2].split())
    return sum(int(stat[2]) == group and stat[0] != "Z" for stat in stats)


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
@pytest.mark.parametrize("seconds", [0.0, 0.5, 2.0])
def test_ctrl_c_at_any_moment_ends_all_in_one_line(tmp_path, seconds):
    process = start(
        "evolve", "--generations", 2000, "--workers", 2, "--out", "new", cwd=tmp_path, start_new_session=True
    )
    _wait_for(lambda: _members(process.pid) > 1, process)  # the fork server is the first thing a run starts
    time.sleep(seconds)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    # Python ends by the signal itself if that fell into its own exec(); to a shell both are 130.
    assert process.returncode in (130, -signal.SIGINT), said
    assert "Traceback" not in said
    assert said.count("stopped") == 1
    _wait_for(lambda: not _members(process.pid), None)


def test_progress_says_all_that_matters():
    history = [Generation(0, 1e4, 1e4, 0.97, 0.9, 200, 0.5, 0.0, float("nan"), 150, 9),
               Generation(1, 16.744, 5210.0, 1.0, 0.31, 400, 1.0, 0.4, 20.0, 250, 19)]  # fmt: skip
    assert line(history, 51) == "1/51  best 16.74 s  mean 5210  valid 100 %  distinct 31 %  400/s  0:25 left"
    assert "no program at GOAL" in line(history[:1], 51)
