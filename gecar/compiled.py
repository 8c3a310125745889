"""Numba, set up once: a cache that cannot go stale, and two decorators for what is compiled.

Numba's own ``cache=True`` looks only at the file a function stands in. When a compiled callee in *another* file
changes, the stale caller is loaded and gives the old answer. So the cache lives in a folder named by a hash of every
source that holds a kernel.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba.core import caching, cgutils, types
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., Any])
_KEPT_CACHES = 4
LANES = 8
"""Robots that kernels take through a step at once: two vectors of AVX2, one of AVX-512."""


def _kernel_hash(package: Path) -> str:
    """Hash the text of every room that compiles something: kernels also freeze constants of the modules beside them."""
    digest = hashlib.sha256(numba.__version__.encode())
    sources = {source: source.read_bytes() for source in sorted(package.rglob("*.py"))}
    rooms = {
        source.relative_to(package).parts[0]
        for source, text in sources.items()
        if b"@compiled" in text or b"@kernel" in text
    }
    for source, text in sources.items():
        if source.relative_to(package).parts[0] in rooms:
            digest.update(source.relative_to(package).as_posix().encode() + b"\0" + text)
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    """Return the user's cache folder; for a user without a home, as in bare containers, one nobody else can write."""
    if os.environ.get("XDG_CACHE_HOME"):
        return Path(os.environ["XDG_CACHE_HOME"])
    try:
        return Path.home() / ".cache"
    except RuntimeError:
        if not hasattr(os, "getuid"):  # Windows, where the folder for temporary files is the user's own
            return Path(tempfile.gettempdir())
    own = Path(tempfile.gettempdir()) / f"cache-{os.getuid()}"
    own.mkdir(mode=0o700, exist_ok=True)
    return own if own.stat().st_uid == os.getuid() else Path(tempfile.mkdtemp())


def _cache_folder() -> Path:
    """Return this version's cache folder, under ``GECAR_CACHE_DIR`` or the user's cache folder."""
    root = Path(os.environ.get("GECAR_CACHE_DIR") or _user_cache() / "gecar")
    folder = root / f"kernels-{_kernel_hash(Path(__file__).parent)}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        for old in sorted(root.glob("kernels-*"), key=lambda f: f.stat().st_mtime)[:-_KEPT_CACHES]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # a read-only home: Numba then falls back to its own choice of folder
    return folder


_NumbasIndex: Any = caching.IndexDataCacheFile  # numba has no types


class _Index(_NumbasIndex):  # type: ignore[misc]
    """A kernel's index in the cache, to which several processes may write at once.

    Numba counts what it compiles. Two processes that compile at once take the same number: the code of one is then
    found under the signature of the other, and in every later process what calls it fails to compile. Numbered apart
    for each signature, the worst is that one of them has to compile again.
    """

    def save(self, key: object, data: object) -> None:
        """Save a signature's machine code."""
        own = hashlib.sha256(repr(key).encode()).hexdigest()[:12]
        apart = copy(self)
        pattern = self._data_name_pattern.replace("{number", f"{own}.{{number")
        apart._data_name_pattern = pattern  # noqa: SLF001 - its own copy
        super(_Index, apart).save(key, data)


CACHE = _cache_folder()
setattr(numba.config, "CACHE_DIR", str(CACHE))  # noqa: B010 - numba declares its settings at run time
setattr(caching, "IndexDataCacheFile", _Index)  # noqa: B010


def is_cold(what: str = "complete") -> bool:
    """Whether compiled code, all of it or a named part, is still missing on this machine."""
    return not (CACHE / what).exists()


def mark_warm(what: str = "complete") -> None:
    """Remember that compiled code, all of it or a named part, is there on this machine."""
    with suppress(OSError):
        (CACHE / what).touch()


def _findable(function: F) -> F:
    """Return the function, if a later process finds its machine code in the cache.

    Numba looks for it by what the closure holds, and a compiled function there is another one in each process.
    """
    for name, value in inspect.getclosurevars(function).nonlocals.items():
        if isinstance(value, Dispatcher):
            raise TypeError(f"{function.__qualname__} closes over the compiled {name}: make {name} a global")
    return function


