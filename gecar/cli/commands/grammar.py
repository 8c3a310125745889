"""``gecar grammar``: list, check and derive from grammars."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.language.grammar import Grammar
    from gecar.language.mapping import Mapped, Mapper

grammar = typer.Typer(
    name="grammar",
    help="List, check and derive from grammars.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
)

GrammarArgument = Annotated[
    str, typer.Argument(metavar="GRAMMAR", help="A name or a .bnf file.", show_default=False)
]
GenomeArgument = Annotated[
    str,
    typer.Argument(
        metavar="GENOME", show_default=False,
        help="Codons 0..255, separated by commas or spaces; or one codon per digit, as in the paper's 302122.",
    ),
]  # fmt: skip
WrapsOption = Annotated[int, typer.Option("--wraps", help="Maximum genome wraps.")]
ConsumesOption = Annotated[
    bool,
    typer.Option(
        "--single-choice-consumes", help="Nonterminals with a single alternative read a codon, too."
    ),
]


@grammar.command("list")
def list_grammars(as_json: JsonOption = False) -> None:
    """List the grammars that ship with gecar, and those in ./grammars."""
    from rich.table import Table

    from gecar.language.grammar import list_grammars, load_grammar

    output = Output(as_json)
    table = Table("grammar", "nonterminals", "alternatives", "maps to", box=None, pad_edge=False)
    found = {name: summary(load_grammar(name)) for name in list_grammars()}
    for name, facts in found.items():
        kind = "robot programs" if facts["robot_language"] else "text"
        table.add_row(name, str(facts["nonterminals"]), str(facts["alternatives"]), kind)
    output.print(table)
    output.print_json({"grammars": found})


@grammar.command()
def check(name: GrammarArgument, as_json: JsonOption = False) -> None:
    """Check a grammar and list its contents.

    Every nonterminal must be defined and must derive some text. Unreachable ones are listed.
    """
    from gecar.language.grammar import load_grammar

    output = Output(as_json)
    loaded = load_grammar(name)
    facts = summary(loaded)
    for warning in loaded.warnings:
        output.print(f"warning: {warning}", style="yellow")
    kind = (
        "Its words are robot programs."
        if facts["robot_language"]
        else "It maps to text, not to robot programs."
    )
    output.print(
        f"{loaded.source}: {facts['nonterminals']} nonterminals, {facts['alternatives']} alternatives; "
        f"the shallowest derivation is {facts['minimum_depth']} deep. {kind}"
    )
    output.print_json({"grammar": name, **facts})


@grammar.command()
def derive(
    name: GrammarArgument,
    genome: GenomeArgument,
    wraps: WrapsOption = 0,
    single_choice_consumes: ConsumesOption = False,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            metavar="FILE",
            help="Draw the derivation tree to a .png, .pdf or .svg file.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a derivation step by step, as in the paper's Table 2; draw it as a tree if asked.

    [bold]Examples[/]

      gecar grammar derive table1 302122
      gecar grammar derive table1 302122 --picture tree.png
    """
    from rich.table import Table

    output = Output(as_json)
    mapper = _mapper(name, wraps, single_choice_consumes)
    if picture is not None:
        from gecar.plots.runs.derivation_tree import tree_of
        from gecar.plots.style import picture_kind, save

        picture_kind(picture)
        save(tree_of(mapper, codons(genome)), picture)
    steps = list(mapper.derive(codons(genome)))
    table = Table("S_n", "r_A", "m", "A", "selected", "replaced symbol", box=None, pad_edge=False)
    for step in steps:
        numbers = ("" if n is None else str(n) for n in (step.codon, step.choices, step.chosen))
        table.add_row(*numbers, *map(_text, (step.symbol, step.selected, step.form)))
    output.print(table)
    output.print()
    output.print(
        f"Derived: {steps[-1].form}"
        if steps[-1].finished
        else f"Invalid: the codons ran out at {steps[-1].form}"
    )
    if picture is not None:
        output.print(f"Picture: {picture}")
    output.print_json(
        {
            "valid": steps[-1].finished,
            "phenotype": steps[-1].form if steps[-1].finished else None,
            "steps": [vars(step) for step in steps],
            "picture": None if picture is None else str(picture),
        }
    )


