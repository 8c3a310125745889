"""gecar from Python: one call each, quick to import, and shown by notebooks."""

import subprocess
import sys
from pathlib import Path

import pytest

import gecar
from gecar.errors import InputError
from gecar.evolution.crossover import VariableOnePoint
from gecar.evolution.initialisation import Sensible, Uniform
from gecar.evolution.mutation import Flip
from gecar.evolution.operators import Operators
from gecar.evolution.selection import Tournament
from gecar.evolution.settings import EvolutionSettings
from gecar.evolution.structured import GeneCrossover, GeneFlip
from gecar.language.mapping import MappingOptions
from gecar.language.structured import StructuredMapper
from gecar.world.rollout import Outcome

PROGRAM = "if(SensorValue > 80):\n    motor(70,90,0)\nelse:\n    motor(40,-100,30)\n"
SMALL = {"population": 8, "generations": 2, "draws": 1}


def test_importing_gecar_loads_nothing_slow():
    code = (
        "import sys, gecar; print([m for m in ('numpy', 'numba', 'matplotlib', 'scipy') if m in sys.modules])"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "[]"


def test_everything_at_the_top_is_there_and_typed():
    typed = {
        line.split()[-1]
        for line in Path(gecar.__file__ + "i").read_text().splitlines()
        if line.startswith("from")
    }
    assert typed == set(gecar._PLACES)
    for name in typed:
        assert getattr(gecar, name).__doc__
        assert name in dir(gecar)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = gecar.nonsense


def test_a_run_in_memory_is_the_run_of_the_folder(tmp_path):
    in_memory = gecar.evolve("paper", settings=SMALL, seed=3, workers=2)
    in_folder = gecar.evolve("paper", settings=SMALL, seed=3, out=tmp_path / "run")
    assert (tmp_path / "run/result.json").exists()
    assert str(in_memory.program) == str(in_folder.program)
    assert [g.best for g in in_memory.history] == [g.best for g in in_folder.history]


def test_objects_stand_for_names():
    course, robot = gecar.load_course("hairpin"), gecar.load_robot("ev3")
    by_object = gecar.evolve(course, gecar.load_grammar("paper"), settings=SMALL, robot=robot)
    by_name = gecar.evolve("hairpin", settings=SMALL)
    assert by_object.world.course is course
    assert str(by_object.program) == str(by_name.program)


def test_operators_of_ones_own_are_used():
    class Counted(Flip):
        calls = 0

        def __call__(self, genomes, mapper, streams):
            Counted.calls += 1
            return super().__call__(genomes, mapper, streams)

    settings = EvolutionSettings(population=8, generations=2)
    found = gecar.evolve(settings=SMALL, operators=Operators.of(settings, mutation=Counted(0.05)))
    assert Counted.calls == 2  # generations; no rehearsal
    assert len(found.history) == 3


def test_codons_are_read_as_the_mapping_says():
    wide = MappingOptions(codon_size=1_000, variable_length=True)
    ponyge2 = Operators(
        Sensible(200, 6, tail=0.5), Tournament(2), (VariableOnePoint(0.75), Flip(None, within_used=True))
    )
    found = gecar.evolve(settings=SMALL, mapping=wide, operators=ponyge2)
    assert found.best.genome.max() > 255
    genes = StructuredMapper(gecar.load_grammar("proportional"), gene=8, depth=9)
    by_genes = Operators(Uniform(genes.codons), Tournament(2), (GeneCrossover(0.9), GeneFlip(0.05)))
    found = gecar.evolve(settings=SMALL | {"restart": "random"}, mapping=genes, operators=by_genes)
    assert len(found.best.genome) == genes.codons


def test_operators_and_mappings_that_do_not_go_together_are_refused(tmp_path):
    operators = Operators.of(EvolutionSettings())
    with pytest.raises(InputError, match="operators made in Python, expected those of the settings"):
        gecar.evolve(operators=operators, out=tmp_path / "run")
    with pytest.raises(InputError, match="start_from"):
        gecar.evolve(operators=operators, start_from=[PROGRAM])
    with pytest.raises(InputError, match="StructuredMapper"):
        gecar.evolve(mapping=StructuredMapper(gecar.load_grammar("paper"), gene=8, depth=9))


def test_a_fitness_of_ones_own_is_what_evolution_minimises():
    def shortest_way(drive):
        return 1.0 / drive.time_s

    found = gecar.evolve(fitness=shortest_way, settings=SMALL | {"generations": 4})
    first, last = found.history[0].best, found.history[-1].best
    assert last <= first
    assert found.best.merit == pytest.approx(1.0 / found.simulation.time_s)


def test_a_fitness_of_ones_own_is_measured_under_drawn_conditions_too():
    seen = []
    gecar.evolve(
        fitness=lambda drive: seen.append(drive) or 1.0, settings=SMALL | {"draws": 3, "generations": 1}
    )
    ends = {drive.time_s for drive in seen}
    assert len(seen) > 16
    assert len(ends) > 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"course": "hairpn"}, "did you mean 'hairpin'"),
        ({"settings": {"populaton": 3}}, "populaton"),
        ({"settings": "nonsense"}, "preset: found 'nonsense'"),
        ({"fitness": lambda drive: -1.0, "settings": SMALL}, "fitness: found -1, expected 0 or more"),
        ({"fitness": lambda drive: 1.0, "out": "there"}, "out: found a fitness of your own"),
    ],
)
def test_what_evolve_cannot_do_is_said(arguments, words):
    with pytest.raises(gecar.InputError, match=words):
        gecar.evolve(**arguments)


def test_objects_need_no_folder(tmp_path):
    with pytest.raises(
        gecar.InputError, match="out: found a course made in Python, expected its name or its file"
    ):
        gecar.evolve(gecar.load_course("paper"), out=tmp_path / "run")


def test_programs_are_simulated_from_text_file_and_run(tmp_path):
    (tmp_path / "best.txt").write_text(PROGRAM)
    ends = [
        gecar.simulate(p).time_s
        for p in (PROGRAM, tmp_path / "best.txt", tmp_path, gecar.parse_program(PROGRAM))
    ]
    assert gecar.simulate(PROGRAM).outcome == Outcome.GOAL
    assert len(set(ends)) == 1
    assert gecar.simulate(PROGRAM, robot="paper").time_s != ends[0]


def test_discover_refuses_no_recordings():
    with pytest.raises(gecar.InputError, match="recordings: found none"):
        gecar.discover([])


def test_a_notebook_shows_drives_runs_and_courses():
    shown = gecar.simulate(PROGRAM)._repr_html_()
    assert "<img alt='The paper&#x27;s course: GOAL in" in shown
    assert "drives under random conditions" in shown
    run = gecar.evolve(settings=SMALL)
    assert "<img" in run._repr_html_()
    assert "<pre>" in run.best._repr_html_()
    assert "<img alt='The course" in gecar.load_course("hairpin")._repr_html_()


def test_a_notebook_shows_recordings_with_and_without_a_camera():
    from support.synthetic import drive

    from gecar.plots.reality.recording import recording_figure
    from gecar.plots.style import is_whole
    from gecar.reality.recordings.recording import make_recording

    seen = drive(seconds=3.0)
    columns = {"t_s": seen.t_s, "left_duty_pct": 50.0 + 0.0 * seen.t_s, "right_duty_pct": 0.0 * seen.t_s}
    alone = make_recording("alone", columns)
    assert len(recording_figure(seen).axes) > len(recording_figure(alone).axes) == 1
    assert is_whole(recording_figure(seen))
    assert "<img alt='The recording synthetic'" in seen._repr_html_()
