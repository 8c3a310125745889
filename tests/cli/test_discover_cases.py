"""Several cases in one command: the same verdicts wherever they are looked at, and no failure costs another case."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from support.command import Command
from support.concealing import EV3, recorded

from gecar.reality.recordings.recording import write_recording


def cases_on_a_bench(folder: Path) -> list[Path]:
    """Two small cases: nothing missing; a stronger right motor."""
    robots = {"plain": EV3, "uneven": EV3.with_effects({"motor_gain_asymmetry": {"right_minus_left": 0.1}})}
    for name, robot in robots.items():
        (folder / name).mkdir(parents=True)
        for seed in range(2):
            write_recording(recorded(robot, seed, 3.0, "bench"), folder / name / f"run_{seed}.csv")
    return [folder / name for name in robots]


@pytest.mark.parametrize("executor", ["process", "dask"])
def test_cases_side_by_side_end_as_each_alone_and_a_failing_one_is_named(
    executor: str, gecar: Command, tmp_path: Path
) -> None:
    if executor == "dask":
        pytest.importorskip("distributed", reason="pip install 'gecar[cluster]'")
    cases = cases_on_a_bench(tmp_path / "cases")
    for case in cases:
        assert gecar("discover", case, "--out", f"alone/{case.name}", "--no-pictures").code == 0
    bad = tmp_path / "cases" / "bad"
    shutil.copytree(cases[0], bad)
    for recording in bad.glob("*.toml"):
        recording.write_text(recording.read_text().replace('robot = "ev3"', 'robot = "nobody"'))
    place = ("--executor", executor, "--workers", 2)
    ended = gecar("discover", bad, *cases, *place, "--no-pictures", "--json")
    assert ended.code == 2
    assert ended.err.splitlines()[-1].startswith("error: bad: --robot: found 'nobody'")
    assert ended.json["uneven"]["verdict"] == "missing"
    assert set(ended.json["bad"]) == {"error"}
    for case in cases:
        for name in ("verdict.json", "robot.toml"):
            assert (
                Path("verdict", case.name, name).read_bytes() == Path("alone", case.name, name).read_bytes()
            )


def test_cases_that_can_not_be_told_apart_or_read_are_refused_at_once(gecar: Command, tmp_path: Path) -> None:
    cases = cases_on_a_bench(tmp_path / "cases")
    other = cases_on_a_bench(tmp_path / "others")[0]
    assert f"found {cases[0]} and {other}, expected different names" in gecar.error("discover", *cases, other)
    assert "no such folder" in gecar.error("discover", *cases, "nowhere")
    assert not Path("verdict").exists()
