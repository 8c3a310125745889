import contextlib
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.courses import course_text, make_course

from gecar.errors import InputError
from gecar.world.course.course import load_course, parse_course
from gecar.world.course.new_course import new_course
from gecar.world.course.tiles import TILES

BOX = "[[obstacles]]\nkind = 'box'\nat_m = [0.45, 0.45]\nsize_m = [0.1, 0.1]\n"


def refusal(text: str) -> str:
    with pytest.raises(InputError) as error:
        parse_course(text, "c.toml")
    message = str(error.value)
    assert message.startswith("c.toml")
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ({"tiles": "F-7\n|q|\nL-J"}, "map line 2, column 2: found unknown tile 'q'"),
        ({"tiles": "F-7\n|#\nL-J"}, "map line 2: found 2 tiles, expected 3, as in line 1"),
        ({"tiles": ""}, "map: found no tiles"),
        ({"tiles": "." * 2000}, "map: found 2000 x 1 tiles, expected at most 1024"),
        ({"more": "tile_size_m = -0.3"}, "tile_size_m: found -0.3, expected greater than or equal to 0.02"),
        ({"more": "tile_size_m = nan"}, "tile_size_m: found nan, expected a finite number"),
        ({"more": "tile_size_m = '0.3'"}, "tile_size_m: found '0.3', expected a valid number"),
        ({"more": "tile_size_m = true"}, "tile_size_m: found True"),
        ({"more": "tile_size_m = 4"}, "field of 12 x 12 m, expected at most 50 square metres"),
        ({"more": "field_m = [1.0, 0.9]"}, "field_m: found 1 x 0.9 m, expected 1 x 1 m: 3 x 3 square tiles"),
        ({"more": "line_width_m = 0.2"}, "line_width_m: found 0.2, expected at most half a tile"),
        ({"more": "line_width_m = inf"}, "line_width_m"),
        ({"more": "colour = 1"}, "colour: found an unknown field"),
        ({"heading": '"north"'}, "start.heading"),
        ({"heading": "nan"}, "start.heading"),
        ({"start": "[0]"}, "start.tile"),
        ({"start": "[[0, 1], [0, 2]]"}, "start.tile"),
        ({"start_more": "left_m = 0.2"}, r"start: found \(-0.05, 0.45\) m, outside its tile"),
        ({"start_more": "left_m = nan"}, "start.left_m: found nan"),
        ({"start": "[-1, 0]"}, r"start.tile\[0\]: found -1"),
        ({"goal": "'top'"}, "goal: found 'top'"),
        ({"start_more": BOX.replace("0.45, 0.45", "0.86, 0.45")}, "obstacles[0]: found a box that reaches outside"),
        ({"start_more": BOX.replace("0.45, 0.45", "0.15, 0.45")}, "obstacles[0]: found a box on START"),
        ({"start_more": BOX + "mass_kg = -1.0"}, "obstacles[0].mass_kg: found -1.0, expected greater than 0"),
        ({"start_more": BOX + "diameter_m = 0.1"}, "obstacles[0]: found a box without size_m or with diameter_m"),
        ({"start_more": BOX.replace("box", "disc")}, "obstacles[0]: found a disc without diameter_m"),
        ({"start_more": BOX.replace("box", "cone")}, "obstacles[0].kind: found 'cone'"),
        ({"start_more": BOX.replace("0.1, 0.1", "0.1, 0")}, "obstacles[0].size_m[1]"),
        ({"start_more": "[[walls]]\nfrom_m = [0.1, 0.1]\nto_m = [0.1, 0.1]"}, "walls[0]: found a wall from a point"),
        ({"start_more": "[[walls]]\nfrom_m = [0.1, 0.1]\nto_m = [9.1, 0.1]"}, "walls[0]: found a wall that reaches"),
        ({"start_more": "[image]\nfile = 'no.png'\npixels_per_metre = 100"}, "image: found no file"),
        ({"start_more": "[image]\nfile = 'no.png'\npixels_per_metre = 0"}, "image.pixels_per_metre: found 0"),
        ({"start_more": "[image]\nfile = 'a'\npixels_per_metre = 9\nwhite = 3\nblack = 9"}, "image: found white 3"),
    ],
)  # fmt: skip
def test_bad_fields_are_named_in_one_line(case, message):
    found = refusal(course_text(**case))
    assert message.replace("\\", "") in found or re.search(message, found), found


