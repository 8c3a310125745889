import os
import signal
import subprocess
import sys

import pytest
from support.command import ROOT, start

from gecar.cli.application import COMMANDS


def test_help_names_every_command_and_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['gecar', '--help']\n"
        "from gecar.__main__ import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print([m for m in ('numba', 'numpy', 'matplotlib') if m in sys.modules])"
    )
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout
    assert said.splitlines()[-1] == "[]"
    assert all(entry.name in said for entry in COMMANDS if entry.exists)


@pytest.mark.parametrize("entry", [entry for entry in COMMANDS if entry.exists], ids=lambda entry: entry.name)
def test_every_command_explains_itself(gecar, entry):
    ended = gecar(entry.name, "--help")
    assert ended.code == 0
    assert "Usage" in ended.out
    assert len(ended.out.splitlines()) > 5


@pytest.mark.parametrize("entry", [entry for entry in COMMANDS if entry.exists], ids=lambda entry: entry.name)
def test_help_of_each_command_needs_no_compiler(entry):
    code = (
        "import sys; from gecar.cli.application import COMMANDS\n"
        f"next(s for s in COMMANDS if s.name == {entry.name!r}).load()\n"
        "assert not {'numba', 'matplotlib', 'scipy'} & set(sys.modules), sorted(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_version(gecar):
    assert gecar("--version").out.startswith("gecar ")


def test_a_mistyped_command_or_option_gets_a_suggestion(gecar):
    ended = gecar("gramar")
    assert ended.code == 2
    assert "grammar" in ended.err
    ended = gecar("grammar", "map", "paper", "--sed", "1")
    assert ended.code == 2
    assert "--seed" in ended.err


def test_a_fault_of_gecars_own_is_one_line_and_asks_for_a_report(gecar, monkeypatch):
    def broken(*_):
        raise RuntimeError("that should not happen")

    monkeypatch.setattr("gecar.language.grammar.load_grammar", broken)
    ended = gecar("grammar", "check", "paper")
    assert ended.code == 1
    assert ended.err.startswith("internal error: RuntimeError: that should not happen")
    assert "GECAR_DEBUG" in ended.err
    monkeypatch.setenv("GECAR_DEBUG", "1")
    with pytest.raises(RuntimeError):
        gecar("grammar", "check", "paper")


def test_a_reader_that_leaves_early_is_no_error():
    reader = subprocess.Popen([sys.executable, "-c", "pass"], stdin=subprocess.PIPE)
    process = start("grammar", "map", "paper", "--count", "2000", stdout=reader.stdin)
    reader.stdin.close()
    _, said = process.communicate(timeout=60)
    reader.wait()
    assert "Traceback" not in said
    assert "rror" not in said


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_ctrl_c_ends_with_one_word():
    process = start("grammar", "map", "paper", "--count", "20000")
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT)  # the same to a shell
    assert said == "stopped\n"
