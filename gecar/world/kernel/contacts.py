"""What shafts, tyres, floor and what drags on it give each other in one step: impulses, swept over until they fit.

One step solves, for both wheels at once, the impulses that would end all slip within the step, and clips them to each
wheel's friction circle; dry friction is the torque that would stop the shaft within the step, clipped to its budget.
Sticking then needs no special case. Beside a wheel that slid in the last sweep, the other one solves on its own.

Sources: projected Gauss-Seidel on impulses, Catto, GDC 2006; friction circle, Pacejka, Tire and Vehicle Dynamics,
ch. 1; friction as a clipped stopping torque, Duclusaud et al. (BAM), 2024.
"""

from __future__ import annotations

import math
from typing import Any

from gecar.compiled import kernel
from gecar.world.kernel.state import ALL


@kernel
def release_contacts(s: Any) -> None:
    """Take all impulses off; sweeps then find those of this step."""
    s.left_friction = s.right_friction = s.scrub = 0.0
    s.left_push = s.right_push = s.left_side = s.right_side = s.caster_push = s.caster_side = 0.0
    s.drag_push = s.drag_side = 0.0
    s.left_closed = s.right_closed = 1.0


@kernel
def sweep(s: Any, c: Any, effects: int = ALL, terms: bool = False, first: bool = False) -> bool:
    """Go once over shafts, tyres, caster and what drags, and give each what it asks for or all it can get.

    Three sweeps suffice, and mostly one does.

    Parameters
    ----------
    s, c
        Records of dtypes `STATE`, whose speeds and impulses are updated, and `DERIVED`.
    effects
        `ALL` where the robot has play, or something drags; see `gecar.world.kernel.dynamics.begin_step`.
    terms
        Whether the robot has terms, which may move a wheel's contact ahead of the axle.
    first
        Whether this is a step's first sweep.

    Returns
    -------
    bool
        Whether another sweep would change nothing: turning or standing shafts, gripping tyres.
    """
    settled = rub_shafts(s, c)
    if effects == ALL and first:
        _meet(s, c)
    sliding = _roll(s, c, effects, first)
    if terms and c.apart != 0.0:
        _scrub(s, c)
        sliding = True
    if effects == ALL and s.caster_circle > 0.0:
        s.caster_push, s.caster_side = _drag(
            s, s.caster_push, s.caster_side, s.caster_circle, c.caster_mass, c.caster, 0.0, c
        )
        sliding = True
    if effects == ALL and s.drag_circle > 0.0:
        s.drag_push, s.drag_side = _drag(
            s, s.drag_push, s.drag_side, s.drag_circle, c.drag_mass, c.drag_ahead, c.drag_left, c
        )
        sliding = True
    return settled and not sliding


@kernel
def sweep_on(s: Any, c: Any, effects: int, terms: bool = False) -> None:
    """Sweep once or twice more; arguments as in `sweep`. Loads on wheels behind a play follow the impulses found."""
    plays = effects == ALL and (c.left_gap > 0.0 or c.right_gap > 0.0)
    if plays:
        _shift_loads(s, c, False)
    if not sweep(s, c, effects, terms):
        if plays:
            _shift_loads(s, c, True)
        sweep(s, c, effects, terms)


@kernel
def rub_shafts(s: Any, c: Any) -> bool:
    """Give each shaft the friction impulse that would stop it, within its budget.

    Returns
    -------
    bool
        Whether another sweep would give the same: both shafts turn, or neither moved.
    """
    left = min(max(s.left_friction - s.left_speed * c.rotor, -s.left_dry), s.left_dry)
    right = min(max(s.right_friction - s.right_speed * c.rotor, -s.right_dry), s.right_dry)
    s.left_speed += (left - s.left_friction) * c.inv_rotor
    s.right_speed += (right - s.right_friction) * c.inv_rotor
    settled = (abs(left) == s.left_dry or left == s.left_friction) and (
        abs(right) == s.right_dry or right == s.right_friction
    )
    s.left_friction = left
    s.right_friction = right
    return settled


