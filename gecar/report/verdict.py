"""A verdict in words a student understands."""

from __future__ import annotations

from gecar.reality.verdict import Found, Interval, Misfit, Place, Verdict
from gecar.world.effects import BY_ID

CHANNEL_WORDS = {
    "left_angle": "the left wheel's angle", "right_angle": "the right wheel's angle", "x": "x", "y": "y",
    "heading": "heading", "battery": "the battery's voltage", "yaw_rate": "the turning rate",
    "reflection": "the colour sensor",
}  # fmt: skip


def sentences(verdict: Verdict) -> list[str]:
    """Say a verdict, a sentence or two a paragraph."""
    out = [_headline(verdict)]
    out += [_effect(found) for found in verdict.effects]
    if verdict.effects:
        out.append(_proof(verdict))
    if verdict.verdict == "missing" and not verdict.residual.white:
        out.append("What is left is more than noise, but little beside what was found.")
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
        "nothing": "Nothing is missing: the simulation follows these recordings down to the sensors' noise.",
        "missing": f"Missing in the simulation: {names}.",
        "unexplained": "Something is missing, and nothing in the catalogue explains it.",
        "missing_and_unexplained": (
            f"Missing in the simulation: {names}; and something that nothing in the catalogue explains."
        ),
    }[verdict.verdict]


def _effect(found: Found) -> str:
    effect = BY_ID[found.id]
    sizes = ", ".join(f"{label} {_interval(i)}" for label, i in found.parameters.items())
    words = (
        f"{effect.title[0].upper()}{effect.title[1:]} ({effect.id}): {sizes}. It shows in {effect.signature}."
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
    words = "No effect in the catalogue explains what is left."
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
