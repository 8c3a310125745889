"""A run's folder: what is written, what goes on after a break, and what is refused in one line."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.searching import MAPPER, N_ARRIVALS, SMALL, generations, new_evolution

from gecar.calling import command
from gecar.errors import InputError
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.history import Generation
from gecar.evolution.state import State
from gecar.language.program import read_program
from gecar.results import folder as folder_module
from gecar.results.autosave import Saver
from gecar.results.checkpoint import pack, unpack
from gecar.results.config import as_toml, configure, difference, merged
from gecar.results.folder import read_history, read_result
from gecar.results.provenance import versions
from gecar.results.run import finish, resume, start

SHORT: dict[str, Any] = {
    "executor": "serial",
    "time_limit_s": 4.0,
    "search": {"population": 20, "generations": 6, "codons": 100, "checkpoint_credit": True},
}
HERE = Path("checkpoint")
LEAVE_THE_RESULT_ALONE = ("workers", "executor", "scheduler", "provenance")


def outputs(folder: Path) -> dict[str, Any]:
    """All a run writes, without the clock."""
    history = [line.split(",") for line in (folder / "history.csv").read_text().splitlines()]
    clock = history[0].index("wall_s")
    result = read_result(folder)
    del result["wall_s"]
    return {
        "history": [[*row[:clock], *row[clock + 1 :]] for row in history],
        "result": result,
        "best": (folder / "best.txt").read_text(),
        "config": tomllib.loads((folder / "config.toml").read_text()) | dict.fromkeys(LEAVE_THE_RESULT_ALONE),
    }


def stop_after(generation: int) -> Any:
    def after(record: Generation) -> None:
        if record.generation == generation:
            raise KeyboardInterrupt

    return after


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never stopped."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    finish(start(configure(SHORT), folder))
    return folder


def stopped_run(out: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Begin a run that Ctrl-C stops after generation 3."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # or this process would never hear of Ctrl-C again
    with pytest.raises(KeyboardInterrupt):
        finish(start(configure(SHORT), out), stop_after(3))
    return out


@pytest.fixture
def stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run stopped after generation 3."""
    return stopped_run(tmp_path / "run", monkeypatch)


def test_a_run_leaves_what_the_design_names(undisturbed: Path) -> None:
    names = {"config.toml", "history.csv", "result.json", "best.txt", "checkpoint"}
    assert {path.name for path in undisturbed.iterdir()} == names
    result, history = read_result(undisturbed), read_history(undisturbed)
    assert {
        "fitness_s",
        "program",
        "genome",
        "generations",
        "evaluations",
        "distinct_evaluations",
        "wall_s",
    } < set(result)
    assert result["verified_on_pymunk"] is True
    assert result["program"] == read_program(undisturbed / "best.txt").source
    assert (result["evaluations"], result["generations"]) == (140, 6)
    assert history["generation"].tolist() == list(range(7))
    assert history["best"].min() == result["fitness_s"]
    assert history["simulated"][-1] == result["distinct_evaluations"]


def test_a_config_names_seed_versions_commit_and_contents(undisturbed: Path) -> None:
    table = tomllib.loads((undisturbed / "config.toml").read_text())
    assert table["seed"] == 1
    assert table["search"]["mutation_rate"] == 0.05
    assert table["provenance"] == versions()
    assert len(table["provenance"]["git"].removesuffix("-dirty")) in (0, 40)
    assert set(table["fingerprints"]) == {"grammar", "course", "robot"}


def test_a_run_s_config_serves_for_a_new_run(undisturbed: Path, tmp_path: Path) -> None:
    table = tomllib.loads((undisturbed / "config.toml").read_text())
    finish(start(configure(table), tmp_path / "again"))
    assert outputs(tmp_path / "again") == outputs(undisturbed)