def compiled(function: F) -> F:
    """Compile a function to machine code, cached between runs.

    Compiled functions release the interpreter lock, never raise (division by zero gives inf or nan) and keep IEEE order
    of operations, so that results are equal on every machine with the same versions. One called by another becomes
    part of it: a step of the simulation takes an eighth less time so.

    Raises
    ------
    TypeError
        If the function's closure holds a compiled function, so that no later process would find it in the cache.
    """
    dispatcher: Any = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(
        _findable(function)
    )
    return dispatcher


def kernel(function: F) -> F:
    """Compile a function that makes no array, as `compiled`, without counting references to those it is given.

    Numba counts, atomically, whenever an array is taken out of a tuple: a third of the time of a simulated drive.
    """
    njit: Any = numba.njit  # whose types do not know _nrt
    dispatcher: Any = njit(cache=True, nogil=True, error_model="numpy", forceinline=True, _nrt=False)(
        _findable(function)
    )
    return dispatcher


def subroutine(function: F) -> F:
    """Compile a function as `kernel` does, but let it stay a function: what is long and called from several places."""
    njit: Any = numba.njit
    dispatcher: Any = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)(_findable(function))
    return dispatcher


def any_integer(value: int) -> int:
    """Return an integer as kernels get it from a variable.

    Numba compiles a kernel again for every Python integer that is written in a call of it, and once for all NumPy ones.
    """
    return cast("int", np.int64(value))


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


def _blank(typing_context: Any, dtype: Any) -> Any:  # noqa: ARG001
    """Return the type of `blank`, and what generates its code."""
    record = dtype.dtype if isinstance(dtype, types.DType) else dtype

    def make(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return cgutils.alloca_once(builder, context.get_value_type(record).pointee)  # type: ignore[no-untyped-call]

    return record(dtype), make


blank: Any = intrinsic(_blank)
"""Return a record of a dtype, for kernels, with nothing set; it lives as long as the kernel it is made in."""


def numbers(dtype: np.dtype[Any]) -> list[str]:
    """Return the fields of a record that are numbers, not arrays."""
    return [name for name in dtype.names or () if not dtype[name].shape]


def lane_access(dtype: np.dtype[Any], first: int) -> tuple[Any, Any]:
    """Return what copies a record out of and into one lane of a flat array, for kernels.

    Field f of lane k stands at ``(first + f) * lanes + k``. As the records live on the stack, and all distances are
    known where ``lanes`` is a constant, a loop over lanes that loads, calls kernels on the records and stores can
    become vector code.

    Parameters
    ----------
    dtype
        The record's; its numbers are float64, and arrays in it stay where they are.
    first
        How many fields of other records stand before it.

    Returns
    -------
    tuple
        ``load(flat, lanes, lane)`` returns the record; ``store(flat, lanes, lane, record)`` copies it back.
    """
    record = numba.from_dtype(dtype)
    offsets = {name: place[1] for name, place in (dtype.fields or {}).items()}
    fields = [(first + k, offsets[name]) for k, name in enumerate(numbers(dtype))]

    def places(context: Any, builder: Any, array_type: Any, arguments: Any, slot: Any) -> Any:
        array, lanes, lane = arguments
        data = context.make_array(array_type)(context, builder, array).data
        bytes_of = builder.bitcast(slot, ir.IntType(8).as_pointer())
        for in_flat, in_record in fields:
            row = builder.mul(lanes, context.get_constant(types.intp, in_flat))
            field = builder.gep(bytes_of, [context.get_constant(types.intp, in_record)])
            yield (
                builder.gep(data, [builder.add(lane, row)]),
                builder.bitcast(field, ir.DoubleType().as_pointer()),
            )

    def load(typing_context: Any, flat: Any, lanes: Any, lane: Any) -> Any:  # noqa: ARG001
        def copy(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            slot = cgutils.alloca_once(builder, context.get_value_type(record).pointee)  # type: ignore[no-untyped-call]
            for source, target in places(context, builder, signature.args[0], arguments, slot):
                builder.store(builder.load(source), target)
            return slot

        return record(flat, types.intp, types.intp), copy

    def store(typing_context: Any, flat: Any, lanes: Any, lane: Any, given: Any) -> Any:  # noqa: ARG001
        def copy(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            for target, source in places(context, builder, signature.args[0], arguments[:3], arguments[3]):
                builder.store(builder.load(source), target)
            return context.get_dummy_value()

        return types.void(flat, types.intp, types.intp, given), copy

    return intrinsic(load), intrinsic(store)
