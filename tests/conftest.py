"""What tests of several files use."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.command import Command
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gecar.compiled import is_cold, mark_warm
from gecar.reality.residuals import compilation, threads

# Tests run on every core: a second thread would cost each discovery a quarter more processor time, and those of linear
# algebra wait for each other in busy loops. Processes that tests start inherit the variable.
if "PYTEST_XDIST_WORKER" in os.environ:
    threads.CORES = 1
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    threadpool_limits(1)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--slow``."""
    parser.addoption("--slow", action="store_true", help="run the tests marked slow, too")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip the tests marked slow, unless they are asked for: five of them take a fifth of the suite's time."""
    if not config.getoption("--slow"):
        for item in items:
            if item.get_closest_marker("slow"):
                item.add_marker(pytest.mark.skip(reason='takes minutes: make test ARGS="--slow"'))


def pytest_xdist_setupnodes() -> None:
    """Compile what takes longest before there are workers: else each of them compiles all of it at the same time."""
    if is_cold(compilation.REPLAYS):
        drives = subprocess.Popen([sys.executable, "-c", "import gecar.parallel.warm_up"])
        replays = [compilation.compiling("lanes", "readings", "laws"), compilation.compiling("one")]
        for child in (drives, *replays):
            child.wait()
        mark_warm(compilation.REPLAYS)


@pytest.fixture
def gecar(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command line, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return Command(capsys)
