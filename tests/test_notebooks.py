"""The notebooks of the documents: their code runs, and what they show came from running it."""

import json
from pathlib import Path

import pytest

from gecar.notebook import html

NOTEBOOKS = sorted(Path(__file__).parents[1].glob("docs/notebooks/*.ipynb"))


def cells(path):
    return [
        cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"
    ]


@pytest.fixture(scope="module", params=NOTEBOOKS, ids=lambda path: path.stem)
def run(request):
    names: dict = {}
    for cell in cells(request.param):
        exec(compile("".join(cell["source"]), request.param.name, "exec"), names)
    return request.param.stem, names


def test_the_code_runs_and_shows_what_the_text_says(run):
    name, names = run
    if name == "study":
        of_draws = {
            draws: [r.simulation.arrives["share"] for r in found] for draws, found in names["runs"].items()
        }
        assert max(of_draws[4]) > max(of_draws[1])
        assert "<img" in html(names["best"])
    else:
        assert {"backlash", "viscous_friction"} <= {found.id for found in names["verdict"].effects}
        assert "Missing in the simulation" in html(names["verdict"])


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_there_whole_and_small(path):
    outputs = [output for cell in cells(path) for output in cell["outputs"]]
    assert outputs
    assert not [output for output in outputs if output["output_type"] == "error"]
    assert [cell["execution_count"] for cell in cells(path)] == list(range(1, len(cells(path)) + 1))
    assert path.stat().st_size < 600_000
