"""The recording to make next: the one in which two robots part furthest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality.advise.next_recording import LEAST_DIFFERENCE, LIBRARY, difference, suggest
from gecar.reality.advise.notes import never_apart
from gecar.reality.materiality import Size
from gecar.reality.recordings.recording import Recording
from gecar.reality.recordings.split import Split
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.verdict import Found, Limit
from gecar.world.robot import Robot


def seen_on(course: str) -> RecordingResiduals:
    run = recorded(EV3, 1)
    run = replace(run, setup=replace(run.setup, course=course), reflection_pct=np.full(len(run.t_s), 100.0))
    return motion_of([run]).recordings[0]


LIKE = seen_on("paper")


def with_effect(effect: str, label: str, value: float) -> Robot:
    return EV3.with_effects({effect: {label: value}})


LATE, LAGGING = (
    with_effect("sensor_delay", "time_s", 0.04),
    with_effect("sensor_lag", "time_constant_s", 0.04),
)


def parted(like: RecordingResiduals, one: Robot = LATE, other: Robot = LAGGING) -> dict[str, float]:
    return {name: difference(commands, one, other, like) for name, commands in LIBRARY.items()}


def test_sensors_that_differ_are_told_apart_by_crossing_lines() -> None:
    found = (Found("sensor_delay", ("sensor_lag",), {}, 1.0, 1.0, 0.01, Size()),)
    suggested = suggest(LATE, found, [LAGGING], LIKE, unexplained=False)
    differences = parted(LIKE)
    best = max(differences, key=lambda name: differences[name])
    assert differences[best] > 100.0
    assert suggested.why.startswith(f"{best}: distinguishes sensor_delay from sensor_lag")
    assert suggested.commands == LIBRARY[best]


def test_where_no_sequence_tells_two_robots_apart_that_is_said() -> None:
    found = (Found("sensor_delay", ("sensor_lag",), {}, 1.0, 1.0, 0.01, Size()),)
    suggested = suggest(LATE, found, [LAGGING], seen_on("none"), unexplained=False)
    assert "no sequence of the library distinguishes" in suggested.why


@pytest.mark.parametrize(("effect", "value"), [("backlash", 5.0), ("actuation_delay", 0.03)])
def test_motors_that_differ_are_told_apart_without_a_line(effect: str, value: float) -> None:
    label = "angle_deg" if effect == "backlash" else "time_s"
    differences = parted(seen_on("none"), EV3, with_effect(effect, label, value))
    assert max(differences.values()) > 10.0


def test_what_these_recordings_say_nothing_of_is_asked_for() -> None:
    unseen = {"backlash": None, "sensor_delay": None, "track_width": Limit(0.01, "1")}
    suggested = suggest(EV3, (), [], LIKE, unexplained=False, limits=unseen)
    name, why = suggested.why.split(": ")
    assert "backlash" in why
    assert "track_width" not in why
    assert parted(LIKE, EV3, with_effect("backlash", "angle_deg", 1.0))[name] >= LEAST_DIFFERENCE


def test_the_recording_shows_the_effect_one_asks_about() -> None:
    found = (Found("sensor_delay", ("sensor_lag",), {}, 1.0, 1.0, 0.01, Size()),)
    suggested = suggest(LATE, found, [LAGGING], LIKE, unexplained=False, about="floor_tilt")
    assert suggested.why.endswith("would show floor_tilt")
    blind = suggest(EV3, (), [], seen_on("none"), unexplained=False, about="sensor_lag")
    assert "no sequence of the library shows sensor_lag with these sensors" in blind.why


def test_that_motors_may_weaken_each_other_is_said_where_none_was_driven_alone() -> None:
    flat, run = EV3.with_effects({"supply_voltage": {"scale": 0.97}}), recorded(EV3, 1)
    together = replace(run, left_duty=np.full(len(run.t_s), 0.4), right_duty=np.full(len(run.t_s), -0.3))
    (note,) = never_apart(split_of(together), flat)
    assert "driven alone for 0.0 s" in note
    assert "supply_voltage" in note
    assert never_apart(split_of(together), EV3) == []
    apart = replace(together, right_duty=np.where(run.t_s < 1.2, 0.0, -0.3))
    assert never_apart(split_of(apart), flat) == []
    standing = replace(together, left_duty=0.0 * run.t_s, right_duty=0.0 * run.t_s)
    assert never_apart(split_of(standing), flat) != []


def split_of(run: Recording) -> Split:
    return Split((run,), (), by_time=False)
