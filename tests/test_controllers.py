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
    assert parse_program(controllers.BY_HAND)


@pytest.mark.parametrize("method", [2, 3, 4])
def test_every_method_spends_its_budget_and_no_more(method: int, monkeypatch) -> None:
    if method < 4:
        pytest.importorskip("cma", reason="needs pip install 'gecar[bench]'")
    monkeypatch.setattr(controllers, "Contest", Counting)
    _, find = list(controllers.METHODS.values())[method]
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
