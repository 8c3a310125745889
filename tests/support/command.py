"""Run gecar's command line inside the test: what several tests of commands share."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from gecar.__main__ import main

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Ended:
    """What a command printed, and its exit code."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The one JSON object on stdout."""
        return json.loads(self.out)


def call(*words: object) -> int:
    """Run a command, and return its exit code."""
    with patch.object(sys, "argv", ["gecar", *map(str, words)]):
        try:
            main()
        except SystemExit as end:
            return int(end.code or 0)
    return 0


class Command:
    """Runs commands in this process, which has compiled everything already."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self.capsys = capsys

    def __call__(self, *words: object) -> Ended:
        self.capsys.readouterr()
        code = call(*words)
        said = self.capsys.readouterr()
        return Ended(code, said.out, said.err)

    def error(self, *words: object) -> str:
        """Run a command that must fail for its input, with one line and no traceback; return the line."""
        ended = self(*words)
        assert ended.code == 2, ended
        assert ended.out == ""
        assert ended.err.startswith("error: ")
        assert ended.err.count("\n") == 1, ended.err
        return ended.err


def start(*words: object, cwd: Path = ROOT, **settings: Any) -> subprocess.Popen[str]:
    """Start a command as a process of its own."""
    command = [sys.executable, "-m", "gecar", *map(str, words)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | settings
    place = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, cwd=cwd, text=True, env=place, **streams)
