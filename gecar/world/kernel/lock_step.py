"""A step of several robots at once, so that the compiler's vector instructions serve all of them.

The numbers of all lanes lie in one flat array, field after field, indexed ``field * lanes + lane``. A loop over the
lanes copies its lane's fields into records on the stack, calls the kernels of `gecar.world.kernel.dynamics` on them,
and copies back; LLVM turns the branches of the kernels into selects, and the loop into vector code: physics stands
once. In one array all distances between fields are known when it is compiled: nothing has to be checked at run time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import any_integer, blank, kernel, lane_access, numbers
from gecar.world.effects import PHYSICS
from gecar.world.kernel.contacts import sweep_on
from gecar.world.kernel.dynamics import begin_as_asked, begin_step, drift, end_step, enter_step, reshape
from gecar.world.kernel.laws import N_SCRATCH, VIEW, load_asked, store_view
from gecar.world.kernel.state import ALL, DERIVED, STATE
from gecar.world.kernel.terms import ask, look_at

_ZERO = any_integer(0)
_VECTOR = 8  # numbers in the longest vector there is

ACTING = np.dtype([(field, np.float64) for field in ("left", "right", "settled")])
"""The commands that act in a step, after cap and delay, and whether its contacts are settled."""

# Of each lane: where its terms are worked out, its state, physics, derived constants and commands.
_S = N_SCRATCH
_P = _S + len(STATE.descr)
_C = _P + len(numbers(PHYSICS))
_A = _C + len(DERIVED.descr)
N_FIELDS = _A + len(ACTING.descr)
"""Fields of a lane; others may follow."""

load_state, store_state = lane_access(STATE, _S)
load_physics, store_physics = lane_access(PHYSICS, _P)
load_derived, store_derived = lane_access(DERIVED, _C)
load_acting, store_acting = lane_access(ACTING, _A)


def lane_memory(fields: int, lanes: int) -> npt.NDArray[np.float64]:
    """Return zeros for so many fields of all lanes, at a multiple of a vector's size: a seventh less time."""
    raw = np.zeros(fields * lanes + _VECTOR)
    first = -raw.ctypes.data // raw.itemsize % _VECTOR
    return raw[first : first + fields * lanes]


@kernel
def advance_lanes(flat: npt.NDArray[np.float64], lanes: int, effects: int) -> None:
    """Advance all lanes by one step under the commands that act, as `gecar.world.kernel.dynamics.step` and `drift` do.

    Parameters
    ----------
    flat
        State, physics, derived constants and commands of all lanes; ``N_FIELDS * lanes`` numbers or more.
    lanes, effects
        Constants where this is called, for vector code; ``effects`` as in `gecar.world.kernel.dynamics.begin_step`.
    """
    unsettled = _ZERO
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        c = load_derived(flat, lanes, lane)
        a = load_acting(flat, lanes, lane)
        settled = begin_step(s, a.left, a.right, p, c, effects)
        a.settled = 1.0 if settled else 0.0
        unsettled += 0 if settled else 1
        store_state(flat, lanes, lane, s)
        store_acting(flat, lanes, lane, a)
    _finish(flat, lanes, effects, False, unsettled)


@kernel
def advance_lanes_with_terms(
    flat: npt.NDArray[np.float64],
    lanes: int,
    robots: npt.NDArray[Any],
    alike: bool,
    stores: npt.NDArray[np.float64],
) -> None:
    """Do the same for robots with terms, as `gecar.world.kernel.dynamics.step_with_terms` does.

    Parameters
    ----------
    flat, lanes
        As in `advance_lanes`.
    robots, alike, stores
        As in `gecar.world.kernel.terms.ask`.
    """
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        c = load_derived(flat, lanes, lane)
        a = load_acting(flat, lanes, lane)
        v = blank(VIEW)
        enter_step(s, c, ALL)
        look_at(s, a.left, a.right, p, c, v)
        store_state(flat, lanes, lane, s)
        store_view(flat, lanes, lane, v)
    ask(robots, alike, load_derived(flat, lanes, 0).dt, stores, flat, lanes)
    reshaped = False
    for lane in range(lanes):
        asked = load_asked(flat, lanes, lane)
        reshaped = reshaped or asked.shape_terms > 0.0
    if reshaped:
        for lane in range(lanes):
            c = load_derived(flat, lanes, lane)
            reshape(load_physics(flat, lanes, lane), load_asked(flat, lanes, lane), c)
            store_derived(flat, lanes, lane, c)
    unsettled = _ZERO
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        c = load_derived(flat, lanes, lane)
        a = load_acting(flat, lanes, lane)
        settled = begin_as_asked(s, a.left, a.right, p, c, load_asked(flat, lanes, lane))
        a.settled = 1.0 if settled else 0.0
        unsettled += 0 if settled else 1
        store_state(flat, lanes, lane, s)
        store_acting(flat, lanes, lane, a)
    _finish(flat, lanes, ALL, True, unsettled)


@kernel
def _finish(flat: npt.NDArray[np.float64], lanes: int, effects: int, terms: bool, unsettled: int) -> None:
    """Sweep until all contacts are settled, and end the step."""
    if unsettled > 0:
        for lane in range(lanes):
            s = load_state(flat, lanes, lane)
            c = load_derived(flat, lanes, lane)
            a = load_acting(flat, lanes, lane)
            if a.settled == 0.0:
                sweep_on(s, c, effects, terms)
            store_state(flat, lanes, lane, s)
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        c = load_derived(flat, lanes, lane)
        end_step(s, p, c, effects)
        drift(s, c)
        store_state(flat, lanes, lane, s)
