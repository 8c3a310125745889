"""The wheel holds all that gecar needs, and runs where there is no repository."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DATA = {".toml", ".html", ".bnf", ".png", ".typed", ".pyi"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Build the wheel, and unpack it into a folder of its own."""
    pytest.importorskip("setuptools", minversion="77", reason="builds a wheel without a network")
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in ("gecar", "courses", "grammars", "pyproject.toml", "README.md", "LICENSE"):
        (source / name).symlink_to(ROOT / name)
    build = "import setuptools.build_meta as b, sys; b.build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, str(folder)], cwd=source, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_holds_every_module_and_all_data(installed):
    wanted = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "gecar").rglob("*")
        if path.is_file() and path.suffix in DATA | {".py"}
    }
    wanted |= {
        f"gecar/{path.relative_to(ROOT)}" for path in (ROOT / "courses").iterdir() if path.suffix in DATA
    }
    wanted |= {f"gecar/{path.relative_to(ROOT)}" for path in (ROOT / "grammars").glob("*.bnf")}
    assert wanted <= {str(path.relative_to(installed)) for path in installed.rglob("*") if path.is_file()}


def test_the_wheel_runs_outside_the_repository(installed, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    for words in (("course", "list"), ("grammar", "check", "paper"), ("robot", "show", "ev3"), ("effects",)):
        ended = subprocess.run(
            [sys.executable, "-m", "gecar", *words],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert ended.returncode == 0, ended.stderr
    where = [sys.executable, "-c", "import gecar; print(gecar.__file__)"]
    found = subprocess.run(where, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert str(installed) in found.stdout


def test_check_says_where_it_looked(installed, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    ended = subprocess.run(
        [sys.executable, "-m", "gecar", "check"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2
    assert f"no table at {tmp_path}/benchmarks/fitness_table.toml and {installed}" in ended.stderr
