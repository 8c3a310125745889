"""The nominal robot in plain Python, without any effect: what the kernel must equal bit for bit."""

from __future__ import annotations

import math

import numpy as np

GRAVITY, SWEEPS, DT = 9.81, 3, 0.002


def _turned(cos, sin, angle):
    a2 = angle * angle
    sine = angle * (1.0 + a2 * (-1.0 / 6.0 + a2 * (1.0 / 120.0 + a2 * (-1.0 / 5040.0))))
    cosine = 1.0 + a2 * (-0.5 + a2 * (1.0 / 24.0 + a2 * (-1.0 / 720.0 + a2 * (1.0 / 40320.0))))
    return cos * cosine - sin * sine, sin * cosine + cos * sine


def _clip(value, limit):
    return min(max(value, -limit), limit)


def _circled(push, side, circle, slide_push, slide_side):
    if push * push + side * side <= circle * circle:
        return push, side, False
    scale = circle / math.sqrt(slide_push * slide_push + slide_side * slide_side + 1e-30)
    return slide_push * scale, slide_side * scale, True


def _owed(before, after, friction, budget, load):
    way = math.copysign(1.0, before)
    if after * way > 0.0 and friction == -way * budget:
        return 0.0
    had = abs(before) * load
    slows = had + way * (friction - after * load)
    if slows + budget <= had:
        return -way * budget - friction
    return way * min(budget - slows, 0.0) * (1.0 - had / (slows + budget)) - after * load


def _repaid(free, before, stood, due, dry, rotor):
    pull = (free - before) * rotor
    if stood:
        starts = pull * due > 0.0 and abs(pull) > max(dry, abs(due))
        lost = abs(due) * (1.0 - dry / abs(pull)) - max(abs(due) - dry, 0.0) if starts else 0.0
        return free + math.copysign(lost, due) * (1.0 / rotor), pull if before == 0.0 else 0.0
    return free + due * (1.0 / rotor), pull if before == 0.0 and due == 0.0 else 0.0


def _should_have_given(earlier, asked, asks, push):
    rise = asks - earlier
    share = min(max((asked - earlier) / rise, 0.0), 1.0) if rise != 0.0 else 1.0
    return earlier + share * (push - earlier)


