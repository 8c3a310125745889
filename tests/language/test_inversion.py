"""From programs back to genomes, and evolutions that start from given programs."""

import numpy as np
import pytest
from support.command import Command

from gecar.api import evolve
from gecar.errors import InputError
from gecar.evolution.initialisation import Seeded, Uniform
from gecar.language.grammar import load_grammar, parse_grammar
from gecar.language.inversion import choices_of, genome_of
from gecar.language.mapping import Mapper
from gecar.language.program import parse_program
from gecar.random_streams import spawn
from gecar.results.config import configure
from gecar.results.run import finish, resume, start

FOLLOWS = "if(SensorValue > 75):\n    motor(50,60,10)\nelse:\n    motor(30,-60,20)"
SMALL = {
    "executor": "serial",
    "time_limit_s": 30.0,
    "search": {"population": 6, "generations": 1, "codons": 60},
}


@pytest.mark.parametrize(
    "name", ["paper", "fine", "proportional", "memory", "nested", "rich", "rich_one_sensor"]
)
def test_every_program_of_a_shipped_grammar_is_derived_again(name):
    mapper = Mapper(load_grammar(name))
    mapped = mapper.map(np.random.default_rng(5).integers(0, 256, (40, 500), np.uint8))
    programs = [parse_program(mapped.program(i).source) for i in np.flatnonzero(mapped.valid)]
    genomes = np.array([genome_of(mapper, program, 900) for program in programs])
    again = mapper.map(genomes)
    assert [again.program(i).canonical for i in range(len(programs))] == [p.canonical for p in programs]
    assert len(programs) > 10


def test_every_program_of_table_3_can_be_refined_in_steps_of_one():
    coarse, fine = (Mapper(load_grammar(name)) for name in ("paper", "fine"))
    mapped = coarse.map(np.random.default_rng(6).integers(0, 256, (40, 500), np.uint8))
    programs = [parse_program(mapped.program(i).source) for i in np.flatnonzero(mapped.valid)]
    again = fine.map(np.array([genome_of(fine, program, 900) for program in programs]))
    assert [again.program(i).canonical for i in range(len(programs))] == [p.canonical for p in programs]
    assert len(programs) > 10


def test_numbers_that_the_grammar_works_out_are_found():
    mapper = Mapper(load_grammar("paper"))
    program = parse_program("if(SensorValue > 85):\n    motor(-100,100,150)\nelse:\n    motor(0,10,0)")
    (mapped,) = [mapper.map(genome_of(mapper, program, 40)[None])]
    assert "SensorValue>(100+70)/2" in mapped.text(0)
    assert "motor(-100, 100, 100+50)" in mapped.text(0)


def test_a_negation_that_reaches_over_several_comparisons_is_kept():
    mapper = Mapper(load_grammar("memory"))
    for condition in ("not (SensorValue > 50 and Timer > 500)", "not SensorValue > 50 and Timer > 500"):
        program = parse_program(f"if({condition}):\n    motor(20,30,80)\nelse:\n    motor(30,30,50)")
        assert mapper.map(genome_of(mapper, program, 60)[None]).program(0).canonical == program.canonical


def test_a_grammar_may_lead_to_itself_and_to_nothing():
    grammar = parse_grammar('<c> ::= <c><c> | <d> | ""\n<d> ::= <c> | motor(<n>0,10,100);\n<n> ::= 1 | 2')
    mapper = Mapper(grammar)
    program = parse_program("motor(20,10,100)\nmotor(10,10,100)")
    assert mapper.map(genome_of(mapper, program, 30)[None]).program(0).canonical == program.canonical


def test_numbers_written_digit_by_digit_are_found():
    mapper = Mapper(
        parse_grammar('<c> ::= motor(<s><d><d>, <d>0, <d><d>+<d>);\n<s> ::= "" | -\n<d> ::= 0 | 1 | 2')
    )
    program = parse_program("motor(-12,20,24)")
    assert mapper.map(genome_of(mapper, program, 30)[None]).program(0).canonical == program.canonical


def test_a_program_that_the_grammar_does_not_derive_is_refused_with_its_line():
    mapper = Mapper(load_grammar("paper"))
    with pytest.raises(InputError, match=r"line 3, 'motor\(45,50,100\)'"):
        choices_of(mapper, parse_program("if(SensorValue > 50):\n    motor(10,10,10)\nmotor(45,50,100)"))
    with pytest.raises(InputError, match="at most 3; raise codons"):
        genome_of(mapper, parse_program("motor(10,10,10)"), 3)


def test_given_genomes_stand_first_in_every_new_population():
    mapper = Mapper(load_grammar("paper"))
    given = genome_of(mapper, parse_program(FOLLOWS.replace("20", "10")), 60)[None]
    genomes = Seeded(Uniform(60), given)(mapper, spawn(1, 0, 0, 5))
    assert (genomes[0] == given[0]).all()
    assert (genomes[1:] == Uniform(60)(mapper, spawn(1, 0, 0, 5))[1:]).all()


def test_a_run_starts_from_a_program_and_goes_on_to_the_same_end(tmp_path):
    config = configure({**SMALL, "start_from": [FOLLOWS]})
    whole = finish(start(config, tmp_path / "whole"))
    assert whole["fitness_s"] < 30.0  # in seven programs and two generations, which is not luck
    start(config, tmp_path / "stopped")
    again = finish(resume(tmp_path / "stopped"))
    del whole["wall_s"], again["wall_s"]
    assert again == whole


def test_programs_to_start_from_come_from_files_runs_and_python(gecar: Command, tmp_path):
    (tmp_path / "mine.txt").write_text(FOLLOWS)
    words = (
        "--preset",
        "paper",
        "--population",
        6,
        "--generations",
        0,
        "--workers",
        1,
        "--no-pictures",
        "--json",
    )
    ended = gecar("evolve", *words, "--start-from", "mine.txt", "--out", "first")
    assert ended.json["program"] == FOLLOWS
    assert gecar("evolve", *words, "--start-from", "first", "--out", "second").json["program"] == FOLLOWS
    (tmp_path / "odd.txt").write_text("motor(45,50,100)")
    assert "motor(45,50,100)" in gecar.error("evolve", *words, "--start-from", "odd.txt", "--out", "third")
    assert not (tmp_path / "third").exists()
    settings = {"population": 6, "generations": 0, "draws": 1}
    assert evolve(settings=settings, start_from=[FOLLOWS], workers=1).program.source == FOLLOWS