def test_ctrl_c_says_how_to_go_on_and_the_end_is_the_same(
    tmp_path: Path, undisturbed: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = stopped_run(tmp_path / "run", monkeypatch)
    assert capsys.readouterr().err == (
        f"stopped after generation 3 of 6; it is saved. Go on with: {command()} evolve --resume --out {out}\n"
    )
    assert len(read_history(out)["generation"]) == 4
    finish(resume(out, {"executor": "thread", "workers": 3}))
    assert outputs(out) == outputs(undisturbed)


def test_checkpoints_take_a_bounded_share_of_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[Path] = []
    started = start(configure(SHORT), tmp_path / "run")
    monkeypatch.setattr(started.folder.__class__, "save", lambda *_: written.append(HERE) or time.sleep(0.05))
    saver = Saver(started.folder, started.evolution, "mine")
    generations(started.evolution, 1)
    for _ in range(5):
        saver()
    assert len(written) == 1
    saver.save()
    saver.save()
    assert len(written) == 2


def test_ctrl_c_before_the_first_generation_is_no_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(Evolution, "ask", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        finish(start(configure(SHORT), tmp_path / "run"))
    assert capsys.readouterr().err.startswith("stopped before the first generation. Go on with: ")


def test_ctrl_c_while_the_best_program_is_measured_says_how_to_go_on(
    tmp_path: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr(signal, "signal", lambda *_: None)
        patch.setattr("gecar.results.run.measured", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            finish(start(configure(SHORT), out))
    assert capsys.readouterr().err.startswith("stopped after generation 6 of 6; it is saved. Go on with: ")
    finish(resume(out))
    assert outputs(out) == outputs(undisturbed)


def test_a_finished_run_may_be_resumed_and_stays_as_it_is(stopped: Path, undisturbed: Path) -> None:
    for _ in range(2):
        finish(resume(stopped))
        assert outputs(stopped) == outputs(undisturbed)


def test_a_run_stopped_before_its_first_checkpoint_starts_anew(undisturbed: Path, tmp_path: Path) -> None:
    start(configure(SHORT), tmp_path / "run")
    (tmp_path / "run" / ".checkpoint.left").write_text("half")
    finish(resume(tmp_path / "run"))
    assert outputs(tmp_path / "run") == outputs(undisturbed)
    assert not list((tmp_path / "run").glob(".*"))


RUN = """
import sys
from pathlib import Path
from gecar.parallel.executors import prepare_workers
from gecar.results.config import configure
from gecar.results.run import finish, resume, start
if __name__ == "__main__":
    prepare_workers()
    out = Path(sys.argv[1])
    table = {"workers": 2, "time_limit_s": 8.0, "search": {"population": 40, "generations": 12, "codons": 200}}
    finish(resume(out) if out.exists() else start(configure(table), out), lambda record: print("saved", flush=True))
"""


def run_and_kill(script: Path, out: Path, generations: int) -> int:
    """Run in a process of its own, kill -9 it shortly after so many generations, and return its exit code."""
    process = subprocess.Popen([sys.executable, str(script), str(out)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for _ in range(generations):
        process.stdout.readline()
    time.sleep(random.random() * 0.03)
    assert len(descendants(script.parent)) >= 4  # itself, fork server, two workers
    process.kill()
    return process.wait()


def descendants(folder: Path) -> list[str]:
    """Find processes whose command line names a folder, as that of the fork server and its workers does."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if str(folder).encode() in (process / "cmdline").read_bytes():
                found.append(process.name)
        except OSError:
            continue
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_kill_9_loses_nothing_and_leaves_no_process_behind(tmp_path: Path) -> None:
    script, out = tmp_path / "run.py", tmp_path / "run"
    script.write_text(RUN)
    assert run_and_kill(script, out, 3) == -signal.SIGKILL
    deadline = time.monotonic() + 10.0
    while descendants(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not descendants(tmp_path)
    finish(resume(out, {"executor": "thread"}))
    table = tomllib.loads((out / "config.toml").read_text())
    finish(start(configure({**table, "executor": "serial"}), tmp_path / "whole"))
    assert outputs(out) == outputs(tmp_path / "whole")


@pytest.mark.parametrize("kind", ["folder", "file", "link"])
def test_an_output_folder_that_exists_is_refused_and_left_alone(kind: str, tmp_path: Path) -> None:
    out = tmp_path / "run"
    {"folder": out.mkdir, "file": out.touch, "link": lambda: out.symlink_to("nowhere")}[kind]()
    with pytest.raises(
        InputError, match=r"--out: found .*run, which exists, expected a new folder, or --resume"
    ):
        start(configure(SHORT), out)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_folder_that_can_not_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"--out: found .*: File exists, expected a folder that can be made"):
        start(configure(SHORT), tmp_path / "file" / "run")


def test_a_full_disk_ends_in_one_line_and_the_run_goes_on_later(
    tmp_path: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, write, calls = tmp_path / "run", folder_module.write_whole, []

    def full(path: Path, content: str | bytes, durable: bool = True) -> None:
        calls.append(path)
        if len(calls) > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(path, content, durable)

    monkeypatch.setattr(folder_module, "write_whole", full)
    with pytest.raises(
        InputError, match=r"run/[a-z.]+: found No space left on device, expected to write it; all before"
    ):
        finish(start(configure(SHORT), out))
    monkeypatch.undo()
    finish(resume(out))
    assert outputs(out) == outputs(undisturbed)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 2}, "--resume: found seed = 2, expected 1 as in "),
        (
            {"search": {"mutation_rate": 0.07}},
            "--resume: found search.mutation_rate = 0.07, expected 0.05 as in ",
        ),
        ({"course": "nowhere"}, "--resume: found course = 'nowhere', expected 'paper' as in "),
        ({"search": {"populatoin": 9}}, "options, search.populatoin: found an unknown field"),
    ],
)
def test_options_that_would_change_the_result_are_refused_on_resume(
    changes: dict[str, Any], words: str, stopped: Path
) -> None:
    with pytest.raises(InputError) as error:
        resume(stopped, changes)
    assert str(error.value).startswith(words)


def test_a_grammar_that_changed_meanwhile_is_refused(tmp_path: Path) -> None:
    grammar = tmp_path / "mine.bnf"
    grammar.write_text("<a> ::= motor(<n>, <n>, 100) | <a><a>\n<n> ::= 10 | 20 | 30\n")
    start(configure({**SHORT, "grammar": str(grammar)}), tmp_path / "run")
    grammar.write_text("# only a remark\n" + grammar.read_text())
    resume(tmp_path / "run")
    grammar.write_text(grammar.read_text().replace("30", "40"))
    with pytest.raises(InputError, match=r"--resume: found grammar '.*mine.bnf' changed since the run began"):
        resume(tmp_path / "run")


def test_a_grammar_of_other_words_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected alternatives that give robot programs"):
        start(configure({**SHORT, "grammar": "table1"}), tmp_path / "run")
    assert not list(tmp_path.iterdir())


def test_other_versions_are_pointed_out(stopped: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = stopped / "config.toml"
    config.write_text(config.read_text().replace(versions()["numba"], "0.1"))
    resume(stopped)
    assert "begun with numba 0.1, going on with" in capsys.readouterr().err


def test_a_checkpoint_from_another_configuration_is_refused(stopped: Path, undisturbed: Path) -> None:
    config = stopped / "config.toml"
    config.write_text(config.read_text().replace("seed = 1", "seed = 3"))
    with pytest.raises(
        InputError, match="checkpoint: found a checkpoint from another configuration, expected one that"
    ):
        resume(stopped)


def state(n_arrivals: int = 0) -> State:
    chosen = SMALL.model_copy(update={"selection": "lexicase"}) if n_arrivals else SMALL
    return generations(new_evolution(chosen, MAPPER, 1, n_arrivals), 2).state()


@pytest.mark.parametrize("n_arrivals", [0, N_ARRIVALS])
def test_a_checkpoint_reads_back_equal(n_arrivals: int) -> None:
    written = state(n_arrivals)
    read = unpack(pack(written, "mine"), "mine", HERE)
    for name, value in vars(written).items():
        assert (
            np.array_equal(getattr(read, name), value) or getattr(read, name).tobytes() == value.tobytes()
        ), name
        assert not isinstance(value, np.ndarray) or getattr(read, name).dtype == value.dtype


WHOLE = pack(state(), "mine")


@given(st.integers(0, len(WHOLE) - 1))
@settings(deadline=None, max_examples=60)
def test_a_checkpoint_cut_anywhere_is_refused(length: int) -> None:
    with pytest.raises(InputError, match=r"^checkpoint: found .*, expected [^\n]*$"):
        unpack(WHOLE[:length], "mine", HERE)


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
@settings(deadline=None, max_examples=100)
def test_a_checkpoint_with_any_byte_changed_is_refused(place: int, change: int) -> None:
    raw = bytearray(WHOLE)
    raw[place] ^= change
    with pytest.raises(InputError, match=r"^checkpoint: found .*, expected [^\n]*$"):
        unpack(bytes(raw), "mine", HERE)


@given(st.binary(max_size=300))
@settings(deadline=None, max_examples=60)
def test_a_forged_checkpoint_is_refused(body: bytes) -> None:
    from gecar.results.checkpoint import _checksum

    for text in (body, b'{"configuration": "mine", "sizes": [5, 0, 0], "rows": {}}\n' + body):
        raw = b"gecar checkpoint 4 " + _checksum(text) + b"\n" + text
        with pytest.raises(InputError):
            unpack(raw, "mine", HERE)


def test_a_checkpoint_of_a_later_version_is_refused_as_such() -> None:
    with pytest.raises(InputError, match="found a checkpoint of version '5', expected version 4"):
        unpack(WHOLE.replace(b"checkpoint 4", b"checkpoint 5", 1), "mine", HERE)


def test_a_configuration_written_reads_back_equal() -> None:
    config = configure(
        {"robot": 'odd "name"\\\x7f', "noise": 1e-7, "search": {"population": 7, "checkpoint_credit": True}}
    )
    assert configure(tomllib.loads(as_toml(config, {"provenance": {"git": ""}}))) == config


def test_a_preset_is_changed_setting_by_setting_and_replaced_as_a_whole() -> None:
    table = merged({"preset": "paper", "search": {"population": 30}}, {"search": {"codons": 50}})
    assert (configure(table).search.population, configure(table).search.codons) == (30, 50)
    other = configure(merged(table, {"preset": "random"}))
    assert (other.search.population, other.search.mutation) == (200, "renew")
    assert difference(configure({}), configure({"workers": 1, "executor": "serial"})) is None


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"sed": 1}, "my.toml, sed: found an unknown field, expected one of preset, course"),
        ({"seed": -1}, "my.toml, seed: found -1, expected greater than or equal to 0"),
        ({"workers": 0}, "my.toml, workers: found 0, expected greater than or equal to 1"),
        (
            {"executor": "cloud"},
            "my.toml, executor: found 'cloud', expected 'process', 'thread', 'serial' or 'dask'",
        ),
        ({"noise": float("nan")}, "my.toml, noise: found nan, expected"),
        ({"step_s": 1.0}, "my.toml, step_s: found 1.0, expected less than or equal to 0.01"),
        ({"search": 3}, "my.toml, search: found 3, expected a table of settings"),
        ({"search": {"tournament": 0}}, "my.toml, search.tournament: found 0, expected greater"),
        ({"preset": "best"}, "preset: found 'best', expected one of paper, random, better"),
    ],
)
def test_a_wrong_configuration_is_refused_by_field(table: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as error:
        configure(table, "my.toml")
    assert str(error.value).startswith(words)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "found no generation"),
        ("generation,best\n0,1\n", "found no mean"),
        ("generation,best,mean,valid,distinct,evaluations,wall_s\n", "expected columns"),
        (
            "generation,best,mean,valid,distinct,evaluations,wall_s\n0,1,2,3,4,5\n",
            "line 2: found 6 values, expected 7",
        ),
        (
            "generation,best,mean,valid,distinct,evaluations,wall_s\n0,1,2,3,4,5,six\n",
            "line 2: found could not convert",
        ),
    ],
)
def test_a_damaged_history_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "history.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_history(tmp_path)


@pytest.mark.parametrize("text", ["", "[1]", "{}", "[" * 100_000])
def test_a_damaged_result_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(text)
    with pytest.raises(InputError, match=r"result\.json"):
        read_result(tmp_path)


def test_a_run_without_a_valid_program_still_writes_everything(tmp_path: Path) -> None:
    table = {**SHORT, "search": {"population": 4, "generations": 1, "codons": 2}}
    result = finish(start(configure(table), tmp_path / "run"))
    assert (result["fitness_s"], result["solved"], result["program"]) == (1e4, False, "")
    assert json.loads((tmp_path / "run" / "result.json").read_text()) == result