@grammar.command("map")
def map_genomes(
    name: GrammarArgument,
    genome: Annotated[
        str | None, typer.Argument(metavar="GENOME", help="Codons; default: random genomes.")
    ] = None,
    count: Annotated[int, typer.Option("--count", help="Number of random genomes.")] = 5,
    length: Annotated[int, typer.Option("--codons", help="Codons of each random genome.")] = 1000,
    seed: Annotated[int, typer.Option("--seed", help="Random seed.")] = 1,
    wraps: WrapsOption = 0,
    single_choice_consumes: ConsumesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Map a genome, or random ones, to programs.

    [bold]Examples[/]

      gecar grammar map paper "2 18 7 255 0 9"
      gecar grammar map rich --count 3 --seed 8
    """
    output = Output(as_json)
    mapper = _mapper(name, wraps, single_choice_consumes)
    genomes = [codons(genome)] if genome is not None else _random_genomes(count, length, seed)
    mapped = mapper.map(genomes)
    for i in range(len(mapped)):
        output.print(
            f"# genome {i + 1}: {mapped.used[i]} codons{'' if mapped.valid[i] else ' and not finished: invalid'}"
        )
        output.print(_phenotype(mapped, i) or "")
    output.print(f"# {int(mapped.valid.sum())} of {len(mapped)} genomes are valid")
    output.print_json(
        {
            "valid": mapped.valid,
            "codons_used": mapped.used,
            "phenotypes": [_phenotype(mapped, i) for i in range(len(mapped))],
        }
    )


@grammar.command()
def locality(
    name: GrammarArgument,
    count: Annotated[int, typer.Option("--count", help="Number of random genomes, and of mutants.")] = 5000,
    length: Annotated[int, typer.Option("--codons", help="Codons of each genome.")] = 1000,
    seed: Annotated[int, typer.Option("--seed", help="Random seed.")] = 1,
    wraps: WrapsOption = 0,
    single_choice_consumes: ConsumesOption = False,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Draw it to a .png, .pdf or .svg file.", show_default=False),
    ] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Measure locality and redundancy: what one changed codon changes, and how many genomes share a phenotype.

    Distances count words of the grammar to insert, delete or replace. Of a run, gecar plot also draws the population.

    [bold]Examples[/]

      gecar grammar locality paper --picture locality.png
      gecar grammar locality santa_fe --codons 200 --json
    """
    import numpy as np

    from gecar.evolution.representation import measure

    output = Output(as_json)
    mapper = _mapper(name, wraps, single_choice_consumes)
    found = measure(mapper, np.array(_random_genomes(count, length, seed)), count, seed)
    if picture is not None:
        from gecar.plots.runs.representation import representation_figure, representation_title
        from gecar.plots.style import picture_kind, save

        picture_kind(picture)
        detail = f"grammar {Path(name).stem}, {count:,} random genomes"
        save(representation_figure({"random genomes": found}, representation_title(found), detail), picture)
    figures = found.figures()
    for words, value in _in_words(figures):
        output.print(f"{words:58} {value}")
    if picture is not None:
        output.print(f"Picture: {picture}")
    output.print_json({**figures, "picture": None if picture is None else str(picture)})


def _in_words(figures: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what was measured of a representation, in words."""
    shares = {
        "genomes that map to a phenotype": "valid",
        "mutants of the same phenotype (neutral)": "neutral",
        "mutants that differ by one word": "one_word",
        "mutants that map to no phenotype": "invalid",
        "genomes with the most frequent phenotype": "most_frequent",
    }
    numbers = {
        "codons used, median": "codons_used_median",
        "words by which other mutants differ, median": "changed_distance_median",
        "the same, mean": "changed_distance_mean",
        "different phenotypes": "phenotypes",
        "entropy of the phenotypes [bits]": "entropy_bits",
    }
    told = [(words, f"{100.0 * figures[key]:.3g} %") for words, key in shares.items()]
    return told + [(words, f"{figures[key]:,.4g}") for words, key in numbers.items()]


def summary(loaded: Grammar) -> dict[str, Any]:
    """Return a grammar's figures, ready for JSON."""
    from gecar.language.robot_language import check_robot_language

    return {
        "nonterminals": len(loaded.nonterminals),
        "alternatives": len(loaded.productions),
        "start": loaded.start,
        "minimum_depth": int(loaded.minimum_depth[0]),
        "robot_language": not _raises(check_robot_language, loaded),
        "warnings": list(loaded.warnings),
    }


def codons(words: str) -> list[int]:
    """Read a genome as people type it.

    Raises
    ------
    InputError
        If something in it is no codon.
    """
    digits = words.strip().isascii() and words.strip().isdigit()
    parts = list(words.strip()) if digits else re.split(r"[,\s]+", words.strip())
    for part in parts:
        if not re.fullmatch(r"\d{1,3}", part) or int(part) > 255:
            raise expected("genome", f"'{part}'", "codons 0..255 with commas or spaces between")
    return [int(part) for part in parts]


def _mapper(name: str, wraps: int, single_choice_consumes: bool) -> Mapper:
    from gecar.language.grammar import load_grammar
    from gecar.language.mapping import Mapper, MappingOptions

    return Mapper(load_grammar(name), MappingOptions(wraps, single_choice_consumes))


def _random_genomes(count: int, length: int, seed: int) -> Sequence[Any]:
    import numpy as np

    if not 1 <= count <= 100_000 or not 1 <= length <= 100_000:
        raise expected("--count, --codons", f"{count}, {length}", "numbers from 1 to 100000")
    if seed < 0:
        raise expected("--seed", seed, "a whole number of 0 or more")
    return list(np.random.default_rng(seed).integers(0, 256, (count, length), np.uint8))


def _phenotype(mapped: Mapped, i: int) -> str | None:
    """Return a genome's program as people read it, or its text where it is no program; None if invalid."""
    if not mapped.valid[i]:
        return None
    program = mapped.program(i)
    return program.source if program else mapped.text(i)


def _text(words: str) -> Any:
    from rich.text import Text

    return Text(words)


def _raises(function: Any, argument: object) -> bool:
    from gecar.errors import InputError

    try:
        function(argument)
    except InputError:
        return True
    return False
