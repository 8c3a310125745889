"""`gecar report`: a study's tables, figures and provenance."""

import json
import shlex
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from test_study import SMALL, record

from gecar.cli.actions.table import Asked
from gecar.cli.options import settings
from gecar.files import shipped
from gecar.plots.runs.times import times_figure
from gecar.plots.style import is_whole, save
from gecar.report.origin import Reported, command, parameters, portable, shared_config
from gecar.report.paper import escaped
from gecar.results.cells import cells_of
from gecar.results.study import Axis, Study, StudyFolder

CROSSOVER, MUTATION = Axis("crossover_rate", (0.4, 0.7)), Axis("mutation_rate", (0.03, 0.05, 0.07))


def time_of(run):
    """A time that mutation betters, with some chance by seed; one run in seven does not get there."""
    chance = np.random.default_rng((run.config.seed, int(100 * run.row), int(100 * run.column)))
    return 1e4 if chance.random() < 1 / 7 else 24.0 - 90.0 * run.column + chance.normal(0.0, 1.0)


def finished(folder, study, left_out=()):
    kept = StudyFolder(folder)
    kept.begin(study, again=False)
    for run in study.plan():
        if run.config.seed not in left_out:
            bests = {"history": {"generation": [0, 1, 2], "best": [1e4, 30.0, min(30.0, time_of(run))]}}
            kept.keep(run, record(run, time_of(run)) | bests | {"versions": {"gecar": "0.1.0", "git": "abc"}})


@pytest.fixture(scope="module")
def study():
    return Study({}, SMALL, CROSSOVER, MUTATION, tuple(range(1, 13)))


def test_a_report_holds_tables_figures_and_provenance_and_names_no_machine(gecar, tmp_path, study):
    finished(tmp_path / "study", study)
    shutil.copytree(tmp_path / "study", tmp_path / "elsewhere/copy")
    answer = gecar("report", "study", "--json").json
    gecar("report", "elsewhere/copy", "--out", "again")
    report = tmp_path / "study/report"
    files = {path.name: path.read_bytes() for path in report.iterdir()}
    assert set(files) == set(answer["files"]) == {path.name for path in (tmp_path / "again").iterdir()}
    assert all((tmp_path / "again" / name).read_bytes() == content for name, content in files.items())
    texts = [content.decode() for name, content in files.items() if not name.endswith((".png", ".pdf"))]
    assert not any(str(tmp_path) in text or "study/" in text for text in texts)
    document = (report / "report.tex").read_text()
    assert document.count("\\begin{") == document.count("\\end{")
    assert "Wilcoxon's signed ranks" in document
    assert "Friedman" in document
    assert "72 of 72 runs" in document
    assert json.loads(files["provenance.json"])["versions"] == {"gecar": "0.1.0", "git": "abc"}


def test_contrasts_are_paired_corrected_and_in_latex(gecar, tmp_path, study):
    finished(tmp_path / "study", study)
    gecar("report", "study")
    rows = (tmp_path / "study/report/contrasts.csv").read_text().splitlines()
    assert len(rows) == 6
    assert all(row.endswith(",True") for row in rows[1:])
    table = (tmp_path / "study/report/contrasts.tex").read_text()
    assert "& A12 & p & p (Holm)" in table


def test_runs_that_are_missing_are_told_and_not_compared(gecar, tmp_path, study):
    finished(tmp_path / "study", study, left_out=range(2, 13))
    told = gecar("report", "study")
    assert "warning: 66 of 72 runs are not finished" in told.out
    kept = {path.name: path for path in (tmp_path / "study/runs").iterdir()}
    for path in kept.values():
        path.unlink()
    assert "no finished run" in gecar.error("report", "study")
    assert "nowhere" in gecar.error("report", "nowhere")


def test_the_command_and_configuration_of_a_report_plan_the_same_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(shipped("grammars") / "paper.bnf", tmp_path / "mine.bnf")
    base = {"preset": "better", "grammar": str(tmp_path / "mine.bnf"), "search": {"draws": 4}}
    changes = {"workers": 1, "course": "hairpin", "noise": 0.5, "search": {"restart": "random"}}
    rows, columns = Axis("selection", ("tournament", "lexicase")), Axis("preset", ("better", "paper"))
    planned = Study(base, changes, rows, columns, (3, 4))
    (tmp_path / "config.toml").write_text(shared_config(planned))
    said = shlex.split(command(planned))
    given = {option: word for option, word in pairwise(said) if option.startswith("--")}
    asked = Asked(
        Path("config.toml"), {"search": settings([given["--set"]])}, given["--rows"], given["--columns"],
        int(given["--seeds"]), int(given["--first-seed"]), Path(), False, "serial", 1, None,
    )  # fmt: skip
    again = asked.study().plan()
    assert [run.config.identity for run in again] == [run.config.identity for run in planned.plan()]
    assert str(tmp_path) not in shared_config(planned) + command(planned)


def test_settings_that_vary_or_are_not_table_4s_are_told(tmp_path):
    (tmp_path / "mine.bnf").write_bytes((shipped("grammars") / "paper.bnf").read_bytes())
    named = Axis("grammar", ("paper", str(tmp_path / "mine.bnf")))
    planned = Study({}, SMALL | {"noise": 0.5}, named, Axis("draws", (1, 3)), (1, 2))
    runs = planned.plan()
    reported = Reported(planned, runs, [record(run, 20.0) for run in runs])
    told = dict(parameters(reported))
    assert (told["grammar"], told["draws"], told["noise"]) == ("paper, mine.bnf", "1, 3", "0.5")
    assert told["seeds"] == "1 to 2"
    assert not {"workers", "islands", "creep rate"} & set(told)
    shown, cells = portable(planned, reported.cells)
    assert shown.rows.values == ("paper", "mine.bnf")
    assert [cell.row for cell in cells] == ["paper", "paper", "mine.bnf", "mine.bnf"]


def test_latex_reads_words_and_small_numbers():
    assert escaped("a_b & 5 %") == r"a\_b \& 5 \%"
    assert escaped("1.2e-06") == r"$1.2 \times 10^{-6}$"
    assert escaped("2e+10") == r"$2 \times 10^{10}$"


def test_final_times_show_every_run_and_those_without_goal(tmp_path, study):
    runs = study.plan()
    cells = cells_of(runs, [record(run, time_of(run)) for run in runs])
    figure = times_figure(cells, ("crossover rate", "mutation rate"))
    save(figure, tmp_path / "times.png")
    assert is_whole(figure)
    points = {mark: sum(len(line.get_xdata()) for line in figure.axes[0].lines if line.get_marker() == mark)
              for mark in ".x"}  # fmt: skip
    failed = sum(time_of(run) == 1e4 for run in runs)
    assert points == {".": 72 - failed, "x": failed}
    assert failed > 0
