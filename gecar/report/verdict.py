"""A verdict in plain words."""

from __future__ import annotations

import math

from gecar.reality.materiality import Size
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.verdict import VISIBLE, Found, Interval, Limit, Minor, Misfit, Place, Verdict
from gecar.report.law import law_sentence
from gecar.report.units import amount, quantities, smallest
from gecar.world.effects import BY_ID

CHANNEL_WORDS = {
    "left_angle": "the left wheel's angle", "right_angle": "the right wheel's angle", "x": "x", "y": "y",
    "heading": "heading", "battery": "the battery's voltage", "yaw_rate": "the turning rate",
    "reflection": "the colour sensor",
}  # fmt: skip
_CHANNELS = {column: column.rsplit("_", 1)[0] for column in COLUMNS}
_UNITS = {"m": (1e3, "mm"), "deg": (1.0, "deg"), "dps": (1.0, "deg/s"), "v": (1.0, "V"), "pct": (1.0, "%")}
FAILS = "The test fails: on held-out recordings the error is larger with what was found than without it."
MOST_NAMED = 3  # causes in a headline; the list has all


def words(verdict: Verdict) -> list[str]:
    """Return a verdict, and what the recordings could have shown, in paragraphs of a sentence or two."""
    return [*sentences(verdict), *limits(verdict)]


def sentences(verdict: Verdict) -> list[str]:
    """Return a verdict in paragraphs of a sentence or two; a failed test comes first."""
    out = [title(verdict)]
    if verdict.found:
        out.append(failure(verdict) if verdict.judgement.failed else _proof(verdict))
    out += [_effect(found, verdict) for found in verdict.effects]
    out += [law_sentence(law) for law in verdict.invented]
    if verdict.minor:
        named = "; ".join(
            f"{BY_ID[m.id].title} ({m.id}), which {does(m.size, verdict)}" for m in verdict.minor
        )
        out.append(f"Visible, but too small to be named; possibly: {named}.")
    if verdict.found and not verdict.residual.material and not verdict.judgement.failed:
        out.append(
            f"The remaining error {does(verdict.residual.size, verdict)}, which is {_no_more(verdict)}."
        )
    if verdict.residual.material or verdict.verdict.endswith("unexplained"):
        out.append(unexplained(verdict))
    if verdict.located:
        out.append(
            "Where simulation and reality differ: " + "; ".join(_place(p) for p in verdict.located[:3]) + "."
        )
    out += list(verdict.notes)
    out.append(f"Next recording: {verdict.next_recording.why}.")
    return out


def title(verdict: Verdict) -> str:
    """Say in one sentence what is missing; if the test failed, say that first."""
    if verdict.judgement.failed:
        found = " and ".join([*([_names(verdict)] if verdict.effects else []), *_laws(verdict)])
        if verdict.verdict == "missing_and_unexplained":
            return f"{FAILS} Something unknown acts in these, too. Found beside it: {found}."
        return f"{FAILS} Found, but not reliable: {found}."
    return _headline(verdict)


def failure(verdict: Verdict) -> str:
    """Say by how much the error of the robot found exceeds that of the robot before."""
    worse = [
        _was_now(verdict, column, misfit, short=True)
        for column, misfit in verdict.judgement.channels.items()
        if misfit.is_worse
    ]
    return f"Errors on {set_aside(verdict)}, root mean square, with what was found and without: {', '.join(worse)}."


def set_aside(verdict: Verdict) -> str:
    """Name the held-out recordings."""
    judged = verdict.judgement
    if judged.by_time:
        return "the held-out part"
    return f"recordings not used for the fit ({judged.named})"


def _names(verdict: Verdict) -> str:
    """Name what was found, three causes at most; the strongest come first."""
    titles = [BY_ID[f.id].title for f in sorted(verdict.effects, key=lambda f: -f.holdout_gain)]
    named, more = titles[:MOST_NAMED], len(titles) - MOST_NAMED
    if more > 0:
        named.append(f"{more} smaller {'causes' if more > 1 else 'cause'}")
    return " and ".join(named) if len(named) < MOST_NAMED else f"{', '.join(named[:-1])}, and {named[-1]}"