@kernel
def _roll(s: Any, c: Any, effects: int, first: bool) -> bool:
    """Give both tyres the impulses that would end their slip, within their friction circles.

    Returns
    -------
    bool
        Whether a tyre slides, or the gears have play: another sweep is then needed.
    """
    left_slip, right_slip, side_slip = slips(s, c)
    plays_l, plays_r = effects == ALL and c.left_gap > 0.0, effects == ALL and c.right_gap > 0.0
    end_l, end_r = left_slip, right_slip
    if plays_l:
        end_l = separation(left_slip, s.left_push, s.left_play, c.left_gap, c.left_radius, c)
    if plays_r:
        end_r = separation(right_slip, s.right_push, s.right_play, c.right_gap, c.right_radius, c)
    hold_l, hold_r = _hold(end_l, end_r, side_slip, c)
    if first:
        s.left_asks += hold_l
        s.right_asks += hold_r
    # As if both slid: each on its own.
    slide_l, slide_ls = s.left_push + c.left_mass * end_l, s.left_side + c.left_mass * side_slip
    slide_r, slide_rs = s.right_push + c.right_mass * end_r, s.right_side + c.right_mass * side_slip
    left, left_side, right, right_side = slide_l, slide_ls, slide_r, slide_rs
    free_l = s.left_slides != 0.0 or (plays_l and end_l == 0.0)
    free_r = s.right_slides != 0.0 or (plays_r and end_r == 0.0)
    if not free_l and not free_r:
        # Where both hold, they share the side force as they share the load.
        left, right = s.left_push + hold_l, s.right_push + hold_r
        side = c.m_ls * end_l + c.m_rs * end_r + c.m_ss * side_slip
        share = side / max(s.left_circle + s.right_circle, 1e-30)
        left_side = s.left_side + share * s.left_circle
        right_side = s.right_side + share * s.right_circle
    elif not free_l:
        left = s.left_push + (c.n_ll * end_l + c.n_ls * side_slip)
        left_side = s.left_side + (c.n_ls * end_l + c.n_lss * side_slip)
    elif not free_r:
        right = s.right_push + (c.n_rr * end_r + c.n_rs * side_slip)
        right_side = s.right_side + (c.n_rs * end_r + c.n_rss * side_slip)
    if plays_l:
        left, slide_l = _one_way(left, s.left_push, end_l), _one_way(slide_l, s.left_push, end_l)
    if plays_r:
        right, slide_r = _one_way(right, s.right_push, end_r), _one_way(slide_r, s.right_push, end_r)
    left, left_side, s.left_slides = _within_circle(
        left, left_side, s.left_circle, slide_l, slide_ls, s.left_closed
    )
    right, right_side, s.right_slides = _within_circle(
        right, right_side, s.right_circle, slide_r, slide_rs, s.right_closed
    )
    _push(s, left, right, left_side, right_side, c)
    return s.left_slides != 0.0 or s.right_slides != 0.0 or plays_l or plays_r


@kernel
def _shift_loads(s: Any, c: Any, aside: bool) -> None:
    """Let the circles of wheels behind a play follow the loads that this step's impulses shift.

    Loads are else those of the step before, in which a gear that closes did not push yet. A wheel that slides pushes
    with all it has, and so changes its own load: that is solved for (Newton's method). What shifts ``aside`` is known
    after two sweeps, as the first does not know yet which tyre slides; two find by how much it changes.
    """
    left = s.left_push / max(s.left_closed, 1e-30) if s.left_slides != 0.0 else s.left_push
    right = s.right_push / max(s.right_closed, 1e-30) if s.right_slides != 0.0 else s.right_push
    shift = caster_load((left + right + s.caster_push + s.drag_push) * c.inv_dt, c) - s.caster_load
    s.caster_load += shift / (1.0 + 0.5 * s.grip * abs(c.caster_arm) * (s.left_slides + s.right_slides))
    if aside:
        found = s.left_side + s.right_side + s.caster_side + s.drag_side
        s.aside += found - s.aside_found
        s.aside_found = found
    left, right = wheel_loads(s.caster_load, s.aside * c.inv_dt, c)
    s.left_circle *= left / max(s.left_bears, 1e-30)
    s.right_circle *= right / max(s.right_bears, 1e-30)
    s.left_bears, s.right_bears = left, right


@kernel
def impulses_on_body(s: Any) -> tuple[float, float]:
    """Return the impulses [N s] that all contacts give the body, ahead and to the left."""
    return (
        s.left_push + s.right_push + s.caster_push + s.drag_push,
        s.left_side + s.right_side + s.caster_side + s.drag_side,
    )


@kernel
def caster_load(ahead: float, c: Any) -> float:
    """Return the load on the caster [N] under a force ahead [N]: its share of the weight, and what the force shifts."""
    return min(max(c.caster_static + ahead * c.caster_arm, 0.0), c.weight)


@kernel
def wheel_loads(caster: float, aside: float, c: Any) -> tuple[float, float]:
    """Return the loads on the left and the right wheel [N], given the caster's and a force to the left [N]."""
    wheel = 0.5 * (c.weight - caster)
    left = min(max(wheel - aside * c.transfer_side, 0.0), 2.0 * wheel)
    right = min(max(wheel + aside * c.transfer_side, 0.0), 2.0 * wheel)
    return left, right


