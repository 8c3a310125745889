import pytest
from PIL import Image


def test_list_gives_every_course_with_its_lower_bound(gecar):
    ended = gecar("course", "list", "--json")
    assert {"paper", "hairpin"} <= set(ended.json["courses"])
    assert all(3 < course["lower_bound_s"] < 60 for course in ended.json["courses"].values())
    assert "The paper's course" in ended.err


def test_show_draws_the_tiles_and_a_picture(gecar, tmp_path):
    ended = gecar("course", "show", "paper", "--picture", "paper.png")
    assert "┌──────┐" in ended.out
    assert "lower bound 11.85 s if tyres hold (not proven where they slide); the fastest drive" in ended.out
    with Image.open(tmp_path / "paper.png") as picture:
        assert picture.width > 800


def test_new_writes_a_course_to_begin_with(gecar, tmp_path):
    assert gecar("course", "new", "mine/zig_zag.toml").code == 0
    assert gecar("course", "show", "mine/zig_zag.toml", "--json").json["title"] == "zig zag"
    assert "exists" in gecar.error("course", "new", "mine/zig_zag.toml")


def test_a_random_course_is_written_and_named(gecar, tmp_path):
    assert gecar("course", "new", "mine.toml", "--random", "--seed", "7", "--size", "6x9").code == 0
    shown = gecar("course", "show", "mine.toml", "--json").json
    assert shown["columns"] <= 6
    assert shown["title"] == "Random course 7"
    assert gecar("course", "show", "random:7", "--picture", "7.png").code == 0


def test_print_writes_a_pdf(gecar, tmp_path):
    ended = gecar("course", "print", "paper", "--paper", "sheet", "--json")
    assert ended.json["sheets"] == 1
    assert (tmp_path / ended.json["file"]).read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("show", "nowhere"), "nowhere"),
        (("show", "paper", "--picture", "x.gif"), "x.gif"),
        (("print", "paper", "--paper", "A9"), "A9"),
        (("print", "paper", "--out", "x.png"), "x.png"),
        (("new", "mine.txt"), "mine.txt"),
        (("new", "mine.toml", "--size", "big"), "big"),
        (("new", "mine.toml", "--size", "1x1"), "--size"),
        (("new", "mine.toml", "--tile", "nan"), "nan"),
        (("new", "mine.toml", "--seed", "1"), "--random"),
        (("new", "mine.toml", "--random", "--tiles", "2"), "3 to 24"),
        (("new", "mine.toml", "--random", "--turns", "nan"), "0 to 1"),
        (("list", "--robot", "nobody"), "nobody"),
    ],
)
def test_bad_input_is_one_line(gecar, words, named):
    assert named in gecar.error("course", *words)


def test_effects_are_listed_and_described(gecar):
    assert "backlash in the gears" in gecar("effects").out
    ended = gecar("effects", "backlash", "--json")
    assert ended.json["effects"][0]["parameters"]["angle_deg"]["neutral"] == 0.0
    assert "[effects.backlash]" in ended.err
    assert "gremlins" in gecar.error("effects", "gremlins")