def test_a_second_start_is_refused():
    assert "line" in refusal(course_text() + "\n[start]\ntile = [0, 1]\n")


def test_missing_goal_and_start_are_named():
    assert refusal(course_text().replace("goal", "# goal")) == "c.toml, goal: found nothing, expected a value"
    assert refusal("map = '--'\ngoal = [0, 0]").startswith("c.toml, start: found nothing")


@pytest.mark.parametrize(
    "text", ["map = [", "a = " + "[" * 5000, "n = " + "9" * 5000, "\x00", "map = 2020-13-45"]
)
def test_what_is_not_toml_is_refused(text):
    assert "not TOML" in refusal(text)


def test_missing_files_and_names_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"'nowhere', expected a course file .* paper"):
        load_course("nowhere")
    with pytest.raises(InputError, match="no such file"):
        load_course(tmp_path / "nowhere.toml")
    (tmp_path / "huge.toml").write_bytes(b"#" * 2_000_000)
    with pytest.raises(InputError, match="2000000 bytes"):
        load_course(tmp_path / "huge.toml")


def test_the_fields_size_gives_the_tiles():
    assert make_course(more="field_m = [0.6, 0.6]").tile_size_m == pytest.approx(0.2)


def test_a_new_course_can_be_loaded_and_is_never_overwritten(tmp_path):
    path = tmp_path / "mine" / "my_course.toml"
    new_course(path, 5, 3)
    course = load_course(path)
    assert (course.columns, course.rows, course.title) == (5, 3, "my course")
    with pytest.raises(InputError, match="exists"):
        new_course(path)


@pytest.mark.parametrize(
    ("size", "found"), [((1, 3), "1 x 3"), ((10**9, 10**9), "tiles"), ((4, -2), "4 x -2")]
)
def test_new_courses_have_sensible_sizes(tmp_path, size, found):
    with pytest.raises(InputError, match=found):
        new_course(tmp_path / "c.toml", *size)


characters = st.sampled_from([tile.character for tile in TILES])
maps = st.integers(1, 5).flatmap(
    lambda n: st.lists(st.text(characters, min_size=n, max_size=n), min_size=1, max_size=4).map("\n".join)
)
tile = st.tuples(st.integers(0, 4), st.integers(0, 3)).map(list)


@settings(deadline=None, max_examples=150)
@given(
    maps, tile, tile, st.sampled_from(["up", "down", "left", "right"]), st.none() | st.lists(tile, max_size=4)
)
def test_random_courses_drive_or_are_refused(tiles, start, goal, heading, checkpoints):
    more = "" if checkpoints is None else f"checkpoints = {checkpoints}"
    try:
        course = make_course(tiles, str(start), str(goal), f'"{heading}"', more)
    except InputError:
        return
    assert course.raster(0.01).shape == (30 * course.rows, 30 * course.columns)
    assert 0.0 <= course.shortest.length_m < 50.0
    assert course.drivable[course.sequence].all()


values = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.lists(st.floats(), max_size=3),
)


@settings(deadline=None, max_examples=100)
@given(
    st.dictionaries(st.sampled_from(["map", "goal", "start", "walls", "obstacles", "image", "notes"]), values)
)
def test_random_tables_are_refused_or_valid(fields):
    from gecar.world.course.schema import validate

    good = {"map": "--", "goal": [1, 0], "start": {"tile": [0, 0], "heading": "right"}}
    with contextlib.suppress(InputError):
        validate({**good, **fields}, "c.toml")


@settings(deadline=None, max_examples=60)
@given(st.text(max_size=60))
def test_random_text_is_refused_in_one_line(text):
    refusal(text.replace("\r", ""))
