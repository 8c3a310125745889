"""What tests of several files use."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command import Command

from gecar.compiled import is_cold
from gecar.reality.residuals import compilation, threads

# Tests run on every core: a second thread would cost each discovery a quarter more processor time.
if "PYTEST_XDIST_WORKER" in os.environ:
    threads.CORES = 1

# What takes longest to compile, in shares alike: else every worker compiles all of it at the same time.
SHARES = (
    ["-c", "import gecar.parallel.warm_up"],
    ["-m", compilation.MODULE, "one", "readings", "lanes"],
    ["-m", compilation.MODULE, "laws"],
)


def pytest_xdist_setupnodes() -> None:
    """Compile before there are workers, where nothing has been yet."""
    if is_cold():
        for child in [subprocess.Popen([sys.executable, *share]) for share in SHARES]:
            child.wait()


@pytest.fixture
def gecar(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command line, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return Command(capsys)
