import json
from dataclasses import replace

import numpy as np
import pytest

from gecar.errors import InputError
from gecar.parallel.run_parallel import Workplace
from gecar.plots.runs.compare_runs import compare_runs
from gecar.report.paper import latex
from gecar.report.runs import summaries
from gecar.report.table import (
    PAPER_TABLE_5,
    contrasted,
    contrasts_csv,
    csv_text,
    markdown,
    paper_figures,
)
from gecar.results.cells import cells_of, difference_p
from gecar.results.fitness_table import Move
from gecar.results.quantile import median_interval
from gecar.results.statistics import contrast, evaluations_to, holm
from gecar.results.study import Axis, Study, StudyFolder, read_study
from gecar.results.study_runs import perform, perform_all

SMALL = {"workers": 1, "search": {"population": 10, "generations": 1, "codons": 50}}


def study(**changes):
    axes = Axis("elites", (0, 1)), Axis("mutation_rate", (0.1, 0.5))
    return Study({}, SMALL, *axes, **{"seeds": (1, 2)} | changes)


def record(run, time_s):
    return {
        "fitness_s": time_s, "solved": time_s < 1e4, "seed": run.config.seed, "evaluations": 20, "wall_s": 0.5,
        "distinct_evaluations": 7, "simulated_steps": 900, "found_in_generation": 1, "program": "motor(1,1,1)",
        "history": {"generation": [0, 1], "best": [1e4, time_s]}, "configuration": run.configuration,
    }  # fmt: skip


def test_a_plan_holds_every_combination_seed_after_seed():
    plan = study().plan()
    assert [(run.row, run.column, run.config.seed) for run in plan[:5]] == [
        (0, 0.1, 1), (0, 0.5, 1), (1, 0.1, 1), (1, 0.5, 1), (0, 0.1, 2),
    ]  # fmt: skip
    assert plan[1].config.search.mutation_rate == 0.5
    assert plan[1].config.search.population == 10
    assert len({run.file for run in plan}) == len(plan)


def test_anything_a_configuration_holds_may_vary():
    mixed = Study({}, SMALL, Axis("course", ("paper", "hairpin")), Axis("preset", ("paper", "random")), (1,))
    configs = [run.config for run in mixed.plan()]
    assert [config.course for config in configs] == ["paper", "paper", "hairpin", "hairpin"]
    assert [config.search.mutation for config in configs] == ["codon", "renew"] * 2


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"rows": Axis("colour", (1,))}, "colour"),
        ({"rows": Axis("seed", (1,))}, "seed"),
        ({"rows": Axis("elites", ())}, "elites"),
        ({"rows": Axis("elites", (1, 1))}, "once"),
        ({"rows": Axis("elites", (-1,))}, "elites"),
        ({"rows": Axis("mutation_rate", (0.1,))}, "twice"),
        ({"seeds": ()}, "seeds"),
    ],
)
def test_a_grid_that_can_not_be_is_refused(changes, named):
    rows = changes.pop("rows", Axis("elites", (0,)))
    wrong = Study({}, SMALL, rows, Axis("mutation_rate", (0.1,)), **{"seeds": (1,)} | changes)
    with pytest.raises(InputError, match=named):
        wrong.plan()


def test_finished_runs_are_kept_and_not_performed_again(tmp_path):
    folder, runs = StudyFolder(tmp_path / "study"), study(seeds=(1,)).plan()
    folder.begin(study(seeds=(1,)), again=False)
    kept = []
    perform_all(runs[:3], folder, Workplace.of("serial", 1), kept.append)
    assert kept == runs[:3]
    assert [folder.load(run) is None for run in runs] == [False, False, False, True]
    assert read_study(tmp_path / "study") == study(seeds=(1,))


