import numpy as np
import pytest
from PIL import Image

from gecar.language.program import parse_program
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

PUSHES = "if(SensorValue > 5):\n    motor(100,95,30)\nelse:\n    motor(40,-30,60)\n"
LEAVES = "motor(80,80,100)\n"


@pytest.fixture
def program(tmp_path):
    (tmp_path / "best.txt").write_text(LEAVES)
    return "best.txt"


def test_a_drive_is_told_in_words_and_drawn(gecar, program, tmp_path):
    ended = gecar("simulate", program)
    assert ended.code == 0
    assert "The robot left the course after" in ended.out
    assert "lower bound" in ended.out
    with Image.open(tmp_path / "trajectory.png") as picture:
        assert min(picture.size) > 800


def test_json_is_one_object_and_words_go_to_stderr(gecar, program, tmp_path):
    ended = gecar("simulate", program, "--no-picture", "--json")
    assert ended.json["outcome"] == "off_course"
    assert ended.json["lower_bound_s"] > 5
    assert ended.json["arrival_s"][-1] is None
    assert "left the course" in ended.err
    assert not (tmp_path / "trajectory.png").exists()


def test_noise_depends_on_its_seed_alone(gecar, tmp_path):
    (tmp_path / "best.txt").write_text(PUSHES)
    words = ("simulate", "best.txt", "--no-picture", "--json", "--noise", 5, "--motor-noise", 5, "--seed")
    first, again, other = (gecar(*words, seed).json["time_s"] for seed in (1, 1, 3))
    assert first == again != other


def test_pictures_go_where_they_are_wanted(gecar, program, tmp_path):
    ended = gecar("simulate", program, "--out", "new/folder", "--picture", "drive.svg", "--json")
    assert ended.json["picture"] == "new/folder/drive.svg"
    assert (tmp_path / "new/folder/drive.svg").read_text().startswith("<?xml")


def test_a_folder_stands_for_its_best_program(gecar, program):
    assert gecar("simulate", ".", "--no-picture", "--json").json["program"] == LEAVES.strip()


def test_a_trace_does_not_change_the_drive():
    world = World(load_robot("ev3"), load_course("obstacles"))
    opcodes = parse_program(PUSHES).opcodes
    one, other = simulate(world, opcodes), simulate(world, opcodes, trace=True)
    assert (one.outcome, one.steps, one.checkpoints) == (other.outcome, other.steps, other.checkpoints)
    assert np.array_equal(one.arrival_s, other.arrival_s, equal_nan=True)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("nowhere.txt",), "nowhere.txt"),
        (("best.txt", "--course", "nowhere"), "nowhere"),
        (("best.txt", "--robot", "nobody"), "nobody"),
        (("best.txt", "--noise", "-1"), "noise"),
        (("best.txt", "--noise", "nan"), "noise"),
        (("best.txt", "--time-limit", "0"), "time limit"),
        (("best.txt", "--engine", "steam"), "steam"),
        (("best.txt", "--seed", "-1"), "--seed"),
        (("best.txt", "--colour", "green"), "green"),
        (("best.txt", "--picture", "x.bmp2"), "x.bmp2"),
        (("best.txt", "--no-picture", "--animate", "x.webm"), "x.webm"),
        (("broken.txt",), "broken.txt, line 1"),
        (("empty",), "best.txt"),
        (("best.txt", "--out", "best.txt/below"), "best.txt"),
    ],
)
def test_bad_input_is_one_line(gecar, program, tmp_path, words, named):
    (tmp_path / "broken.txt").write_text("motor(80,80\n")
    (tmp_path / "empty").mkdir()
    assert named in gecar.error("simulate", *words)
