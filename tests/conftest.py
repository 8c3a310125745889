"""What tests of several files use."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Command


@pytest.fixture
def gecar(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command line, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return Command(capsys)
