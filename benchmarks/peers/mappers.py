"""Table 3's grammar in other grammatical evolution libraries: how many genomes a second each maps."""

from __future__ import annotations

import random
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gecar.files import shipped

Map = Callable[[list[int]], str | None]


def grape_bds() -> Map:
    """Return grape-bds' eager mapper (of PonyGE2's lineage)."""
    import grape.grape as library  # noqa: PLC0415

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table3.bnf"
        file.write_text(bnf())
        grammar = library.Grammar(str(file))

    def text(genome: list[int]) -> str | None:
        found = library.mapper_eager(genome, grammar, 10_000)
        return None if found[4] else found[0]

    return text


def alogos() -> Map:
    """Return alogos' mapper of grammatical evolution."""
    import alogos as library  # noqa: PLC0415

    grammar = library.Grammar(bnf_text=bnf())
    limits = {"max_wraps": 0, "max_expansions": 10_000}

    def text(genome: list[int]) -> str | None:
        try:
            return str(library.systems.ge.mapping.forward(grammar, genome, limits))
        except library.exceptions.MappingError:
            return None

    return text


def finchge() -> Map:
    """Return finchge's mapper."""
    from finchge.grammar import Grammar  # noqa: PLC0415
    from finchge.grammar.mapper import GenotypeMapper  # noqa: PLC0415

    mapper = GenotypeMapper(grammar=Grammar(bnf()), max_wraps=0)
    return lambda genome: mapper.map(genome).phenotype


LIBRARIES: dict[str, Callable[[], Map]] = {"grape-bds": grape_bds, "alogos": alogos, "finchge": finchge}


def bnf() -> str:
    """Return Table 3's grammar without comments."""
    lines = (shipped("grammars") / "paper.bnf").read_text(encoding="utf-8").splitlines()
    return "\n".join(line for line in lines if not line.startswith("#")).strip() + "\n"


def genomes(n: int, codons: int = 1_000, seed: int = 1) -> list[list[int]]:
    """Return random genomes, codons 0..255."""
    draw = random.Random(seed)  # noqa: S311
    return [[draw.randrange(256) for _ in range(codons)] for _ in range(n)]


def agree(mapped: Any, others: list[str | None]) -> float:
    """Return the share of genomes that gecar maps to the same text, blanks apart."""
    own = [mapped.text(i) if mapped.valid[i] else None for i in range(len(others))]
    return sum(_bare(a) == _bare(b) for a, b in zip(own, others, strict=True)) / len(others)


def _bare(text: str | None) -> str | None:
    return None if text is None else re.sub(r"\s", "", text)