def _laws(verdict: Verdict) -> list[str]:
    """Name the laws that were written, each once."""
    return list(dict.fromkeys(law.looks_like for law in verdict.invented))


def _headline(verdict: Verdict) -> str:
    names, laws = _names(verdict), " and ".join(_laws(verdict))
    return {
        "nothing": _nothing(verdict),
        "missing": f"Missing in the simulation: {names}.",
        "invented": f"Missing in the simulation, and not in the catalogue: {laws}.",
        "missing_and_invented": f"Missing in the simulation: {names}; and, not in the catalogue, {laws}.",
        "unexplained": "Something is missing, and no effect of the catalogue explains it.",
        "missing_and_unexplained": (
            f"Missing in the simulation: {names}; and something that no effect of the catalogue explains."
        ),
    }[verdict.verdict]


def _nothing(verdict: Verdict) -> str:
    left = verdict.residual
    if left.white:
        return "Nothing is missing: the simulation matches these recordings to within the sensors' noise."
    size = does(left.size, verdict)
    within = f", {_no_more(verdict)}" if _is_above_material(verdict) else ""
    return f"Nothing material is missing: the remaining error {size}{within}."


def _no_more(verdict: Verdict) -> str:
    """Say why what is left asks for no further physics: it is small, or as little as known things are off by."""
    if not _is_above_material(verdict):
        return "not material"
    laws = "the simulation's laws and " if verdict.found else ""
    return f"no more than {laws}several small imperfections together may be off by"


def _is_above_material(verdict: Verdict) -> bool:
    """Whether what is left is more than the smallest material size."""
    evidence = verdict.evidence
    return evidence is not None and bool(evidence.motion.problem.material.times(verdict.residual.size) > 1.0)


def moves(size: Size, verdict: Verdict) -> str:
    """Say a size: over a metre, over a whole recording, in a reading, at the arrival."""
    words = []
    if size.mm_1m or size.deg_1m:
        turned = (
            ("", "")
            if on_bench(verdict)
            else (f" and {size.deg_1m:.1f} degrees", f" and {size.deg_drive:.1f} degrees")
        )  # a wheel on a bench turns no robot
        words.append(
            f"{size.mm_1m:.1f} mm{turned[0]} over a metre ({size.mm_drive:.0f} mm{turned[1]} over a whole recording)"
        )
    if size.reading_pct:
        words.append(f"{size.reading_pct:.1f} % of a reading")
    if size.arrival_s is not None:
        words.append(f"{size.arrival_s:.2f} s of arrival")
    return " and ".join(words) or "nothing that can be measured"


def does(size: Size, verdict: Verdict) -> str:
    """Say what an effect of a size does: it moves a robot or a wheel, or changes readings."""
    if size.reading_pct and not size.mm_1m and not size.deg_1m:
        return f"changes readings by {size.reading_pct:.1f} %"
    return f"moves the {'wheel' if on_bench(verdict) else 'robot'} by {moves(size, verdict)}"


def on_bench(verdict: Verdict) -> bool:
    """Whether all recordings are of motors on a bench."""
    return verdict.evidence is not None and bool(verdict.evidence.motion.problem.on_bench)


def limits(verdict: Verdict) -> list[str]:
    """Say which sizes would have been found, and which effects these recordings cannot show, a sentence each."""
    seen = [f"{e} {_above_limit(e, each, verdict)}" for e, each in verdict.limits.items() if each]
    unseen = [e for e, each in verdict.limits.items() if not each]
    out = []
    if seen:
        out.append(f"Not found; in 95 of 100 cases these sizes would have been: {', '.join(seen)}.")
    if unseen:
        out.append(f"These recordings cannot show: {', '.join(unseen)}.")
    return out


def _above_limit(effect: str, limit: Limit, verdict: Verdict) -> str:
    """Say from what size on an effect shows; a limit or rate vanishes at infinity and shows below."""
    parameter = BY_ID[effect].parameters[0]
    if verdict.evidence is not None and not math.isinf(parameter.neutral or 0.0):
        return f"from {smallest(parameter, limit.size, verdict.evidence.before)}"
    unit = "" if limit.unit == "-" else f" {limit.unit}"
    return f"{'below' if math.isinf(parameter.neutral or 0.0) else 'from'} {limit.size:.2g}{unit}"