@kernel
def slips(s: Any, c: Any) -> tuple[float, float, float]:
    """Return the slips [m/s] of the left and the right tyre along the robot, and of both to the side."""
    left = s.left_speed * c.left_radius - (s.u - s.yaw_rate * c.half_track)
    right = s.right_speed * c.right_radius - (s.u + s.yaw_rate * c.half_track)
    return left, right, -(s.w + s.yaw_rate * c.axle)


@kernel
def _hold(left_slip: float, right_slip: float, side_slip: float, c: Any) -> tuple[float, float]:
    """Return the pushes [N s] of the left and the right tyre that end these slips, if both hold."""
    left = c.m_ll * left_slip + c.m_lr * right_slip + c.m_ls * side_slip
    right = c.m_rr * right_slip + c.m_lr * left_slip + c.m_rs * side_slip
    return left, right


@kernel
def _scrub(s: Any, c: Any) -> None:
    """Give both tyres opposed side impulses that would end the turn, within what their circles leave.

    Contacts that are not beside one another cannot both roll while the robot turns: they slip to opposite sides.
    """
    left = s.left_circle * s.left_circle - s.left_push * s.left_push
    right = s.right_circle * s.right_circle - s.right_push * s.right_push
    most = c.apart * math.sqrt(max(min(left, right), 0.0))
    scrub = min(max(s.scrub - s.yaw_rate / c.inv_inertia, -most), most)
    s.yaw_rate += (scrub - s.scrub) * c.inv_inertia
    s.scrub = scrub


@kernel
def separation(slip: float, push: float, play: float, gap: float, radius: float, c: Any) -> float:
    """Return the part of a slip [m/s] that gears and tyre oppose, given where in the play the wheel is.

    The gap, half the play to either side [rad], leaves the slips that do not close it within the step alone. Without
    one the slip is returned as it is.
    """
    if gap == 0.0:
        return slip
    low = -(gap + play) * radius * c.inv_dt
    high = (gap - play) * radius * c.inv_dt
    if push > 0.0:
        return slip - high
    if push < 0.0:
        return slip - low
    return slip - min(max(slip, low), high)


@kernel
def _meet(s: Any, c: Any) -> None:
    """Set for what share of the step tyres behind a play can pull."""
    left_slip, right_slip, _ = slips(s, c)
    if c.left_gap > 0.0:
        end = separation(left_slip, 0.0, s.left_play, c.left_gap, c.left_radius, c)
        s.left_closed, s.left_opened = _closed(left_slip, end, s.left_play, c.left_gap, s.left_opened)
    if c.right_gap > 0.0:
        end = separation(right_slip, 0.0, s.right_play, c.right_gap, c.right_radius, c)
        s.right_closed, s.right_opened = _closed(right_slip, end, s.right_play, c.right_gap, s.right_opened)


@kernel
def _closed(slip: float, end: float, play: float, gap: float, opened: float) -> tuple[float, float]:
    """Return the share of the step for which a tyre behind a play can pull, and that for which its gear was open.

    A gear that closes within the step, after a share f of it, pulls for the rest. A force that sets in there moves what
    it pulls by (1 - f)²/2 of what it does in a whole step, and by the end of the next step by 3/2 - f: so the next step
    has 1 - f²/2 of it. ``opened`` is f of the step before.
    """
    if end == 0.0 or abs(play) == gap:
        return 1.0 - 0.5 * opened * opened, 0.0
    closed = end / slip
    return 0.5 * closed * closed, 1.0 - closed


@kernel
def _one_way(new: float, old: float, end: float) -> float:
    """Keep a gear's push from changing sides within a sweep, and from acting inside the gap."""
    if old > 0.0:
        return max(new, 0.0)
    if old < 0.0:
        return min(new, 0.0)
    return new if new * end > 0.0 else 0.0


@kernel
def _within_circle(
    push: float, side: float, circle: float, slide_push: float, slide_side: float, closed: float
) -> tuple[float, float, float]:
    """Return a tyre's impulses, and 1 if it slides, else 0; a sliding tyre pulls along its slip, with all it has.

    Along the robot it does so for the share of the step in which its gear is ``closed``.
    """
    if push * push + side * side <= circle * circle and abs(push) <= closed * circle:
        return push, side, 0.0
    scale = circle / math.sqrt(slide_push * slide_push + slide_side * slide_side + 1e-30)
    return slide_push * scale * closed, slide_side * scale, 1.0


