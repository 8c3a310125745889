"""pymunk from compiled code: the rigid body, walls and obstacles, stepped through pymunk's own C entry points.

A pymunk step from Python costs several microseconds, nearly all of it Python. The library behind it offers plain C
functions that take pointers and doubles: ``cpSpaceStep`` and two batch functions that read and write a body's fields
through a buffer (``pymunk.batch`` shows their use). Kernels call them by address.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pymunk
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from pymunk._chipmunk_cffi import ffi, lib  # the batch functions' addresses are nowhere else

from gecar.compiled import kernel

# Rows of the address table a kernel receives.
SPACE, BODY, STEP, READ, WRITE, REQUEST = range(6)


class EngineArrays(NamedTuple):
    """What a kernel needs to step a pymunk space.

    Attributes
    ----------
    addresses
        Address table, shape (6,); all zero: no engine, the kernel moves the body itself.
    buffer
        Where the batch functions put and find the body's fields, shape (64,).
    filled
        How many of them, shape (1,).
    """

    addresses: npt.NDArray[np.int64]
    buffer: npt.NDArray[np.float64]
    filled: npt.NDArray[np.int32]


NO_ENGINE = EngineArrays(np.zeros(6, np.int64), np.zeros(1), np.zeros(1, np.int32))

# The batch functions grow a buffer (by realloc, fatal for one of ours) before it is quite full.
_ROOM = 64
_MOTION = lib.POSITION | lib.ANGLE | lib.VELOCITY | lib.ANGULAR_VELOCITY


def _call(builder: Any, address: Any, arguments: Sequence[Any]) -> None:
    kind = ir.FunctionType(ir.VoidType(), [argument.type for argument in arguments])
    builder.call(builder.inttoptr(address, kind.as_pointer()), arguments)


@intrinsic
def _call_pointer_double(typing: Any, function: Any, pointer: Any, number: Any) -> Any:  # noqa: ARG001
    """Call ``void f(void *, double)`` at an address."""

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), generate


@intrinsic
def _call_pointers(typing: Any, function: Any, first: Any, second: Any) -> Any:  # noqa: ARG001
    """Call ``void f(void *, void *)`` at an address."""

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), generate


@kernel
def engine_step(s: Any, dt: float, engine: EngineArrays) -> float:
    """Let pymunk move the robot and everything it touches by one step.

    Returns
    -------
    float
        How far the body turned [rad].
    """
    before = s.heading
    address, buffer, filled = engine.addresses, engine.buffer, engine.filled
    buffer[0], buffer[1], buffer[2] = s.x, s.y, s.heading
    buffer[3], buffer[4], buffer[5] = s.vx, s.vy, s.yaw_rate
    filled[0] = 0
    _call_pointers(address[WRITE], address[BODY], address[REQUEST])  # type: ignore[call-arg]
    _call_pointer_double(address[STEP], address[SPACE], dt)
    filled[0] = 0
    _call_pointers(address[READ], address[BODY], address[REQUEST])
    s.x, s.y, s.heading = buffer[0], buffer[1], buffer[2]
    s.vx, s.vy, s.yaw_rate = buffer[3], buffer[4], buffer[5]
    return s.heading - before


@dataclass(frozen=True)
class Engine:
    """A pymunk space with the robot in it, and what a kernel needs to step it.

    Attributes
    ----------
    space, body
        pymunk's own objects; the robot's body has its origin at the centre of mass.
    arrays
        For kernels.
    keep_alive
        What the addresses point to.
    """

    space: pymunk.Space
    body: pymunk.Body
    arrays: EngineArrays
    keep_alive: tuple[Any, ...]


def _address(pointer: Any) -> int:
    return int(ffi.cast("uintptr_t", pointer))


def make_engine(space: pymunk.Space, body: pymunk.Body) -> Engine:
    """Wire a space and the robot's body to compiled code."""
    buffer = np.zeros(_ROOM)
    floats = ffi.new("pmFloatArray *")
    ints = ffi.new("pmIntArray *")
    held = ffi.from_buffer("cpFloat[]", buffer)
    floats.num, floats.max, floats.arr = 0, len(buffer), held
    request = ffi.new("pmBatchedData *")
    request.fields, request.floatArray, request.intArray = _MOTION, floats, ints
    filled = np.frombuffer(ffi.buffer(ffi.addressof(floats, "num")), np.int32)
    addresses = np.zeros(6, np.int64)
    addresses[SPACE] = _address(space._space)  # noqa: SLF001 - pymunk has no public handle for C callers
    addresses[BODY] = _address(body._body)  # noqa: SLF001
    addresses[STEP] = _address(ffi.addressof(lib, "cpSpaceStep"))
    addresses[READ] = _address(ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched"))
    addresses[WRITE] = _address(ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched"))
    addresses[REQUEST] = _address(request)
    return Engine(space, body, EngineArrays(addresses, buffer, filled), (floats, ints, request, held))
