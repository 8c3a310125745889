"""Small courses for tests."""

from gecar.world.course.course import Course, parse_course

RING = "F-7\n|#|\nL-J"


def course_text(
    tiles: str = RING, start="[0, 1]", goal="[0, 0]", heading='"up"', more="", start_more=""
) -> str:
    """Return a course file; `more` are top-level lines, `start_more` lines of its [start] table."""
    return (
        f"map = '''\n{tiles}\n'''\ngoal = {goal}\n{more}\n"
        f"[start]\ntile = {start}\nheading = {heading}\n{start_more}\n"
    )


def make_course(*args, **kwargs) -> Course:
    """Make a course from the same."""
    return parse_course(course_text(*args, **kwargs), "test.toml")