def test_a_run_of_a_study_is_the_run_evolve_makes(gecar, tmp_path):
    run = study().plan()[1]
    words = (
        "--preset",
        "paper",
        "--population",
        10,
        "--generations",
        1,
        "--codons",
        50,
        "--elites",
        0,
        "--mutation-rate",
        0.5,
    )
    gecar("evolve", *words, "--seed", 1, "--workers", 1, "--out", "alone", "--no-pictures", "--quiet")
    alone = json.loads((tmp_path / "alone/result.json").read_text())
    ours = perform(run.config)
    same = set(alone) - {"wall_s"}
    assert {name: ours[name] for name in same} == {name: alone[name] for name in same}


def test_workers_do_not_change_a_study(tmp_path):
    runs, found = study(seeds=(1,)).plan(), []
    for kind, workers in (("serial", 1), ("process", 2)):
        folder = StudyFolder(tmp_path / kind)
        folder.begin(study(), again=False)
        perform_all(runs, folder, Workplace.of(kind, workers), lambda run: None)
        found.append([{**folder.load(run), "wall_s": 0, "history": 0} for run in runs])
    assert found[0] == found[1]


def test_a_damaged_run_is_named(tmp_path):
    folder, run = StudyFolder(tmp_path / "study"), study().plan()[0]
    folder.begin(study(), again=False)
    (folder.runs / run.file).write_text("{}")
    with pytest.raises(InputError, match=run.file):
        folder.load(run)


def test_cells_count_a_run_without_goal_as_slowest():
    runs = study(seeds=(1, 2, 3)).plan()
    times = {1: 20.0, 2: 1e4, 3: 16.0}
    cells = cells_of(runs, [record(run, times[run.config.seed]) for run in runs])
    figures = cells[0].figures()
    assert (figures["runs"], figures["solved"], figures["median_s"], figures["best_s"]) == (3, 2, 20.0, 16.0)
    assert figures["mean_s"] == np.inf
    assert figures["mean_solved_s"] == 18.0
    assert difference_p(study(), cells) is None  # all cells agree


def test_a_setting_that_always_helps_is_told_from_chance():
    runs = study(seeds=tuple(range(8))).plan()
    better = [record(run, 20.0 + run.config.seed - 3.0 * run.row) for run in runs]
    assert difference_p(study(), cells_of(runs, better)) < 0.001


def test_cells_are_contrasted_as_the_field_does():
    runs = study(seeds=tuple(range(8))).plan()
    cells = cells_of(runs, [record(run, 1e4 if run.row else 20.0 + run.config.seed) for run in runs])
    slower, equal = contrast(cells[2], cells[0]), contrast(cells[1], cells[0])
    assert slower.a12 == 0.0  # never at GOAL is slower than any
    assert slower.p == pytest.approx(2 / 2**8)  # each of eight seeds is slower
    assert equal == (1.0, 0.5, True)
    assert "| 1 | 0.1 | 0, 0.1 | 0.00 | 0.023 |" in markdown(study(), cells, {}, "about")
    fewer = replace(cells[2], records=cells[2].records[:7])
    assert not contrast(fewer, cells[0]).paired
    assert contrast(fewer, cells[0]).p < 0.001


def test_seeds_in_pairs_show_what_lies_within_the_spread_of_seeds():
    runs = study(seeds=tuple(range(8))).plan()
    cells = cells_of(runs, [record(run, 20.0 + 5.0 * run.config.seed - 0.5 * run.row) for run in runs])
    test = contrast(cells[2], cells[0])
    assert test.p < 0.01
    assert 0.5 < test.a12 < 0.6


def test_what_is_compared_had_the_same_course():
    mixed = Study({}, SMALL, Axis("course", ("paper", "hairpin")), Axis("elites", (0, 1, 2)), tuple(range(6)))
    runs = mixed.plan()
    slow = [
        record(run, (20.0 if run.row == "paper" else 40.0) + run.config.seed - run.column) for run in runs
    ]
    cells = cells_of(runs, slow)
    compared = contrasted(mixed, cells)
    assert [(each.cell.row, each.first.row, each.first.column) for each in compared] == [
        ("paper", "paper", 0), ("paper", "paper", 0), ("hairpin", "hairpin", 0), ("hairpin", "hairpin", 0),
    ]  # fmt: skip
    assert difference_p(mixed, cells) < 1e-4  # twelve blocks: two courses with six seeds
    courses = Study({}, SMALL, Axis("course", ("paper", "hairpin")), Axis("noise", (0.0, 1.0)), (1, 2))
    runs = courses.plan()
    assert difference_p(courses, cells_of(runs, [record(run, 20.0) for run in runs])) is None
    assert contrasts_csv(mixed, compared).splitlines()[1].startswith("paper,1,paper,0,")


