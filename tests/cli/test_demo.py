"""The demonstration: two evolutions, drives, a verdict, and one page that tells it all without a network."""

import json
import re
from pathlib import Path

import pytest
from support.browser import in_chromium, opened
from support.command import call

from gecar.cli.actions import demo

# Fewer generations, drives and exercises than the command's own, and the same stages.
QUICK = ("--generations", "2", "--quiet", "--json", "--out", "shown")


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("demo"))
        patch.setattr(demo, "DRIVES", 1)
        patch.setattr(demo, "EXERCISES", ("reversals",))
        assert call("demo", *QUICK) == 0
        yield Path("shown").resolve()


def test_it_finds_what_the_real_robot_conceals(shown):
    found = json.loads((shown / "verdict/verdict.json").read_text())
    assert {"backlash", "viscous_friction"} <= {effect["id"] for effect in found["effects"]}


def test_the_page_tells_the_story_and_loads_nothing(shown):
    page = (shown / "demo.html").read_text(encoding="utf-8")
    assert [page.count(f"<h2>{k}. ") for k in (1, 2, 3, 4)] == [1, 1, 1, 1]
    assert "Predicted" in page
    assert "simulated, too" in page
    assert not re.search(r"(?:src|href)=[\"']?(?:https?:|//|file:)", page)


def test_recordings_and_programs_are_left_to_go_on_with(gecar, shown):
    assert gecar("compare", shown / "recordings/drive_1.csv", "--no-picture").code == 0
    assert (shown / "second/best.txt").is_file()
    assert "exists, expected a new folder" in gecar.error("demo", "--out", shown)


@in_chromium
def test_the_page_opens(shown, tmp_path):
    assert "<canvas" in opened(shown / "demo.html", tmp_path, "--dump-dom")
