"""`gecar export` and `gecar import` as typed."""

import pytest
from support.foreign_logs import brick_log, camera_log
from support.synthetic import drive

PROGRAM = "if SensorValue > 80: motor(80,80,50)\nelse: motor(80,0,160)\n"


@pytest.fixture
def program(tmp_path):
    (tmp_path / "best.txt").write_text(PROGRAM)
    return "best.txt"


@pytest.fixture
def logs(tmp_path):
    run = drive(3)
    (tmp_path / "log.csv").write_text(brick_log(run))
    (tmp_path / "camera.csv").write_text(camera_log(run, shift=-20.0))
    return "log.csv", "camera.csv"


def test_export_writes_a_folder_for_the_brick(gecar, program, tmp_path):
    ended = gecar("export", program, "--json")
    assert ended.json["files"] == [
        "brick/main.py",
        "brick/.vscode/launch.json",
        "brick/.vscode/settings.json",
    ]
    assert "        motor(80, 0, 160)\n" in (tmp_path / "brick/main.py").read_text()


def test_export_of_a_run_takes_its_best_program(gecar, program):
    assert "Written: b/main.py" in gecar("export", ".", "--target", "pybricks4", "--out", "b").out
    assert "found a file that is there" in gecar.error("export", ".", "--target", "pybricks4", "--out", "b")
    assert gecar("export", ".", "--target", "pybricks4", "--out", "b", "--force").code == 0


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--target", "nxt"), "'nxt'"),
        (("--sensor", "7"), "'7'"),
        (("--left-motor", "Q"), "'Q'"),
        (("--robot", "nobody"), "nobody"),
    ],
)
def test_export_names_what_is_wrong(gecar, program, options, named):
    assert named in gecar.error("export", program, *options)


def test_import_writes_a_recording_and_says_what_it_took_for_what(gecar, logs, program, tmp_path):
    found = gecar("import", *logs, "--program", program, "--place", "--json").json
    assert found["recording"] == "recordings/log.csv"
    assert found["clock_offset"]["offset_s"] == pytest.approx(20.0, abs=0.003)
    assert "log.csv: 't_s' is t_s, in s (steps of 0.01)" in found["guesses"]
    assert "motor(80,0,160)" in (tmp_path / "recordings/log.toml").read_text()
    again = gecar.error("import", *logs)
    assert "recordings/log.csv: found a file that is there" in again


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--column", "x"), "--column"),
        (("--constant", "left_duty_pct=full"), "'full'"),
        (("--constant", "t_s=1"), "--constant"),
        (("--origin", "1"), "--origin"),
        (("--scale", "-1"), "--scale"),
        (("--offset", "nan"), "--offset"),
        (("--out", "here.txt"), "--out"),
        (("--duty-cap", "120"), "--duty-cap"),
        (("--counts", "0"), "--counts"),
        (("--command", "t_s=1"), "--command"),
        (("--command", "open(1)"), "'open(1)'"),
        (("--course", "none", "--place"), "a course with a START"),
        (("--course", "nowhere"), "nowhere"),
        (("--run", "4"), "--run"),
        (("--program", "none.txt"), "none.txt"),
    ],
)
def test_import_names_what_is_wrong(gecar, logs, options, named):
    assert named in gecar.error("import", *logs, *options)


def test_several_logs_in_one_call_are_several_recordings(gecar, logs, tmp_path):
    (tmp_path / "second.csv").write_text((tmp_path / "log.csv").read_text())
    found = gecar("import", "log.csv", "second.csv", "--out", "case", "--json").json["recordings"]
    assert [each["recording"] for each in found] == ["case/log.csv", "case/second.csv"]
    again = gecar("import", "log.csv", "second.csv", "--out", "case/run.csv", "--json").json["recordings"]
    assert [each["recording"] for each in again] == ["case/run_1.csv", "case/run_2.csv"]


def test_a_camera_for_one_of_two_runs_is_refused(gecar, logs):
    assert "expected a camera's log for each" in gecar.error("import", *logs, "log.csv")