def test_the_table_is_latex_too():
    runs = study(seeds=tuple(range(8))).plan()
    cells = cells_of(runs, [record(run, 20.0 + run.config.seed) for run in runs])
    text = latex(study(), cells, {})
    assert text.startswith("\\begin{tabular}{llrrrrrrrrr}\n\\toprule\nelites & mutation rate & runs &")
    assert "median [s] (95 \\%)" in text
    assert "24.00 (20.00 to 27.00)" in text
    assert text.count(r" \\") == 5


def test_holms_correction_is_that_of_his_paper():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


def test_holms_correction_is_that_of_statsmodels():
    multitest = pytest.importorskip("statsmodels.stats.multitest", reason="needs pip install 'gecar[test]'")
    rng = np.random.default_rng(1)
    for n in (1, 2, 9, 40):
        p = np.round(rng.random(n) ** 3, 2)  # with ties, 0 and 1
        assert holm(p) == pytest.approx(multitest.multipletests(p, method="holm")[1])


def test_an_even_number_of_seeds_has_one_median_in_tables_pictures_and_reports():
    times, runs = (10.0, 20.0, 30.0, 1e4), study(seeds=(1, 2, 3, 4)).plan()
    cell = cells_of(runs, [record(run, times[run.config.seed - 1]) for run in runs])[0]
    results = [{"fitness_s": t, "solved": t < 1e4, "evaluations": 1} for t in times]
    histories = [{"evaluations": np.ones(1), "best": np.array([t])} for t in times]
    drawn = compare_runs({"four": histories}).axes[0].get_lines()[0].get_ydata()
    moved = Move("search", "best_s", list(times), list(times[:3]), matters=True)
    assert cell.figures()["median_s"] == 30.0
    assert summaries(["four"] * 4, results)["four"]["median_s"] == 30.0
    assert drawn[-1] == 30.0
    assert moved.percent == pytest.approx(100.0 * (20.0 - 30.0) / 30.0)


def test_a_medians_interval_holds_it_and_narrows_with_more_runs():
    few, many = np.linspace(14.0, 16.0, 9), np.linspace(14.0, 16.0, 99)
    (low, high), (lower, higher) = median_interval(few), median_interval(many)
    assert low < lower < 15.0 < higher < high
    assert median_interval([1.0, 2.0, 3.0, *[np.inf] * 5]) == (1.0, np.inf)
    assert np.isnan(median_interval([1.0, 2.0, 3.0, 4.0, 5.0])).all()  # one of 94 % is all there is


def test_evaluations_to_a_time_are_those_of_the_first_generation_that_reached_it():
    runs = study().plan()[:4]
    history = {"generation": [0, 1, 2], "best": [30.0, 17.0, 16.0], "evaluations": [10, 20, 30]}
    cells = cells_of(runs, [record(run, 16.0) | {"history": history} for run in runs])
    assert [evaluations_to(cells[0], time_s)[0] for time_s in (30.0, 16.74, 15.0)] == [10, 30, np.inf]


def test_the_table_stands_beside_the_papers():
    paper = Study({}, SMALL)
    runs = paper.plan()
    cells = cells_of(runs, [record(run, 15.0) for run in runs])
    text = markdown(paper, cells, paper_figures(paper, runs), "about")
    assert "| 0.5 | 15.00, - % (22.32) | 15.00, - % (16.74) | 15.00, - % (17.20) |" in text
    assert "| 0.4 | 15.00, - % (-) | 15.00, - % (-) | 15.00, - % (22.51) |" in text
    rows = csv_text(paper, cells, PAPER_TABLE_5).splitlines()
    assert len(rows) == 10
    assert rows[0].endswith("paper_s")
