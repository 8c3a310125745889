"""Any problem: the worked examples of the documents, fitnesses of all kinds, operators and representations."""

import json
import random
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from gecar.errors import InputError
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.crossover import OnePoint, Subtree, VariableOnePoint
from gecar.evolution.fitness import Fitness
from gecar.evolution.initialisation import Sensible, Uniform
from gecar.evolution.mutation import Creep, Flip
from gecar.evolution.operators import Operators
from gecar.evolution.selection import Tournament
from gecar.evolution.settings import EvolutionSettings
from gecar.evolution.structured import GeneCrossover, GeneFlip
from gecar.language.grammar import load_grammar, parse_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.structured import StructuredMapper
from gecar.problems import regression
from gecar.problems.ant import FOOD, missed, read_ant
from gecar.problems.regression import keijzer_6, read_formula, vladislavleva_4
from gecar.random_streams import generators, spawn

BITS = Mapper(parse_grammar("<a> ::= <b><b><b><b><b><b>\n<b> ::= 0 | 1"))
SMALL = EvolutionSettings(population=40, generations=15, codons=12)


def ones(bits: str) -> int:
    return bits.count("1")


def test_the_page_s_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pymoo", reason="needs pip install 'gecar[goals]'")
    page = (Path(__file__).parents[2] / "docs" / "laboratory.md").read_text()
    names: dict[str, object] = {}
    for code in re.findall(r"(?s)```python\n(.*?)```", page):
        exec(code, names)  # a page of this repository
    said = capsys.readouterr().out
    lines = said.splitlines()
    square, keijzer, vladislavleva, ant, robot, front, two_aims, representations, locality = lines
    assert float(square.split()[-2]) < 1e-12
    assert float(keijzer.split()[1]) < 0.2
    assert float(vladislavleva.split()[1]) < 0.25
    assert int(ant.split()[0]) < 60
    assert 10 < float(robot) <= 10_000
    errors, sizes = zip(*json.loads(front), strict=True)
    assert list(errors) == sorted(errors)
    assert list(sizes) == sorted(sizes, reverse=True)
    assert float(two_aims.strip("[]").split()[1]) >= 1
    assert all(float(word) < 89 for word in representations.split())
    neutral, frequent, times = locality.split()
    assert 0.0 < float(neutral) < 1.0
    assert frequent.endswith(";")
    assert int(times) > 1


def test_a_maximised_fitness_ends_the_run_at_its_target() -> None:
    evolution = Evolution(BITS, phenotype=str, fitness=Fitness(ones, maximise=True, target=6), settings=SMALL)
    best = evolution.run()
    assert (best.program, best.fitness, best.merit) == ("111111", 6.0, -6.0)
    assert evolution.finished
    assert evolution.generation < 15


def test_a_fitness_far_above_ten_thousand_is_none_the_worse() -> None:
    large = Evolution(BITS, fitness=lambda bits: 1e9 - ones(str(bits)), settings=SMALL)
    small = Evolution(BITS, fitness=lambda bits: -ones(str(bits)), settings=SMALL)
    assert large.run().program == small.run().program == "111111"
    assert large.history[-1].solved == 1.0


def test_a_program_that_fails_is_worse_than_any_other() -> None:
    def fitness(bits: str) -> float:
        return float("nan") if bits.startswith("1") else 6.0 - ones(bits)

    evolution = Evolution(BITS, fitness=fitness, settings=SMALL)
    assert evolution.run().program == "011111"
    assert 0 < evolution.history[0].solved < 1


def test_a_grammar_without_phenotypes_is_refused_with_one_of_its_words() -> None:
    evolution = Evolution(BITS, phenotype=lambda _: None, fitness=ones, settings=SMALL)
    with pytest.raises(InputError, match=r"1,000 genomes without a phenotype, such as '[01]{6}'"):
        Evolution(BITS, phenotype=lambda _: None, fitness=ones).run()
    with pytest.raises(InputError, match="640 genomes without a phenotype"):
        evolution.run()
    endless = Mapper(parse_grammar("<a> ::= <b><b>\n<b> ::= 0 | 1"))
    with pytest.raises(InputError, match="genomes without a derivation that finishes"):
        Evolution(
            endless, fitness=ones, settings=SMALL.model_copy(update={"codons": 1, "generations": 90})
        ).run()


