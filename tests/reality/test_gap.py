import csv
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from support.trials import ARRIVES, trial, weak_robot, write_trials

from gecar.language.program import parse_program
from gecar.plots.reality.bench import bench_figure
from gecar.plots.reality.gap import gap_figure, short_names
from gecar.plots.style import is_whole
from gecar.reality.compare.bench import bench_gap
from gecar.reality.compare.gap import Path, arrival_of, gap, nrmse, recorded_path
from gecar.reality.recordings.recording import make_recording, read_case, write_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.replayer import replay
from gecar.report.gap import gap_csv, gap_markdown, mean_and_spread, spread
from gecar.results.arrival import percent
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

COURSE, ROBOT = load_course("paper"), load_robot("ev3")
PROGRAM = parse_program(ARRIVES)


@pytest.fixture(scope="module")
def found():
    trials = [trial(f"trial_{k}", weak_robot(scale), seed=k) for k, scale in ((1, 0.96), (2, 0.95))]
    return gap(trials, ROBOT, COURSE, PROGRAM)


def test_a_recording_of_the_simulation_itself_has_no_gap():
    same = gap([trial("same", ROBOT)], ROBOT, COURSE, PROGRAM, in_course=True).trials[0]
    assert same.arrived
    assert abs(same.error_pct) < 0.2
    assert same.open_loop["left_angle_deg"] < 0.01
    assert same.open_loop["x_m"] < 0.05


def test_a_weak_battery_makes_the_recording_arrive_later(found):
    drive = simulate(World(ROBOT, COURSE), PROGRAM.opcodes)
    assert found.simulated_s == drive.time_s
    for each in found.trials:
        assert each.arrived
        assert each.error_pct == pytest.approx(100 * (each.arrival_s / drive.time_s - 1))
        assert each.error_pct > 1.0


def test_displacement_starts_at_nothing_and_lasts_as_long_as_both(found):
    for each in found.trials:
        assert each.displacement_m[0] == pytest.approx(0.0)
        assert each.t_s[-1] <= min(found.simulated_s, each.arrival_s) + 1e-9
        assert each.correlation[0] > 0.9


@pytest.mark.parametrize(("short_m", "arrived"), [(0.0004, True), (0.002, False)])
def test_a_log_that_ends_as_goal_is_entered_may_be_a_rounding_short_of_it(short_m, arrived):
    trace = simulate(World(ROBOT, COURSE, step_s=0.001), PROGRAM.opcodes, trace=True).trace
    path = Path(*(trace[name].copy() for name in ("t_s", "x_m", "y_m", "heading_rad")))
    path.y_m[-1] = 0.3 - short_m  # GOAL's lower edge is at 0.3 m
    assert arrival_of(path, COURSE) == (path.t_s[-1], arrived, 18)


def test_arrival_is_when_goal_is_entered_after_all_checkpoints():
    drive = simulate(World(ROBOT, COURSE), PROGRAM.opcodes, trace=True)
    path = Path(*(drive.trace[name] for name in ("t_s", "x_m", "y_m", "heading_rad")))
    time, arrived, checkpoints = arrival_of(path, COURSE)
    assert (arrived, checkpoints) == (True, 18)
    assert time == pytest.approx(drive.time_s, abs=0.011)


def test_a_path_that_cuts_a_checkpoint_does_not_arrive():
    start = COURSE.start
    straight_to_goal = Path(
        np.array([0.0, 5.0]), np.full(2, start.x_m), np.array([start.y_m, 0.45]), np.zeros(2)
    )
    assert arrival_of(straight_to_goal, COURSE) == (5.0, False, 0)


def test_a_recording_without_pose_is_reckoned_from_its_wheels():
    posed, blind = (trial("one", ROBOT, posed=posed) for posed in (True, False))
    path, reckoned = recorded_path(blind, ROBOT, COURSE)
    camera, seen = recorded_path(posed, ROBOT, COURSE)
    assert reckoned
    assert not seen
    early = path.t_s < 1.0  # before the first hard turn, where wheels slip
    drift = path.at(path.t_s[early]) - camera.at(path.t_s[early])
    assert np.hypot(*drift.T).max() < 0.005


def test_without_a_program_the_replay_stands_for_the_simulation():
    replayed = gap([trial("one", ROBOT)], ROBOT, COURSE)
    assert replayed.simulated_s is None
    assert "replayed open loop" in gap_markdown(replayed)
    assert is_whole(gap_figure(replayed, "title", "detail"))


def test_nrmse_of_the_mean_is_one():
    measured = np.array([1.0, 2.0, 6.0, np.nan])
    assert nrmse(measured, np.full(4, 3.0)) == pytest.approx(1.0)
    assert np.isnan(nrmse(np.ones(4), np.ones(4)))


def test_tables_hold_every_trial_and_their_spread(found):
    rows = list(csv.DictReader(gap_csv(found).splitlines()))
    assert [row["trial"] for row in rows] == ["trial_1", "trial_2", "mean", "sd"]
    times = [t.arrival_s for t in found.trials]
    assert float(rows[2]["arrival_s"]) == pytest.approx(np.mean(times), rel=1e-5)
    assert spread(found)["arrival_s"]["max"] == max(times)
    assert "| x_m |" in gap_markdown(found)


