"""A derivation tree: what each codon chose, from the start at the left to the program's words at the right.

A row is a leaf, so the words read downwards. A nonterminal that becomes another one alone shares its place; a number
of several digits is one leaf; and what lies too deep to be read is folded away, and said to be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.errors import expected
from gecar.language.grammar import Grammar
from gecar.language.mapping import Mapper, TreeNode
from gecar.plots.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    SOFT,
    VERMILION,
    headline,
    look,
    new_figure,
)

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MAX_ROWS, MAX_DEPTH = 72, 14
_MAX_LETTERS = 48
_ROW_IN, _GAP_IN, _HEAD_IN = 0.29, 0.30, 0.75
_NAME_PT, _SUM_PT, _WORDS_PT = 7.5, 6.0, 8.0
_PADS_IN = 2 * 3.0 / 72.0
"""What constrained layout keeps free at the sides [in]; without it a length in the axes is an inch."""
_EM = 0.602 / 72.0
"""Width of a DejaVu Sans Mono character [in] for each point of its size."""


@dataclass
class Limb:
    """A place in the drawn tree.

    Attributes
    ----------
    names
        Nonterminals that share it, the first one above the others.
    sums
        How their codons chose, ``codon mod alternatives = choice``.
    children
        Places below it.
    words
        What it became, if it is a leaf: text before, its own, and text behind.
    depth, row
        Where it is drawn.
    """

    names: list[str]
    sums: list[str] = field(default_factory=list)
    children: list[Limb] = field(default_factory=list)
    words: tuple[str, str, str] | None = None
    depth: int = 0
    row: float = 0.0

    @property
    def label(self) -> str:
        """Its nonterminals' names."""
        return " › ".join(self.names)

    @property
    def width_in(self) -> float:
        """How wide its words are [in]."""
        return _EM * max(_NAME_PT * len(self.label), _SUM_PT * len(" · ".join(self.sums)))


def tree_of(mapper: Mapper, codons: Sequence[int]) -> Figure:
    """Draw what a genome derives; see `tree`.

    Raises
    ------
    InputError
        If its derivation does not finish.
    """
    genome = np.asarray(codons)[None]
    mapped = mapper.map(genome)
    if not mapped.valid[0]:
        raise expected("genome", f"codons that run out after {mapped.used[0]}", "a derivation that finishes")
    detail = f"{mapped.used[0]} codons choose · codon mod alternatives = the one chosen, counted from 0"
    title = f"Derivation from {mapper.grammar.start}, grammar {mapper.grammar.source.rpartition('/')[2]}"
    return tree(mapped.tree(0), mapper.grammar, genome[0], title, detail)


def tree(
    nodes: Sequence[TreeNode],
    grammar: Grammar,
    codons: npt.NDArray[np.int64],
    title: str = "",
    detail: str = "",
) -> Figure:
    """Draw a derivation tree.

    Parameters
    ----------
    nodes
        Each before its children.
    grammar
        What they derive from.
    codons
        The genome (codons,).
    title, detail
        What to write above it.
    """
    limbs, folded = _limbs(nodes, grammar, codons)
    columns = _columns(limbs)
    words = max(sum(map(len, limb.words)) for limb in limbs if limb.words)
    width = max(
        columns[-1] + _EM * _WORDS_PT * words + 0.5, 0.085 * len(title) + 1.0, 0.058 * len(detail) + 0.8
    )
    height = _ROW_IN * (1 + max(limb.row for limb in limbs)) + _HEAD_IN + 0.2
    with look():
        figure = new_figure(width, height)
        headline(figure, title, f"{detail} · … {folded} parts folded away" if folded else detail)
        axes = figure.subplots()
        axes.set_axis_off()
        axes.set(xlim=(-0.2, width - 0.2 - _PADS_IN), ylim=((height - _HEAD_IN) / _ROW_IN - 0.5, -0.5))
        colours = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(grammar.nonterminals)}
        for limb in limbs:
            _draw(axes, limb, columns, colours)
    return figure


def _limbs(
    nodes: Sequence[TreeNode], grammar: Grammar, codons: npt.NDArray[np.int64]
) -> tuple[list[Limb], int]:
    """Lay out as much of a tree as can be read; return its places, and how many were folded."""
    texts = _texts(nodes)
    for deepest in range(MAX_DEPTH, -1, -1):
        limbs, folded = _grow(nodes, grammar, codons, texts, deepest)
        if sum(limb.words is not None for limb in limbs) <= MAX_ROWS:
            break
    row = 0
    for limb in limbs:
        if limb.words is not None:
            limb.row, row = row, row + 1
    for limb in reversed(limbs):
        if limb.children:
            limb.row = 0.5 * (limb.children[0].row + limb.children[-1].row)
    return limbs, folded