@pytest.mark.parametrize(
    ("fitness", "message"),
    [
        (lambda _: "good", "fitness: found scores such as 'good', expected numbers, one a program"),
        (lambda _: (1.0, 2.0), r"fitness: found scores of shape \(\d+, 2\) for \d+ programs"),
        (Fitness(ones, scores=2), r"expected numbers, 2 a program"),
        (None, "fitness: found none, expected a function; otherwise ask and tell"),
    ],
)
def test_a_fitness_that_is_no_number_is_refused(fitness: Callable[[str], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Evolution(BITS, fitness=fitness, settings=SMALL).run()


def test_several_scores_are_cases_for_lexicase() -> None:
    settings = SMALL.model_copy(update={"selection": "lexicase", "population": 20})
    fitness = Fitness(lambda bits: [float(bit) for bit in bits], 6, maximise=True, overall=np.sum)
    evolution = Evolution(BITS, phenotype=str, fitness=fitness, settings=settings)
    best = evolution.run()
    assert best.merit == -6.0
    assert np.array_equal(best.fitness, np.ones(6))


def test_chance_is_averaged_out_and_the_winner_is_not_merely_lucky() -> None:
    def noisy(bits: str, rng: np.random.Generator) -> float:
        return 6 - ones(bits) + rng.normal(0.0, 2.0)

    def run(seed: int, map: Callable[..., object] = map) -> tuple[str, float]:  # noqa: A002
        evolution = Evolution(
            BITS, phenotype=str, fitness=Fitness(noisy, draws=20), settings=SMALL, seed=seed
        )
        best = evolution.run(map=map)
        return best.program, best.merit

    found = [run(seed) for seed in (1, 2, 3)]
    assert np.mean([ones(program) for program, _ in found]) > 5
    with ThreadPoolExecutor(2) as pool:
        assert run(1, pool.map) == found[0]


def test_a_run_goes_on_to_the_same_end() -> None:
    def begin() -> Evolution[str]:
        return Evolution(BITS, phenotype=str, fitness=ones, settings=SMALL, seed=4)

    whole, begun = begin(), begin()
    whole.run()
    for _ in range(6):
        begun.tell([ones(asked.program) for asked in begun.ask()])
    resumed = Evolution.resume(begun.state(), BITS, begun.problem, SMALL)
    resumed.run()
    assert resumed.genomes.tobytes() == whole.genomes.tobytes()
    assert resumed.best.fitness == whole.best.fitness


def test_any_object_takes_an_operator_s_place() -> None:
    calls = []

    class Everything:
        change = 2

        def __call__(self, *arguments):
            calls.append(len(arguments))
            if len(arguments) == 2 and hasattr(arguments[0], "merits"):
                return np.argsort(arguments[0].merits, kind="stable")[: len(arguments[1])].astype(np.int32)
            if len(arguments) == 2:
                return np.zeros((len(arguments[1]), 12), np.uint8)
            for genome, rng in zip(arguments[0], generators(arguments[2]), strict=True):
                genome[rng.integers(6)] ^= 1
            return arguments[0]

    settings = SMALL.model_copy(update={"population": 41})  # as many parents as individuals: 40 and the elite
    mine = Everything()
    operators = Operators(mine, mine, (mine,))
    best = Evolution(
        BITS, phenotype=str, fitness=Fitness(ones, maximise=True), settings=settings, operators=operators
    ).run()
    assert best.fitness > 3
    assert {2, 3} == set(calls)


def test_generators_of_a_stream_differ_from_call_to_call_and_not_from_run_to_run() -> None:
    streams, again = spawn(1, 2, 0, 3), spawn(1, 2, 0, 3)
    drawn = [[rng.random() for rng in generators(streams)] for _ in range(2)]
    assert drawn == [[rng.random() for rng in generators(again)] for _ in range(2)]
    assert len({*drawn[0], *drawn[1]}) == 6


@pytest.mark.parametrize("size", [100, 256, 100_000])
def test_large_codons_choose_by_their_remainder(size: int) -> None:
    grammar = load_grammar("table1")
    wide = Mapper(grammar, MappingOptions(codon_size=size, variable_length=True))
    genomes = np.random.default_rng(1).integers(0, size, (300, 40))
    mapped, plain = wide.map(genomes), Mapper(grammar).map(genomes % 12)  # 3, 4 and 1 productions divide 12
    texts = [mapped.text(i) if mapped.valid[i] else None for i in range(300)]
    if size % 12 == 0 or size > 256:
        small = [plain.text(i) if plain.valid[i] else None for i in range(300)]
        assert texts == small
    assert mapped.valid.sum() > 100
    assert wide.map(genomes).choices.dtype == np.int32


def test_a_genome_ends_before_its_first_negative_codon() -> None:
    mapper = Mapper(load_grammar("table1"), MappingOptions(variable_length=True))
    mapped = mapper.map([[2, 0, -1, -1], [0, 2, -1, 2], [-1, -1, -1, -1]])
    assert mapped.valid.tolist() == [True, False, False]
    assert mapped.text(0) == "x"
    assert [step.codon for step in mapper.derive([0, 2, -1, 2])] == [None, 0, 2, None]
    with pytest.raises(InputError, match=r"whole numbers -1\.\.255"):
        mapper.map([[256, 0]])


def test_genomes_of_variable_length_grow_and_shrink_and_lose_nothing() -> None:
    mapper = Mapper(load_grammar("table1"), MappingOptions(codon_size=100_000, variable_length=True))
    genomes = Uniform(200, shortest=2)(mapper, spawn(1, 0, 0, 100))
    lengths = (genomes >= 0).sum(axis=1)
    assert lengths.min() < 20
    assert lengths.max() > 150
    for crossover in (VariableOnePoint(1.0), Subtree(1.0), OnePoint(1.0)):
        children = crossover(genomes.copy(), mapper, spawn(1, 1, 0, 100))
        ended = children < 0
        assert (ended[:, 1:] >= ended[:, :-1]).all()  # nothing after the end
        after = (~ended).sum(axis=1)
        both = lengths.reshape(-1, 2).sum(axis=1) == after.reshape(-1, 2).sum(axis=1)
        room = after.max() < 200
        assert both.all() if not isinstance(crossover, VariableOnePoint) else (both.mean() > 0.8 or not room)
    changed = Flip(1.0)(genomes.copy(), mapper, spawn(1, 1, 0, 100))
    assert ((changed < 0) == (genomes < 0)).all()
    assert changed.max() > 90_000


def test_a_tail_follows_first_trees() -> None:
    mapper = Mapper(load_grammar("santa_fe"), MappingOptions(variable_length=True))
    genomes = Sensible(500, 8, tail=0.5)(mapper, spawn(1, 0, 0, 60))
    mapped = mapper.map(genomes)
    assert mapped.valid.all()
    lengths = (genomes >= 0).sum(axis=1)
    assert (np.abs(lengths - 1.5 * mapped.used) <= 0.5).all()


def test_every_structured_genome_derives_a_tree_of_bounded_depth() -> None:
    mapper = StructuredMapper(load_grammar("santa_fe"), gene=7, depth=6)
    genomes = Uniform(mapper.codons)(mapper, spawn(1, 0, 0, 200))
    mapped = mapper.map(genomes)
    assert mapped.valid.all()
    assert all(read_ant(mapped.text(i)) for i in range(200))
    assert len({mapped.text(i) for i in range(200)}) > 80
    tree = mapped.tree(0)
    assert tree[0].symbol == "<code>"
    with pytest.raises(InputError, match="found genomes of 3 codons, expected 28: 7 for each nonterminal"):
        mapper.map(np.zeros((2, 3), np.uint8))


def test_a_codon_of_a_gene_changes_choices_of_its_nonterminal_only() -> None:
    mapper = StructuredMapper(parse_grammar("<a> ::= <b><c>\n<b> ::= 0|1|2|3\n<c> ::= x|y|z"), gene=4)
    genome = np.arange(12, dtype=np.uint8)[None]
    other = genome.copy()
    other[0, 4] += 1
    assert mapper.map(genome).text(0)[1] == mapper.map(other).text(0)[1]
    assert mapper.map(genome).text(0)[0] != mapper.map(other).text(0)[0]
    genes = np.repeat([[1], [2]], 12, axis=1).astype(np.uint8).repeat(50, axis=0)[np.arange(100) % 2 * 50]
    children = GeneCrossover(1.0)(genes.copy(), mapper, spawn(1, 1, 0, 100)).reshape(100, 3, 4)
    assert (children == children[:, :, :1]).all()
    flipped = GeneFlip(1.0)(genes.copy(), mapper, spawn(1, 1, 0, 100)).reshape(100, 3, 4) != genes.reshape(
        100, 3, 4
    )
    assert not flipped[:, 0].any()  # <a> has one production and reads nothing
    assert not flipped[:, 1:, 1:].any()  # one codon of each is read


def test_operators_on_trees_are_refused_for_genes() -> None:
    mapper = StructuredMapper(load_grammar("santa_fe"))
    for operator in (Subtree(1.0), Creep(0.1), Flip(0.1, within_used=True)):
        operators = Operators(Uniform(mapper.codons), Tournament(2), (operator,))
        with pytest.raises(InputError, match=f"found {type(operator).__name__} for a StructuredMapper"):
            Evolution(mapper, fitness=ones, operators=operators)
    with pytest.raises(InputError, match="found trees for a mapper of genes"):
        Sensible(80, 5)(mapper, spawn(1, 0, 0, 2))


FOLLOWER = (
    "if(food_ahead){move;}else{left;if(food_ahead){move;}"
    "else{right;right;if(food_ahead){move;}else{left;move;}}}"
)


def test_the_ant_finds_all_food_with_a_program_known_to() -> None:
    assert FOOD.sum() == 89
    assert missed(read_ant(FOLLOWER)) == 0
    assert missed(read_ant("move;")) == 89 - FOOD[0].sum()
    assert missed(read_ant("left;")) == 89
    assert (
        missed(read_ant("if(food_ahead){move;}else{if(food_ahead){left;}else{}}")) == 86
    )  # then it waits for ever


@pytest.mark.parametrize(
    "text",
    [
        "",
        "move",
        "if(food_ahead){move;}",
        "}else{",
        "if(food_ahead){}else{}",
        "move;}",
        "if(food_ahead){move;}}",
    ],
)
def test_what_is_no_program_for_the_ant_is_none(text: str) -> None:
    assert read_ant(text) is None


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x", 3.0), ("-x*x", -9.0), ("x-x-x", -3.0), ("x/x/x", 1 / 3), ("2-x*x+1", -6.0), ("(2-x)*(x+1)", -4.0),
        ("pdiv(x,x-x)", 1.0), ("pdiv(1.5,x)*2", 1.0), ("psqrt(0-x*x)", 3.0), ("plog(0-x)", np.log(4.0)),
        ("x*-x+-+2", -11.0), ("exp(sin(x))-tanh(x)", np.exp(np.sin(3.0)) - np.tanh(3.0)), ("05.31+x", 8.31),
        ("pdiv(pdiv(x,2),pdiv(2,x))", 2.25), ("((x))", 3.0),
    ],
)  # fmt: skip
def test_formulas_are_worked_out_as_python_would(text: str, value: float) -> None:
    formula = read_formula(text)
    assert formula is not None
    assert formula(np.array([[3.0]]))[0] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text", [*["", "+", "x+", "xx", "x x", "x**x", "x//x", "(x", "x)", "sin x", "sin()", "sin(x,x)", "pdiv(x)", "2x"],
    *["(x,x)", "x,x", "y", "abs(x)", ")(", "sin", "pdiv(x,,x)", "x" * 20_000, "1e5", "(,)", "sin(,x)"]]
)  # fmt: skip
def test_what_is_no_formula_is_none(text: str) -> None:
    assert read_formula(text) is None