@pytest.mark.parametrize("count", [1, 7, 30])
def test_a_picture_holds_any_number_of_trials_with_names_as_people_give_them(found, count):
    names = [f"2026-11-22_14-{k:02d}_group-3_line_following_take_{k}" for k in range(count)]
    trials = tuple(replace(found.trials[k % 2], name=name) for k, name in enumerate(names))
    assert is_whole(gap_figure(replace(found, trials=trials), "title", "detail"))


@pytest.mark.parametrize(
    ("names", "short"),
    [
        (["trial_1", "trial_2"], ["trial_1", "trial_2"]),
        (["monday_afternoon_run_1", "monday_afternoon_run_2"], ["1", "2"]),
        (["monday_afternoon_with_line"], ["…oon_with_line"]),
        (["a_very_long_shared_ending", "b_very_long_shared_ending"], ["1", "2"]),
    ],
)
def test_long_names_are_shortened_to_what_tells_them_apart(names, short):
    assert short_names(names) == short


def test_a_picture_of_trials_is_whole(found):
    assert is_whole(gap_figure(found, "title", "detail"))


def test_spread_is_only_given_for_several_values():
    assert mean_and_spread([1.0], 1) == "1.0"
    assert mean_and_spread([1.0, 3.0, float("nan")], 1) == "2.0 ± 1.4"
    assert mean_and_spread([float("nan")], 1) == "-"


def test_compare_writes_tables_and_a_picture(gecar, tmp_path):
    write_trials(tmp_path / "trials", 2)
    ended = gecar("compare", "trials", "--out", "gap", "--json")
    assert ended.code == 0
    assert ended.json["simulation"]["outcome"] == "goal"
    assert [t["trial"] for t in ended.json["trials"]] == ["trial_1", "trial_2"]
    told = ended.json["simulation"]["arrives"]
    assert told["of"] == 200
    assert f" s, {percent(told['share'])} arrive." in ended.err
    assert (tmp_path / "gap/compare.md").read_text().startswith("# Simulation and recordings")
    with Image.open(tmp_path / "gap/compare.png") as picture:
        assert min(picture.size) > 800


def test_a_rehearsed_drive_is_a_recording_without_a_gap(gecar, tmp_path):
    (tmp_path / "best.txt").write_text(ARRIVES)
    gecar("simulate", "best.txt", "--no-picture", "--record", "trials/one.csv")
    ended = gecar("compare", "trials/one.csv", "--no-picture", "--frame", "course", "--json")
    assert ended.json["trials"][0]["arrived"]
    assert ended.json["trials"][0]["largest_displacement_m"] < 0.01


def bench_case(folder, voltage=8.0, levels=(40, 80, 100)):
    """Write steps of a motor that the nominal one would be at another voltage."""
    folder.mkdir()
    strong = ROBOT.model_copy(update={"battery": ROBOT.battery.model_copy(update={"voltage": voltage})})
    for level in levels:
        t = np.arange(0.0, 2.0, 0.01)
        columns = {"t_s": t, "left_duty_pct": np.full(len(t), float(level)), "left_angle_deg": 0.0 * t}
        recording = make_recording(f"step_{level:03d}", columns, Setup(rig="bench", duty_cap=1.0))
        angle = replace(recording, left_angle_rad=replay(recording, strong).left_angle_rad)
        write_recording(angle, folder / f"step_{level:03d}.csv")
    return folder


def test_a_bench_is_compared_shaft_by_shaft(gecar, tmp_path):
    bench_case(tmp_path / "case", ROBOT.battery.voltage * 1.1)
    found = gecar("compare", "case", "--json").json
    assert [row["duty_pct"] for row in found["trials"]] == [40.0, 80.0, 100.0]
    for row in found["trials"]:
        assert row["simulated_speed_dps"] / row["speed_dps"] == pytest.approx(1 / 1.1, abs=0.02)
        assert row["end_deg"] < -50.0
    with Image.open(tmp_path / "compared/compare.png") as picture:
        assert picture.width > 1000
    assert len((tmp_path / "compared/compare.csv").read_text().splitlines()) == 4
    assert "| step_040 | 40 |" in (tmp_path / "compared/compare.md").read_text()


def test_a_bench_of_the_simulated_motor_has_no_gap(tmp_path):
    recordings = read_case(bench_case(tmp_path / "case", ROBOT.battery.voltage)).recordings
    found = bench_gap(recordings, ROBOT)
    assert max(shaft.rms_deg for shaft in found.shafts) < 0.01
    assert is_whole(bench_figure(found, "title", "detail"))


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("nowhere.csv",), "nowhere.csv"),
        (("trials", "--frame", "moon"), "--frame"),
        (("trials", "--program", "nowhere.txt"), "nowhere.txt"),
        (("trials", "--course", "none"), "--course"),
        (("bench.csv",), "shaft's angle"),
        (("bench.csv", "trials"), "some from a bench and some from the floor"),
        (("blind.csv",), "angles"),
    ],
)
def test_bad_input_is_one_line(gecar, tmp_path, words, named):
    write_trials(tmp_path / "trials", 1)
    (tmp_path / "bench.csv").write_text("t_s,left_duty_pct\n0,10\n1,10\n")
    (tmp_path / "bench.toml").write_text('rig = "bench"\n')
    (tmp_path / "blind.csv").write_text("t_s,left_duty_pct,right_duty_pct\n0,10,10\n1,10,10\n")
    assert named in gecar.error("compare", *words, "--no-picture")