def _effect(found: Found, verdict: Verdict) -> str:
    effect = BY_ID[found.id]
    sizes = ", ".join(sizes_of(found, verdict))
    words = (
        f"{effect.title[0].upper()}{effect.title[1:]} ({effect.id}): {sizes}. It shows in {effect.signature}. "
        f"It {does(found.size, verdict)}."
    )
    if found.alternatives:
        words += f" These recordings cannot distinguish it from {' or '.join(found.alternatives)}."
    return words


def sizes_of(found: Found | Minor, verdict: Verdict) -> list[str]:
    """Return an effect's parameters, in practical units where the robot before is known."""
    if verdict.evidence is None:
        return [f"{label} {_interval(i)}" for label, i in found.parameters.items()]
    return [str(q) for q in quantities(found.id, found.parameters, verdict.evidence.before)]


def _interval(i: Interval) -> str:
    unit = "" if i.unit == "-" else f" {i.unit}"
    return f"{i.value:.3g}{unit} ({i.low:.3g} to {i.high:.3g})"


def _proof(verdict: Verdict) -> str:
    gaps = {
        name: m
        for name, m in verdict.judgement.channels.items()
        if max(m.before, m.after) > VISIBLE * m.floor
    }
    where = set_aside(verdict)
    if not verdict.judgement.shows:
        return f"What was found does not show in {where}."
    if not gaps:
        return f"Judged on {where}, where every channel shows only noise."
    closed = verdict.judgement.gap_closed
    share = "" if closed is None or closed < 0.0 else f" {closed:.0%} of the gap is closed:"
    return (
        f"On {where}, root mean square:{share} {'; '.join(_was_now(verdict, c, m) for c, m in gaps.items())}."
    )


def _was_now(verdict: Verdict, column: str, misfit: Misfit, short: bool = False) -> str:
    """Say the error of a column before and now, and that of noise alone."""
    name = CHANNEL_WORDS[_CHANNELS[column]]
    was, now, noise = in_units(column, misfit)
    if short:
        return f"{name} off by {now} instead of {was}"
    rolled = ""
    if column.endswith("angle_deg") and not math.isnan(misfit.deviation):
        mm = math.radians(misfit.deviation) * 1e3 * verdict.robot.body.wheel_radius
        rolled = f", rolled {amount(mm * misfit.before, 'mm')} → {amount(mm * misfit.after, 'mm')}"
    worse = ", worse" if misfit.is_worse else ""
    return f"{name} off by {was} → {now}{rolled}{worse} (noise alone {noise})"


def in_units(column: str, misfit: Misfit) -> tuple[str, str, str]:
    """Return the error of a column before and now, and that of noise alone, root mean square."""
    if math.isnan(misfit.deviation):
        return f"{misfit.before:.3f}", f"{misfit.after:.3f}", f"{misfit.floor:.3f}"
    factor, unit = _UNITS[column.rsplit("_", 1)[1]]
    scale = factor * misfit.deviation
    return (
        amount(scale * misfit.before, unit),
        amount(scale * misfit.after, unit),
        amount(scale * misfit.floor, unit),
    )


def unexplained(verdict: Verdict) -> str:
    """Describe the error that no effect explains."""
    shown = verdict.located[0] if verdict.located else None
    words = f"No effect explains the remaining error: it {does(verdict.residual.size, verdict)}."
    if shown is not None:
        words += f" It is largest in {CHANNEL_WORDS.get(shown.channel, shown.channel)}, {shown.regime}."
    if verdict.residual.formula:
        words += f" A formula describes it, without giving a cause: {verdict.residual.formula}."
    if verdict.residual.described:
        gains = ", ".join(f"{c} {_change(m)}" for c, m in verdict.residual.described.items())
        words += f" Added to the replays, it changes the NRMSE on the held-out recordings from {gains}."
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
