"""What a run survives: a full disk, a folder nobody may write, Ctrl-C twice, and any damage to what it wrote."""

from __future__ import annotations

import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from test_results import SHORT, outputs

from gecar.errors import InputError
from gecar.parallel.signals import (
    end_late_workers_quietly,
    interrupts_told,
    raise_if_interrupted,
    remember_interrupts,
)
from gecar.results.config import configure
from gecar.results.run import finish, resume, start


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never disturbed."""
    folder = tmp_path_factory.mktemp("faults") / "whole"
    finish(start(configure(SHORT), folder))
    return folder


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 kB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if not shutil.which("mount") or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("mounting a small disk needs root")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_disk_that_fills_up_stops_the_run_and_room_lets_it_go_on(small_disk: Path, whole: Path) -> None:
    filler = small_disk / "filler"
    started = start(configure(SHORT), small_disk / "run")

    def fill(_: object) -> None:
        with filler.open("ab") as stream:
            stream.write(bytes(os.statvfs(small_disk).f_bavail * os.statvfs(small_disk).f_bsize))

    with pytest.raises(InputError, match=r"found No space left on device, expected to write it; all before"):
        finish(started, fill)
    filler.unlink()
    finish(resume(small_disk / "run"))
    assert outputs(small_disk / "run") == outputs(whole)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_nobody_may_write_stops_the_run_and_leave_lets_it_go_on(tmp_path: Path, whole: Path) -> None:
    out = tmp_path / "run"
    started = start(configure(SHORT), out)
    with pytest.raises(InputError, match=r"found Permission denied, expected to write it; all before"):
        finish(started, lambda _: out.chmod(0o500))
    out.chmod(0o700)
    finish(resume(out))
    assert outputs(out) == outputs(whole)


def test_a_second_ctrl_c_does_not_cut_the_saving_short(tmp_path: Path, whole: Path) -> None:
    out, before = tmp_path / "run", signal.getsignal(signal.SIGINT)
    started = start(configure(SHORT), out)
    save = started.folder.__class__.save

    def interrupted(*args: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        save(*args)  # type: ignore[arg-type]

    def stop(_: object) -> None:
        patch.setattr(started.folder.__class__, "save", interrupted)
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        finish(started, stop)
    signal.signal(signal.SIGINT, before)
    finish(resume(out))
    assert outputs(out) == outputs(whole)


def _cut(raw: bytes, at: int) -> bytes:
    return raw[:at]


def _flip(raw: bytes, at: int) -> bytes:
    return raw[:at] + bytes([raw[at] ^ 1 << at % 8]) + raw[at + 1 :]


def _swap(raw: bytes, at: int) -> bytes:
    return raw[:at] + raw[at : at + 2][::-1] + raw[at + 2 :]


@pytest.mark.parametrize("damage", [_cut, _flip, _swap])
@pytest.mark.parametrize("name", ["config.toml", "checkpoint", "history.csv", "best.txt", "result.json"])
def test_damage_is_refused_in_one_line_or_changes_nothing(name, damage, whole, tmp_path, capsys) -> None:  # type: ignore[no-untyped-def]
    expected = outputs(whole)
    chance = random.Random(f"{name} {damage.__name__}")
    for k in range(2):
        out = Path(shutil.copytree(whole, tmp_path / f"run{k}"))
        raw = (out / name).read_bytes()
        (out / name).write_bytes(damage(raw, chance.randrange(len(raw))))
        try:
            finish(resume(out))
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017  other damage may do nothing at all
            assert name in {"config.toml", "checkpoint"}
        else:
            found = outputs(out)
            assert all(found[key] == expected[key] for key in ("history", "result", "best"))


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_what_compiled_code_makes_of_an_interrupt_is_an_interrupt_again() -> None:
    with pytest.raises(KeyboardInterrupt), interrupts_told():
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()
    with pytest.raises(SystemError), interrupts_told():
        raise SystemError("something else")


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_an_interrupt_while_a_class_is_made_is_an_interrupt() -> None:
    class Named:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), interrupts_told():
        type("Made", (), {"field": Named()})
    with pytest.raises(RuntimeError), interrupts_told():
        raise RuntimeError("something else")


def test_an_interrupt_that_something_dropped_is_raised_at_the_next_turn() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        remember_interrupts()
        raise_if_interrupted()  # nothing yet
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)
        with pytest.raises(KeyboardInterrupt):
            raise_if_interrupted()
        raise_if_interrupted()  # once answered it is over
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        remember_interrupts()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_an_interrupt_in_a_deletion_comes_a_moment_later(capfd: pytest.CaptureFixture[str]) -> None:
    class Interrupted:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)
            deleted.append(True)

    def delete_one() -> None:
        Interrupted()
        assert deleted == [True]  # whole
        time.sleep(1.0)

    deleted: list[bool] = []
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    alarm = signal.getsignal(signal.SIGALRM)
    try:
        remember_interrupts()
        with pytest.raises(KeyboardInterrupt):
            delete_one()
        with pytest.raises(KeyboardInterrupt):
            raise_if_interrupted()
    finally:
        signal.signal(signal.SIGINT, before)
        signal.signal(signal.SIGALRM, alarm)
    assert capfd.readouterr().err == ""


def test_a_worker_that_comes_after_its_run_was_stopped_ends_without_a_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its run's locks are gone, which the fork server would print; what else is wrong is printed."""
    monkeypatch.setattr(sys, "excepthook", sys.__excepthook__)
    end_late_workers_quietly()

    def printed(broken: Callable[[], object]) -> str:
        with pytest.raises(FileNotFoundError) as caught:
            broken()
        sys.excepthook(FileNotFoundError, caught.value, caught.tb)
        return capsys.readouterr().err

    lock: Any = multiprocessing.get_context("spawn").Lock()
    assert not printed(lambda: lock.__setstate__((0, 1, 1, "/gone")))
    assert "FileNotFoundError" in printed(lambda: Path("gone").read_text(encoding="utf-8"))
