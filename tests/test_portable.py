"""Where there is no POSIX, as on Windows: what is called there instead."""

import io
import os
import sys
import tempfile
from pathlib import Path

import pytest

from gecar import compiled
from gecar.__main__ import main
from gecar.calling import command
from gecar.parallel import executors, signals


def test_words_that_a_terminal_cannot_show_end_no_command(monkeypatch):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="cp1252", newline=""))
    monkeypatch.setattr(sys, "argv", ["gecar", "--version"])
    with pytest.raises(SystemExit):
        main()
    print("battery 8.67 → 8.20 V", flush=True)
    assert raw.getvalue().decode("cp1252").endswith("battery 8.67 ? 8.20 V\n")


def test_without_a_home_and_user_numbers_compiled_code_goes_to_the_temporary_folder(tmp_path, monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("GECAR_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.delattr(os, "getuid")
    assert compiled._cache_folder().is_relative_to(tmp_path / "gecar")


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_elsewhere_than_on_linux_workers_are_spawned(platform, monkeypatch):
    monkeypatch.setattr(sys, "platform", platform)
    assert executors._context().get_start_method() == "spawn"
    executors.prepare_workers()  # does nothing, and starts no server


def test_without_signal_masks_workers_start_all_the_same(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delattr("signal.pthread_sigmask")
    with signals.sigint_ignored():
        pass


def test_without_affinities_all_cores_are_used(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    assert executors.usable_cores() == 3


@pytest.mark.parametrize("name", ["gecar", "gecar.exe"])
def test_what_to_type_is_found_beside_python(name, tmp_path, monkeypatch):
    def which(word, path=None):
        return str(tmp_path / name) if path == str(tmp_path) else None

    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setattr("shutil.which", which)
    assert Path(command()).name == name