def test_the_benchmarks_are_those_of_the_literature() -> None:
    keijzer, vladislavleva = keijzer_6(), vladislavleva_4()
    assert keijzer.y[:3].tolist() == [1.0, 1.5, 1.5 + 1 / 3]
    assert (len(keijzer.y), len(keijzer.unseen_y)) == (50, 120)
    assert keijzer(read_formula("plog(x-0.5)+0.57722")) < 0.006  # log(x + 1/2) and Euler's constant
    exact = "10/(5+(x1-3)*(x1-3)+(x2-3)*(x2-3)+(x3-3)*(x3-3)+(x4-3)*(x4-3)+(x5-3)*(x5-3))"
    formula = read_formula(exact, vladislavleva.variables)
    assert vladislavleva(formula) < 1e-12
    assert vladislavleva.unseen(formula) < 1e-12
    assert vladislavleva.x.shape == (5, 1_024)


def test_compiled_reading_of_formulas_is_that_of_pythons_own():
    draw = random.Random(3)
    words = (
        *"+-*/(),.x1",
        "pdiv",
        "psqrt",
        "sin",
        "exp",
        "12.50",
        "007.25",
        "3.",
        "2x",
        "_a",
        "é",
        "\x1c",
        " ",
        "#",
        "٣",
    )
    words += ("12345678901234567890", "0.00000000000000000000000000001", "99.999999")
    n = 0
    for _ in range(3_000):
        text = "".join(draw.choice(words) for _ in range(draw.randint(1, 9)))
        for variables in (("x",), ("x", "x1"), ("x", "sin"), ("a b", "x")):
            steps, values = regression._postfix(*regression._words_of(text, variables))
            formula = read_formula(text, variables)
            assert (formula is None) == (len(steps) == 0)
            if formula is not None:
                n += 1
                assert (formula.codes == steps).all()
                assert (formula.values == values).all()
    assert n > 500
    for _ in range(3_000):
        number = f"{draw.randint(0, 10 ** draw.randint(0, 9))}.{draw.randint(0, 10**7)}"
        assert read_formula(number).values[0] == float(number)
