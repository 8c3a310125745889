"""Numba, set up once: a cache that can not go stale, and one decorator for every kernel.

Numba's own ``cache=True`` looks only at the file a function stands in. When a compiled callee in *another* file
changes, the stale caller is loaded and gives the old answer. So the cache lives in a folder named by a hash of every
source that holds a kernel.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import cgutils, types
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., Any])
_KEPT_CACHES = 4


def _kernel_hash(package: Path) -> str:
    """Hash the text of every module that compiles something."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"compiled" in text:
            digest.update(source.relative_to(package).as_posix().encode() + b"\0" + text)
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    """Return this version's cache folder, under ``GECAR_CACHE_DIR`` or the user's cache folder."""
    home = os.environ.get("GECAR_CACHE_DIR")
    root = Path(home) if home else Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "gecar"
    folder = root / f"kernels-{_kernel_hash(Path(__file__).parent)}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        for old in sorted(root.glob("kernels-*"), key=lambda f: f.stat().st_mtime)[:-_KEPT_CACHES]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # a read-only home: Numba then falls back to its own choice of folder
    return folder


CACHE = _cache_folder()
setattr(numba.config, "CACHE_DIR", str(CACHE))  # noqa: B010 - numba declares its settings at run time


def is_cold() -> bool:
    """Whether no command has compiled all it needs here yet."""
    return not (CACHE / "complete").exists()


def mark_warm() -> None:
    """Remember that a command has compiled all it needs."""
    with suppress(OSError):
        (CACHE / "complete").touch()


def compiled(function: F) -> F:
    """Compile a kernel to machine code, cached between runs.

    Kernels release the interpreter lock, never raise (division by zero gives inf or nan) and keep IEEE order of
    operations, so that results are equal on every machine with the same versions. A kernel called by another becomes
    part of it: a step of the simulation takes an eighth less time so.
    """
    dispatcher: Any = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function)
    return dispatcher


def _on_stack(typing_context: Any, record: Any) -> Any:  # noqa: ARG001
    """Return the type of `on_stack`, and what generates its code; see `numba.extending.intrinsic`."""

    def copy(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        (pointer,) = arguments
        slot = cgutils.alloca_once(builder, pointer.type.pointee)  # type: ignore[no-untyped-call]
        size = context.get_constant(types.intp, context.get_abi_sizeof(pointer.type.pointee))
        cgutils.raw_memcpy(builder, slot, pointer, size, 1)  # type: ignore[no-untyped-call]
        return slot

    return record(record), copy


on_stack: Any = intrinsic(_on_stack)
"""Return a copy of a record, for kernels: it lives as long as the kernel it is made in, and has to be written back.

Nothing else points to it, so that its fields stay in registers between one kernel and the next that is part of it: a
step of the simulation takes a seventh less time so.
"""
