"""A verdict in words a student understands."""

from __future__ import annotations

import math

from gecar.reality.materiality import Size
from gecar.reality.verdict import Found, Interval, Limit, Misfit, Place, Verdict
from gecar.world.effects import BY_ID

CHANNEL_WORDS = {
    "left_angle": "the left wheel's angle", "right_angle": "the right wheel's angle", "x": "x", "y": "y",
    "heading": "heading", "battery": "the battery's voltage", "yaw_rate": "the turning rate",
    "reflection": "the colour sensor",
}  # fmt: skip


def words(verdict: Verdict) -> list[str]:
    """Say a verdict, and what the recordings could have shown, a sentence or two a paragraph."""
    return [*sentences(verdict), *limits(verdict)]


def sentences(verdict: Verdict) -> list[str]:
    """Say a verdict, a sentence or two a paragraph."""
    out = [_headline(verdict)]
    out += [_effect(found) for found in verdict.effects]
    if verdict.minor:
        named = "; ".join(
            f"{BY_ID[m.id].title} ({m.id}), which moves the robot by {_moves(m.size)}" for m in verdict.minor
        )
        out.append(f"Visible, and too small to matter; it could be: {named}.")
    if verdict.effects:
        out.append(_proof(verdict))
    if verdict.verdict == "missing":
        out.append(f"What is left moves the robot by {_moves(verdict.residual.size)}, which does not matter.")
    if verdict.verdict.endswith("unexplained"):
        out.append(_unexplained(verdict))
    if verdict.located:
        out.append(
            "Where simulation and reality part: " + "; ".join(_place(p) for p in verdict.located[:3]) + "."
        )
    out += list(verdict.notes)
    out.append(f"Next recording: {verdict.next_recording.why}.")
    return out


def _headline(verdict: Verdict) -> str:
    names = " and ".join(BY_ID[f.id].title for f in verdict.effects)
    return {
        "nothing": _nothing(verdict),
        "missing": f"Missing in the simulation: {names}.",
        "unexplained": "Something is missing, and nothing in the catalogue explains it.",
        "missing_and_unexplained": (
            f"Missing in the simulation: {names}; and something that nothing in the catalogue explains."
        ),
    }[verdict.verdict]


def _nothing(verdict: Verdict) -> str:
    left = verdict.residual
    if left.white:
        return "Nothing is missing: the simulation follows these recordings down to the sensors' noise."
    return f"Nothing material is missing: what is left moves the robot by {_moves(left.size)}, and does not matter."


def _moves(size: Size) -> str:
    """Say a size."""
    words = []
    if size.mm_1m or size.deg_1m:
        words.append(
            f"{size.mm_1m:.1f} mm and {size.deg_1m:.1f} degrees over a metre ({size.mm_drive:.0f} mm and "
            f"{size.deg_drive:.1f} degrees over a whole recording)"
        )
    if size.reading_pct:
        words.append(f"{size.reading_pct:.1f} % of a reading")
    if size.arrival_s is not None:
        words.append(f"{size.arrival_s:.2f} s of arrival")
    return " and ".join(words) or "nothing that can be measured"


def limits(verdict: Verdict) -> list[str]:
    """Say which sizes would have been seen, and of what nothing is known, a sentence each."""
    seen = [f"{e} {_above_limit(e, each)}" for e, each in verdict.limits.items() if each]
    unseen = [e for e, each in verdict.limits.items() if not each]
    out = []
    if seen:
        out.append(f"Not found, and seen in 95 of 100 cases if there: {', '.join(seen)}.")
    if unseen:
        out.append(f"Of these these recordings say nothing: {', '.join(unseen)}.")
    return out


def _above_limit(effect: str, limit: Limit) -> str:
    """Say from what size on an effect shows; a limit or rate vanishes at infinity and shows below."""
    unit = "" if limit.unit == "-" else f" {limit.unit}"
    side = "below" if math.isinf(BY_ID[effect].parameters[0].neutral or 0.0) else "from"
    return f"{side} {limit.size:.2g}{unit}"


def _effect(found: Found) -> str:
    effect = BY_ID[found.id]
    sizes = ", ".join(f"{label} {_interval(i)}" for label, i in found.parameters.items())
    words = (
        f"{effect.title[0].upper()}{effect.title[1:]} ({effect.id}): {sizes}. It shows in {effect.signature}. "
        f"It moves the robot by {_moves(found.size)}."
    )
    if found.alternatives:
        words += f" These recordings can not tell it from {' or '.join(found.alternatives)}."
    return words


def _interval(i: Interval) -> str:
    unit = "" if i.unit == "-" else f" {i.unit}"
    return f"{i.value:.3g}{unit} ({i.low:.3g} to {i.high:.3g})"


def _proof(verdict: Verdict) -> str:
    judged = verdict.judgement
    closed = {
        name: (m.before - m.after) / (m.before - m.floor)
        for name, m in judged.channels.items()
        if m.before > 1.5 * m.floor and m.before > 1.2 * m.after
    }
    parts = ", ".join(f"{share:.0%} in {name}" for name, share in closed.items())
    where = (
        "the part set aside"
        if judged.by_time
        else f"recordings not used for the fit ({', '.join(judged.recordings)})"
    )
    return f"On {where} this explains of the mismatch: {parts}." if parts else f"Judged on {where}."


def _unexplained(verdict: Verdict) -> str:
    shown = verdict.located[0] if verdict.located else None
    words = f"No effect in the catalogue explains what is left: it moves the robot by {_moves(verdict.residual.size)}."
    if shown is not None:
        words += f" It shows most in {CHANNEL_WORDS.get(shown.channel, shown.channel)}, {shown.regime}."
    if verdict.residual.formula:
        words += f" This describes it, and is no cause: {verdict.residual.formula}."
    if verdict.residual.described:
        gains = ", ".join(f"{c} {_change(m)}" for c, m in verdict.residual.described.items())
        words += f" Added to the replays, it brings the NRMSE on what was set aside from {gains}."
    return words


def _change(misfit: Misfit) -> str:
    worse = " (worse)" if misfit.after > misfit.before else ""
    return f"{misfit.before:.4f} to {misfit.after:.4f}{worse}"


def _place(place: Place) -> str:
    spans = ", ".join(f"{a:.1f}-{b:.1f} s" for a, b in place.times_s[:3])
    spot = "" if place.place is None else f" about ({place.place[0]:.2f}, {place.place[1]:.2f}) m"
    return (
        f"{CHANNEL_WORDS.get(place.channel, place.channel)}, {place.regime}{spot}: {place.share:.0%} of its mismatch "
        f"(p = {place.p:.3f}; {place.recording} at {spans})"
    )
