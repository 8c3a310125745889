"""The classroom page: what it holds, and in a headless Chromium, what it does."""

import html
import json
import re

import pytest
from PIL import Image
from support.browser import PRESSES, in_chromium, opened
from support.trials import ARRIVES

from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.plots.drives.classroom import drive_json, write_classroom_page
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

WORLD, PROGRAM = World(load_robot("ev3"), load_course("paper"), time_limit_s=4.0), parse_program(ARRIVES)


@pytest.fixture(scope="module")
def drive():
    return simulate(WORLD, PROGRAM.opcodes, trace=True)


@pytest.fixture(scope="module")
def page(drive, tmp_path_factory):
    return write_classroom_page(
        WORLD, PROGRAM, drive, tmp_path_factory.mktemp("page") / "drive.html", "A <drive>"
    )


def lit(dom):
    """Return the number of the program's line that is lit."""
    lines = re.findall(r"<li[^>]*>", dom)
    return 1 + next(k for k, line in enumerate(lines) if "aria-current" in line)


def test_the_page_loads_nothing_from_anywhere(page):
    text = page.read_text()
    assert not re.findall(r"(?:src|href)\s*=|https?:|@import|url\(", re.sub(r"picture\.src = ", "", text))
    assert "default-src 'none'" in text


def test_words_can_not_become_markup(drive, tmp_path):
    evil = parse_program(ARRIVES)
    text = write_classroom_page(WORLD, evil, drive, tmp_path / "x.html", "</script><b>").read_text()
    assert "</script><b>" not in text
    assert html.escape("</script><b>") in text
    inside = re.search(r'id="drive">(.*?)</script>', text, re.DOTALL).group(1)
    assert "<" not in inside
    assert json.loads(inside)["lines"] == ARRIVES.splitlines()


def test_series_are_as_long_as_the_drive(drive):
    held = drive_json(WORLD, PROGRAM, drive)
    assert {len(series) for series in held["trace"].values()} == {len(drive.trace["t_s"])}
    assert held["trace"]["line"] == drive.trace["line"].astype(int).tolist()
    assert held["arrivals_of"] == 18


def test_obstacles_stand_where_the_course_has_them():
    world = World(load_robot("ev3"), load_course("obstacles"), time_limit_s=0.5)
    held = drive_json(world, PROGRAM, simulate(world, PROGRAM.opcodes, trace=True))
    for thing, pose in zip(held["course"]["obstacles"], held["obstacles"][0], strict=True):
        assert thing["pose"] == pytest.approx(pose, abs=1e-3)


def test_a_drive_without_trace_is_refused():
    with pytest.raises(InputError, match="no trace"):
        drive_json(WORLD, PROGRAM, simulate(WORLD, PROGRAM.opcodes))


@in_chromium
def test_the_line_that_drives_is_lit(page, drive, tmp_path):
    dom = opened(page, tmp_path, "--dump-dom", after="#t=0.4")
    assert 'data-time="0.40"' in dom
    assert lit(dom) == drive.trace["line"][40]


@in_chromium
def test_it_plays(page, tmp_path):
    for budget in (3000, 10_000, 30_000):  # a busy machine draws few frames
        dom = opened(page, tmp_path, "--dump-dom", after="#t=3&play", budget=budget)
        if float(re.search('data-time="(.*?)"', dom).group(1)) > 3.0:
            return
    raise AssertionError(f"no frame was played in {budget} ms")


@in_chromium
def test_keys_move_in_time(page, tmp_path):
    keys = [["ArrowRight", True], ["ArrowRight", False], [".", False], ["ArrowLeft", True], [" ", False], [" ", False],
            ["End", False], ["Home", False]]  # fmt: skip
    pressed = page.with_name("pressed.html")
    pressed.write_text(page.read_text().replace("</body>", PRESSES % json.dumps(keys)))
    title = re.search("<title>(.*?)</title>", opened(pressed, tmp_path, "--dump-dom")).group(1)
    assert title == "1.00f 1.10f 1.11f 0.11f 0.11t 0.11f 4.00f 0.00f"


@in_chromium
def test_the_page_looks_like_something(page, tmp_path):
    picture = tmp_path / "page.png"
    opened(page, tmp_path, f"--screenshot={picture}", after="#t=2")
    with Image.open(picture) as shot:
        assert len(shot.convert("RGB").getcolors(1 << 24)) > 50
        assert shot.crop((60, 120, 900, 540)).convert("L").getextrema()[0] < 60  # the line


def test_commands_write_the_page(gecar, tmp_path):
    (tmp_path / "best.txt").write_text(ARRIVES)
    ended = gecar(
        "simulate", "best.txt", "--no-picture", "--time-limit", 2, "--html", "new/drive.html", "--json"
    )
    assert ended.json["page"] == "new/drive.html"
    assert "<canvas" in (tmp_path / "new/drive.html").read_text()
    assert "--html" in gecar.error("plot", "one", "two", "--html")