@kernel
def _push(s: Any, left: float, right: float, left_side: float, right_side: float, c: Any) -> None:
    """Replace the tyres' impulses; what changes acts on body and shafts."""
    more_left = left - s.left_push
    more_right = right - s.right_push
    more_side = (left_side + right_side) - (s.left_side + s.right_side)
    shove(s, more_left + more_right, more_side, c)
    s.yaw_rate += ((more_right - more_left) * c.half_track + more_side * c.axle) * c.inv_inertia
    s.left_speed -= more_left * c.left_radius * c.inv_rotor
    s.right_speed -= more_right * c.right_radius * c.inv_rotor
    s.left_push = left
    s.right_push = right
    s.left_side = left_side
    s.right_side = right_side


@kernel
def shove(s: Any, ahead: float, aside: float, c: Any) -> None:
    """Let an impulse [N s] change the body's velocity.

    Forces act at the time of the positions, half a step before the velocities they change: in between the heading
    turns by ``half_turn``. Along the later heading the force that holds a robot on its curve would brake its turn,
    by m d² w³ dt / 2 with the centre of mass d behind the axle.
    """
    s.u += (ahead + s.half_turn * aside) * c.inv_mass
    s.w += (aside - s.half_turn * ahead) * c.inv_mass


@kernel
def repay_tyres(s: Any, c: Any) -> None:
    """Correct what tyres gave in the step before the last, if they began to slide in it; then remember the last step.

    Commands change in the middle of a step, and a tyre holds until then. What it gave too much or too little comes two
    steps late, which is second order in the step. Tyres behind a play are left out: they push from when it closes.
    """
    left = right = 0.0
    if s.left_held * s.left_slides != 0.0 and c.left_gap == 0.0:
        left = _owed(s.left_earlier, s.left_asked, s.left_asks, s.left_push) - s.left_latest
    if s.right_held * s.right_slides != 0.0 and c.right_gap == 0.0:
        right = _owed(s.right_earlier, s.right_asked, s.right_asks, s.right_push) - s.right_latest
    s.u += (left + right) * c.inv_mass
    s.yaw_rate += (right - left) * c.half_track * c.inv_inertia
    s.left_speed -= left * c.left_radius * c.inv_rotor
    s.right_speed -= right * c.right_radius * c.inv_rotor
    s.left_held, s.right_held = 1.0 - s.left_slid, 1.0 - s.right_slid
    s.left_slid, s.right_slid = s.left_slides, s.right_slides
    s.left_earlier, s.right_earlier = s.left_latest, s.right_latest
    s.left_latest, s.right_latest = s.left_push, s.right_push
    s.left_asked, s.right_asked = s.left_asks, s.right_asks
    left_slip, right_slip, side_slip = slips(s, c)
    left, right = _hold(left_slip, right_slip, side_slip, c)
    # What is left of earlier slips is no part of what motors ask for.
    s.left_asks, s.right_asks = -left, -right


@kernel
def _owed(earlier: float, asked: float, asks: float, push: float) -> float:
    """Return the push [N s] a tyre should have given in a step in which it began to slide.

    It is the push of the step before until then, and that of the next step from then on, each for its share.

    Parameters
    ----------
    earlier
        Its push in the step before, in which it held.
    asked, asks
        What would have held it in the step, and in the next one: the first is the mean over the shares.
    push
        Its push in the next step, in which it slides.
    """
    rise = asks - earlier
    share = min(max((asked - earlier) / rise, 0.0), 1.0) if rise != 0.0 else 1.0
    return earlier + share * (push - earlier)


@kernel
def _drag(
    s: Any, push: float, side: float, circle: float, mass: float, ahead: float, left: float, c: Any
) -> tuple[float, float]:
    """Give a point of the robot the impulse that would stop it, within its friction circle, against its motion.

    Parameters
    ----------
    push, side
        What it was given in the last sweep, ahead and to the left [N s].
    circle
        The most it can be given [N s].
    mass
        What an impulse there moves, at least [kg].
    ahead, left
        Where it is, from the centre of mass [m].

    Returns
    -------
    tuple
        What it is given, ahead and to the left.
    """
    more = push - mass * (s.u - s.yaw_rate * left)
    more_side = side - mass * (s.w + s.yaw_rate * ahead)
    reach = more * more + more_side * more_side
    if reach > circle * circle:
        scale = circle / math.sqrt(reach)
        more *= scale
        more_side *= scale
    shove(s, more - push, more_side - side, c)
    s.yaw_rate += ((more_side - side) * ahead - (more - push) * left) * c.inv_inertia
    return more, more_side
