import os
import signal
import sys
import time

import pytest
from support.command import start

GRID = ("--rows", "elites=0,1", "--columns", "mutation_rate=0.1,0.5", "--seeds", 2, "--population", 10)
SMALL = (*GRID, "--generations", 1, "--workers", 1)


def test_a_table_is_written_in_every_form(gecar, tmp_path):
    answer = gecar("table", *SMALL, "--json", "--out", "new").json
    assert [cell["runs"] for cell in answer["cells"]] == [2, 2, 2, 2]
    names = {path.name for path in (tmp_path / "new").iterdir()}
    pictures = {"convergence.png", "heat_map.png"}
    tables = {
        "table.md",
        "table.csv",
        "table.tex",
        "table.json",
        "runs.csv",
        "contrasts.csv",
        "contrasts.tex",
    }
    assert names == {"study.json", "runs"} | tables | pictures
    assert len(list((tmp_path / "new/runs").iterdir())) == 8


def test_a_grid_that_grows_keeps_what_is_there(gecar, tmp_path):
    assert gecar("table", *SMALL, "--out", "new", "--no-pictures").code == 0
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "new/runs").iterdir()}
    ended = gecar(
        "table", "--resume", "--out", "new", "--seeds", 3, "--workers", 1, "--no-pictures", "--json"
    )
    assert "12 runs, 1 side by side, 8 kept from before" in ended.err
    assert [cell["runs"] for cell in ended.json["cells"]] == [3, 3, 3, 3]
    assert all(path.stat().st_mtime_ns == at for path, at in before.items())


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--rows", "elites"), "--rows"),
        (("--rows", "colour=1"), "colour"),
        (("--executor", "steam"), "steam"),
        (("--workers", "0"), "workers"),
        (("--out", "."), "exists"),
        (("--resume",), "--out"),
        (("--resume", "--out", "nowhere"), "nowhere"),
        (("--course", "nowhere"), "nowhere"),
        (("--grammar", "table1"), "table1"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(gecar, tmp_path, words, named):
    assert named in gecar.error("table", *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is no signal there")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_study_that_is_stopped_keeps_its_finished_runs(gecar, tmp_path, how):
    """All at once, as a terminal sends Ctrl-C; or the command alone, as the system kills it."""
    long = (*GRID, "--generations", 10, "--no-pictures")
    process = start("table", *long, "--workers", 2, "--out", "stopped", cwd=tmp_path, start_new_session=True)
    until = time.monotonic() + 90
    while not list(tmp_path.glob("stopped/runs/[!.]*")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.01)
    (os.killpg if how == signal.SIGINT else os.kill)(process.pid, how)
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert how == signal.SIGKILL or (process.returncode == 130 and "--resume --out stopped" in said)
    ended = gecar("table", "--resume", "--out", "stopped", "--workers", 1, "--no-pictures", "--json")
    assert "kept from before" in ended.err
    assert [cell["runs"] for cell in ended.json["cells"]] == [2] * 4