def _texts(nodes: Sequence[TreeNode]) -> list[str]:
    """Return the beginning of what each node became."""
    texts = [""] * len(nodes)
    for k in range(len(nodes) - 1, -1, -1):
        whole = "".join(part if isinstance(part, str) else texts[part] for part in nodes[k].parts)
        texts[k] = whole if len(whole) <= _MAX_LETTERS else whole[: _MAX_LETTERS - 1] + "…"
    return texts


def _grow(
    nodes: Sequence[TreeNode],
    grammar: Grammar,
    codons: npt.NDArray[np.int64],
    texts: list[str],
    deepest: int,
) -> tuple[list[Limb], int]:
    """Make the places down to a depth, each before its children, and count the folded ones."""
    root = last = Limb([])
    folded, before = 0, ""
    waiting: list[tuple[int, Limb] | str] = [(0, root)]
    while waiting:
        part = waiting.pop()
        if isinstance(part, str):  # behind a child, so there is a leaf
            assert last.words is not None
            last.words = (last.words[0], last.words[1], last.words[2] + part)
            continue
        number, limb = part
        _name(limb, nodes[number], grammar, codons)
        open_ = _open(limb, nodes[number], limb.depth == deepest or _is_number(texts[number]))
        if open_:
            while isinstance(open_[0], str):
                before += open_.pop(0)  # type: ignore[operator]
            waiting += open_[::-1]
        else:
            folded += any(isinstance(each, int) for each in nodes[number].parts) and not _is_number(
                texts[number]
            )
            limb.words, before, last = (before, texts[number], ""), "", limb
    return _in_order(root), folded


def _name(limb: Limb, node: TreeNode, grammar: Grammar, codons: npt.NDArray[np.int64]) -> None:
    """Write a node at a place."""
    limb.names.append(node.symbol)
    if node.codon is not None:
        choices = int(grammar.n_choices[grammar.nonterminals.index(node.symbol)])
        codon = int(codons[node.codon % len(codons)])
        limb.sums.append(f"{codon} mod {choices} = {codon % choices}")


def _open(limb: Limb, node: TreeNode, fold: bool) -> list[tuple[int, Limb] | str]:
    """Return what a node became, nonterminals with their places; nothing if it is a leaf here."""
    children = [part for part in node.parts if not isinstance(part, str)]
    if len(node.parts) == len(children) == 1:
        return [(children[0], limb)]
    if fold or not children:
        return []
    limb.children = [Limb([], depth=limb.depth + 1) for _ in children]
    below = iter(zip(children, limb.children, strict=True))
    return [part if isinstance(part, str) else next(below) for part in node.parts]


def _in_order(root: Limb) -> list[Limb]:
    """Return all places, each before its children, from the top."""
    found, waiting = [], [root]
    while waiting:
        found.append(waiting.pop())
        waiting += found[-1].children[::-1]
    return found


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _columns(limbs: Sequence[Limb]) -> list[float]:
    """Return where each depth begins [in], and at the end where the words do."""
    columns = [0.0]
    for depth in range(1 + max(limb.depth for limb in limbs)):
        columns.append(columns[-1] + _GAP_IN + max(limb.width_in for limb in limbs if limb.depth == depth))
    return columns


def _draw(axes: Axes, limb: Limb, columns: Sequence[float], colours: dict[str, str]) -> None:
    """Draw a place, and the lines that lead on from it."""
    x, end = columns[limb.depth], columns[limb.depth] + limb.width_in + 0.06
    mono: dict[str, Any] = {"family": "DejaVu Sans Mono"}
    up = 0.02 if limb.sums else 0.0
    colour = colours[limb.names[-1]]
    axes.text(
        x, limb.row - up, limb.label, color=colour, size=_NAME_PT, weight="bold",
        va="bottom" if limb.sums else "center", **mono,
    )  # fmt: skip
    axes.text(x, limb.row + 0.06, " · ".join(limb.sums), color=SOFT, size=_SUM_PT, va="top", **mono)
    if limb.words is not None:
        axes.plot([end, columns[-1] - 0.08], [limb.row] * 2, color=FAINT, linewidth=0.8, linestyle=":")
        _write(axes, columns[-1], limb, mono)
    middle = columns[limb.depth + 1] - 0.5 * _GAP_IN if limb.children else 0.0
    for child in limb.children:
        xs, ys = (
            [end, middle, middle, columns[child.depth] - 0.05],
            [limb.row, limb.row, child.row, child.row],
        )
        axes.plot(xs, ys, color=SOFT, linewidth=0.8, solid_joinstyle="round", zorder=0)


def _write(axes: Axes, x: float, limb: Limb, mono: dict[str, Any]) -> None:
    """Write a leaf's words, its own in bold between those that its parents put around them."""
    assert limb.words is not None
    before, own, behind = limb.words
    # Letters that do not belong to a text are spaces in it, so that both stand exactly where they should.
    around, inside = before + " " * len(own) + behind, " " * len(before) + own
    axes.text(x, limb.row, around, color=SOFT, size=_WORDS_PT, va="center", **mono)
    axes.text(x, limb.row, inside, color=INK, size=_WORDS_PT, va="center", weight="bold", **mono)
