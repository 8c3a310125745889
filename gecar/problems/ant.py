"""The artificial ant on the Santa Fe trail (Koza, Genetic Programming, 1992, section 3.3.2).

The ant stands on a torus of 32 x 32 cells, 89 of which hold food, in the upper left corner and looks right. A program
moves it, turns it and looks whether there is food ahead; each move and turn takes a step, and the program starts again
at its end. After 615 steps the food it did not find is its error.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.language.mapping import Derivation

Int32s = npt.NDArray[np.int32]

STEPS = 615
"""As O'Neill and Ryan have it (2001); Koza has 400, White et al. (2013) 600."""
TRAIL = """
.###............................
...#............................
...#.....................###....
...#....................#....#..
...#....................#....#..
...####.#####........##.........
............#................#..
............#.......#...........
............#.......#...........
............#.......#........#..
....................#...........
............#...................
............#................#..
............#.......#...........
............#.......#.....###...
.................#.....#........
................................
............#...................
............#...#.......#.......
............#...#..........#....
............#...#...............
............#...#...............
............#.............#.....
............#..........#........
...##..#####....#...............
.#..............#...............
.#..............#...............
.#......#######.................
.#.....#........................
.......#........................
..####..........................
................................
"""
FOOD: npt.NDArray[np.bool_] = np.array([[cell == "#" for cell in line] for line in TRAIL.split()])
"""Where it lies at first (32, 32)."""
_PIECES = int(FOOD.sum())

LEFT, RIGHT, MOVE, LOOK, JUMP, END = range(6)
_WORDS = {"left;": LEFT, "right;": RIGHT, "move;": MOVE, "if(food_ahead){": LOOK, "}else{": JUMP, "}": END}
_WORD = re.compile(r"left;|right;|move;|if\(food_ahead\)\{|\}else\{|\}|\S")


@dataclass(frozen=True)
class Ant:
    """A program for the ant.

    Attributes
    ----------
    text
        As it was derived.
    rows
        What to do, and where to go on: a LOOK without food, a JUMP always (rows, 2).
    """

    text: str
    rows: Int32s = field(repr=False, compare=False)

    def __str__(self) -> str:
        return self.text


def read_ant(text: object) -> Ant | None:
    """Read a program; None where the text is none.

    Parameters
    ----------
    text
        ``left;``, ``right;``, ``move;`` and ``if(food_ahead){...}else{...}``, one after the other; or what has such a
        text by ``str``, as a `gecar.language.mapping.Derivation` has, so that this is a phenotype.
    """
    known = _known(text.mapped.mapper.words) if isinstance(text, Derivation) else None
    if known is not None and isinstance(text, Derivation):
        words = known[text.words]
    else:
        words = np.array([_WORDS.get(word, -1) for word in _WORD.findall(str(text))], np.int32)
    rows = _linked(words)
    return Ant(str(text), rows) if len(rows) else None


@lru_cache
def _known(words: tuple[str, ...]) -> Int32s | None:
    """Return what each word of a grammar is, where each is one of the language's: its text need not be read then."""
    found = [_WORDS.get(word.strip(), -1) for word in words]
    return np.array(found, np.int32) if min(found, default=-1) >= 0 else None


@compiled
def _linked(words: Int32s) -> Int32s:
    """Return a program's rows; none where branches are not whole, or nothing acts."""
    rows, waiting = np.empty((words.size, 2), np.int32), np.empty(words.size, np.int32)
    n, depth, acts = 0, 0, False
    for word in words:
        if word >= JUMP:  # the end of a branch: what leads past it, leads here
            if depth == 0 or rows[waiting[depth - 1], 0] != (LOOK if word == JUMP else JUMP):
                return rows[:0]
            depth -= 1
            rows[waiting[depth], 1] = n + (word == JUMP)
        if word < 0:
            return rows[:0]
        if word in (LOOK, JUMP):
            waiting[depth] = n
            depth += 1
        if word < END:
            rows[n, 0], rows[n, 1] = word, 0
            n += 1
        acts |= word <= MOVE
    return rows[:n] if acts and depth == 0 else rows[:0]


def missed(ant: Ant, steps: int = STEPS) -> int:
    """Return how many of the 89 pieces of food an ant does not find.

    Parameters
    ----------
    ant
        Its program.
    steps
        How many moves and turns it has.
    """
    return _PIECES - _eaten(ant.rows, FOOD.copy(), steps)


@compiled
def _eaten(rows: Int32s, food: npt.NDArray[np.bool_], steps: int) -> int:
    n = food.shape[0]
    y, x, down, right, eaten, row, idle = 0, 0, 0, 1, 0, 0, 0
    while steps > 0 and idle <= rows.shape[0]:  # a pass through branches without a step would never end
        code = rows[row, 0]
        idle += 1
        if code == JUMP or (code == LOOK and not food[(y + down) % n, (x + right) % n]):
            row = rows[row, 1]
        else:
            row += 1
        if code <= MOVE:
            steps -= 1
            idle = 0
        if code == LEFT:
            down, right = -right, down
        elif code == RIGHT:
            down, right = right, -down
        elif code == MOVE:
            y, x = (y + down) % n, (x + right) % n
            eaten += food[y, x]
            food[y, x] = False
        row = 0 if row == rows.shape[0] else row
    return eaten
