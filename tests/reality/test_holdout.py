"""What robots are worth on recordings set aside: one measure, and a floor that is known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from support.concealing import EV3
from test_location import seen_on_the_course

from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import hold_out
from gecar.reality.residuals.of_case import motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.world.robot import Robot

WIDE = EV3.with_effects({"track_width": {"scale": 1.05}})
RUNS = [seen_on_the_course(seed, EV3) for seed in (0, 4)]  # the second crosses the line
NOISE = estimate_noise(RUNS, EV3.physics, 1.0)


def contender(robot: Robot, runs: Sequence[Recording] = RUNS) -> Contender:
    return Contender(robot, motion_residuals(runs, NOISE, 1.0, Threads(1)).with_paths(robot.physics))


@pytest.mark.parametrize(
    ("lines", "held"),
    [
        ("01", "0"),
        ("10", "1"),
        ("010", "2"),
        ("001", "1"),
        ("1111", "3"),
        ("0001", "2"),
        ("00100010", "37"),
        ("00010001", "26"),
    ],
)
def test_a_recording_that_reads_the_line_is_fitted_on_where_there_is_one(lines: str, held: str) -> None:
    """``lines`` are recordings in order, 1 where one crosses the line; ``held`` those set aside."""
    runs = tuple(replace(RUNS[int(crossed)], name=str(number)) for number, crossed in enumerate(lines))
    assert "".join(run.name for run in hold_out(Case("made", runs)).held) == held


def test_readings_depend_on_the_path_a_robot_gives() -> None:
    """Else a path that is found for one robot and used for the other would not show below."""
    own, other = (contender(robot).held.recordings[1].readings(WIDE.physics) for robot in (WIDE, EV3))
    assert abs(own - other).max() > 1.0


def test_the_robot_before_and_the_floor_do_not_depend_on_the_robot_after() -> None:
    one, other = (judge(contender(WIDE), contender(after)) for after in (EV3, WIDE))
    assert set(one) == {"left_angle_deg", "right_angle_deg", "x_m", "y_m", "heading_deg", "reflection_pct"}
    for column in one:
        assert one[column].before == other[column].before
        assert one[column].floor == other[column].floor


def test_a_robot_beside_itself_is_as_good_before_as_after() -> None:
    assert all(m.before == m.after for m in judge(contender(WIDE), contender(WIDE)).values())


def test_the_right_robot_reaches_the_floor_of_noise() -> None:
    for misfit in judge(contender(WIDE), contender(EV3)).values():
        assert misfit.after == pytest.approx(misfit.floor, rel=0.5)
        assert misfit.after <= misfit.before * 1.02


def test_the_last_part_of_the_only_recording_is_judged_from_where_the_recording_began() -> None:
    late = hold_out(Case("one", (RUNS[1],))).held
    for misfit in judge(contender(WIDE, late), contender(EV3, late)).values():
        assert misfit.after == pytest.approx(misfit.floor, rel=0.5)