def nominal_run(duties, robot):  # noqa: C901, PLR0915 - one plain loop to hold against the kernel
    """Return the centre of mass and the left shaft's angle after every step, three arrays of shape (steps,)."""
    body, motor = robot.body, robot.motor
    k = (motor.torque_constant * motor.back_emf_constant / motor.resistance) * DT / motor.inertia
    keep, rotor = math.exp(-k), motor.inertia * k / -math.expm1(-k)
    inv_m, inv_i, inv_j = 1.0 / body.mass, 1.0 / body.yaw_inertia, 1.0 / rotor
    a, e, r = 0.5 * body.track_width, -body.com_ahead, body.wheel_radius
    yaw_part = a * a * inv_i
    own, both = inv_m + yaw_part + r * r * inv_j, inv_m - yaw_part
    aside, cross = inv_m + e * e * inv_i, a * e * inv_i
    det = aside * (own * own - both * both) - cross * cross * (own + own + 2.0 * both)
    m_own, m_both = (own * aside - cross * cross) / det, -(both * aside + cross * cross) / det
    m_side, m_ss = cross * (both + own) / det, (own * own - both * both) / det
    alone = own * aside - cross * cross
    n_own, n_side, n_ss = aside / alone, cross / alone, own / alone
    load = rotor / (1.0 - m_own * r * r * inv_j)
    slides_l = slides_r = slid_l = slid_r = False
    held_l = held_r = False
    latest_l = latest_r = earlier_l = earlier_r = asks_l = asks_r = asked_l = asked_r = 0.0
    weight, gain = body.mass * GRAVITY, DT * motor.torque_constant / (rotor * motor.resistance)
    dry, voltage, mass_w = motor.coulomb_friction * DT, robot.battery.voltage, 1.0 / own
    caster_static = weight * body.com_ahead / body.caster_ahead
    cos, sin, x, y, heading = 1.0, 0.0, body.com_ahead, 0.0, 0.0
    vx = vy = yaw = wl = wr = left = 0.0
    pl = pr = ql = qr = was_l = was_r = due_l = due_r = known = 0.0
    out = np.empty((3, len(duties)))
    for n, (dl, dr) in enumerate(duties):
        half = 0.5 * DT * yaw
        cos, sin = _turned(cos, sin, half)
        u, w = vx * cos + vy * sin, vy * cos - vx * sin
        back_l = back_r = 0.0
        if held_l and slides_l:
            back_l = _should_have_given(earlier_l, asked_l, asks_l, pl) - latest_l
        if held_r and slides_r:
            back_r = _should_have_given(earlier_r, asked_r, asks_r, pr) - latest_r
        u, yaw = u + (back_l + back_r) * inv_m, yaw + (back_r - back_l) * a * inv_i
        wl, wr = wl - back_l * r * inv_j, wr - back_r * r * inv_j
        held_l, held_r, slid_l, slid_r = not slid_l, not slid_r, slides_l, slides_r
        earlier_l, earlier_r, latest_l, latest_r = latest_l, latest_r, pl, pr
        asked_l, asked_r = asks_l, asks_r
        sl, sr, ss = wl * r - (u - yaw * a), wr * r - (u + yaw * a), -(w + yaw * e)
        asks_l = -(m_own * sl + m_both * sr + m_side * ss)
        asks_r = -(m_own * sr + m_both * sl + -m_side * ss)
        stood_l, stood_r, was_l, was_r = was_l == 0.0, was_r == 0.0, wl, wr
        wl, due_l = _repaid(keep * wl + gain * dl * voltage, was_l, stood_l, due_l, known, rotor)
        wr, due_r = _repaid(keep * wr + gain * dr * voltage, was_r, stood_r, due_r, known, rotor)
        known = dry
        caster = min(
            max(caster_static + (pl + pr) * (1.0 / DT) * (-body.com_height / body.caster_ahead), 0.0), weight
        )
        wheel, shift = 0.5 * (weight - caster), (ql + qr) * (1.0 / DT) * (body.com_height / body.track_width)
        loads = [min(max(wheel - shift, 0.0), 2.0 * wheel), min(max(wheel + shift, 0.0), 2.0 * wheel)]
        circles = [robot.tyre.friction * DT * load for load in loads]
        pl = pr = ql = qr = fl = fr = 0.0
        for number in range(SWEEPS):
            new_fl, new_fr = _clip(fl - wl * rotor, dry), _clip(fr - wr * rotor, dry)
            wl, wr = wl + (new_fl - fl) * inv_j, wr + (new_fr - fr) * inv_j
            settled = (abs(new_fl) == dry or new_fl == fl) and (abs(new_fr) == dry or new_fr == fr)
            fl, fr = new_fl, new_fr
            sl, sr, ss = wl * r - (u - yaw * a), wr * r - (u + yaw * a), -(w + yaw * e)
            if number == 0:
                asks_l += m_own * sl + m_both * sr + m_side * ss
                asks_r += m_own * sr + m_both * sl + -m_side * ss
            slide = [(pl + mass_w * sl, ql + mass_w * ss), (pr + mass_w * sr, qr + mass_w * ss)]
            (new_l, new_ql), (new_r, new_qr) = slide
            if not slides_l and not slides_r:
                new_l = pl + (m_own * sl + m_both * sr + m_side * ss)
                new_r = pr + (m_own * sr + m_both * sl + -m_side * ss)
                side = m_side * sl + -m_side * sr + m_ss * ss
                share = side / max(circles[0] + circles[1], 1e-30)
                new_ql, new_qr = ql + share * circles[0], qr + share * circles[1]
            elif not slides_l:
                new_l, new_ql = pl + (n_own * sl + n_side * ss), ql + (n_side * sl + n_ss * ss)
            elif not slides_r:
                new_r, new_qr = pr + (n_own * sr + -n_side * ss), qr + (-n_side * sr + n_ss * ss)
            new_l, new_ql, slides_l = _circled(new_l, new_ql, circles[0], *slide[0])
            new_r, new_qr, slides_r = _circled(new_r, new_qr, circles[1], *slide[1])
            more_l, more_r, more_s = new_l - pl, new_r - pr, (new_ql + new_qr) - (ql + qr)
            more_p = more_l + more_r
            u, w = u + (more_p + half * more_s) * inv_m, w + (more_s - half * more_p) * inv_m
            yaw += ((more_r - more_l) * a + more_s * e) * inv_i
            wl, wr = wl - more_l * r * inv_j, wr - more_r * r * inv_j
            pl, pr, ql, qr = new_l, new_r, new_ql, new_qr
            if settled and not slides_l and not slides_r:
                break
        u, w, yaw, wl, wr = (v if abs(v) > 1e-15 else 0.0 for v in (u, w, yaw, wl, wr))
        if was_l != 0.0:
            due_l = _owed(was_l, wl, fl, dry, load if pl != 0.0 and not slides_l else rotor)
        if was_r != 0.0:
            due_r = _owed(was_r, wr, fr, dry, load if pr != 0.0 and not slides_r else rotor)
        left += wl * DT
        vx, vy = u * cos - w * sin, u * sin + w * cos
        x, y, heading = x + vx * DT, y + vy * DT, heading + yaw * DT
        cos, sin = _turned(cos, sin, yaw * DT - half)
        out[:, n] = x, y, left
    return out
