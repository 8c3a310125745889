"""Where compiled code is kept: a folder of its own for every state of the sources, with a home or without."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from gecar import compiled

PACKAGE = Path(compiled.__file__).parent


@pytest.mark.parametrize(
    "changed", ["world/kernel/motor.py", "world/effects.py", "language/opcodes.py", "random_streams.py"]
)
def test_a_change_in_any_room_that_compiles_gives_another_cache(tmp_path: Path, changed: str) -> None:
    copy = shutil.copytree(PACKAGE, tmp_path / "gecar", ignore=shutil.ignore_patterns("__pycache__"))
    before = compiled._kernel_hash(copy)
    with (copy / changed).open("a") as stream:
        stream.write("\nCHANGED = 1\n")
    assert compiled._kernel_hash(copy) != before


def test_the_cache_lies_where_the_user_wants_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GECAR_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert compiled._cache_folder().parent == tmp_path / "xdg" / "gecar"
    monkeypatch.setenv("GECAR_CACHE_DIR", str(tmp_path / "own"))
    assert compiled._cache_folder().parent == tmp_path / "own"


def test_a_user_without_a_home_gets_a_private_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("GECAR_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = compiled._cache_folder()
    assert folder.is_dir()
    assert folder.is_relative_to(tmp_path)
    assert folder.parents[1].stat().st_mode & 0o077 == 0


def test_what_no_later_process_would_find_in_the_cache_is_refused() -> None:
    def doubled_by(factor: object) -> Callable[[float], float]:
        def double(x: float) -> float:
            return x if factor else 2.0 * x

        return compiled.kernel(double)

    with pytest.raises(TypeError, match="closes over the compiled factor"):
        doubled_by(doubled_by(0))
    assert doubled_by(0)(3.0) == 6.0


def test_processes_that_compile_at_once_do_not_take_each_others_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, eight = (compiled._Index(str(tmp_path), "kernel", 1.0) for _ in range(2))
    save_data = one._save_data

    def slowly(name: str, code: str) -> None:
        with monkeypatch.context() as patched:  # the other has looked before this one's index was there
            patched.setattr(eight, "_load_index", dict)
            eight.save("eight lanes", "code for eight lanes")
        save_data(name, code)

    monkeypatch.setattr(one, "_save_data", slowly)
    one.save("one lane", "code for one lane")
    assert eight.load("eight lanes") == "code for eight lanes"
    assert eight.load("one lane") in (None, "code for one lane")
    eight.save("one lane", "code for one lane")
    assert eight.load("eight lanes") == "code for eight lanes"
    assert eight.load("one lane") == "code for one lane"


def test_what_is_compiled_is_kept_in_such_an_index() -> None:
    assert compiled.caching.IndexDataCacheFile is compiled._Index
    assert isinstance(compiled.kernel(lambda x: x)._cache._cache_file, compiled._Index)
