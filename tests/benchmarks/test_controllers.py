"""The benchmark of Grammatical Evolution beside other methods: their programs, and that they keep to the budget."""

import numpy as np
import pytest

from benchmarks import controllers
from gecar.language.program import parse_program
from gecar.results.config import configure
from gecar.results.run import load_task


class Counting(controllers.Contest):
    """Counts what it is asked for; the smallest sum of a program's numbers wins."""

    def __init__(self, task) -> None:
        super().__init__(task)
        self.texts: list[str] = []
        made.append(self)

    def __call__(self, texts):
        self.texts += texts
        return np.array([np.abs(parse_program(text).opcodes).sum() for text in texts], float)

    def winner(self):
        return min(map(parse_program, self.texts), key=lambda program: np.abs(program.opcodes).sum())


made: list[Counting] = []


def test_numbers_become_the_programs_they_say() -> None:
    text = controllers.if_else((80.4, 70, 90, 0, 40, -90, 20))
    assert text == "if(SensorValue > 80):\n    motor(70,90,0)\nelse:\n    motor(40,-90,20)"
    assert parse_program(controllers.linear((60, 0.5, 60, -0.5, 50, 10)))
    assert all(map(parse_program, controllers.BY_HAND))


@pytest.mark.parametrize(
    "method", [name for name in controllers.METHODS if name.startswith(("CMA", "random"))]
)
def test_every_method_spends_its_budget_and_no_more(method: str, monkeypatch) -> None:
    if method.startswith("CMA"):
        pytest.importorskip("cma", reason="needs pip install 'gecar[bench]'")
    monkeypatch.setattr(controllers, "Contest", Counting)
    _, find = controllers.METHODS[method]
    task = load_task(configure({"preset": "better", "seed": 5}))
    assert find(task, 57) == find(task, 57)
    assert len(made[-1].texts) == len(made[-2].texts) == 57


def test_a_program_met_again_is_scored_from_all_its_drives() -> None:
    task = load_task(configure({"preset": "better", "seed": 1}))
    contest = controllers.Contest(task)
    text = "if(SensorValue > 65):\n    motor(50,50,10)\nelse:\n    motor(50,-60,90)"
    text = "if(SensorValue > 60):\n    motor(40,50,10)\nelse:\n    motor(40,-70,100)\n" + text
    for drives in (15, 30):
        (value,) = contest([text])
        assert 25 < value < 27
        assert np.count_nonzero(~np.isnan(contest.known[text][1]["drawn_s"])) == drives


def test_methods_are_compared_run_by_run_over_all_courses() -> None:
    def results(*times):
        return [{"median_s": time, "share": 0.0 if time is None else 1.0} for time in times]

    found = {(course, name): results(10.0, 20.0, None) for course in "ab" for name in controllers.METHODS}
    slower = "random search, an if/else's 7 numbers"
    found["a", slower], found["b", slower] = results(11.0, 26.0, None), results(12.0, None, None)
    (line,) = [line for line in controllers.paired(found, "ab") if line[0] == slower]
    assert line[1:4] == ["4", "6", "1.20"]
    assert float(line[4]) > 0.05  # six pairs, corrected for six tests
