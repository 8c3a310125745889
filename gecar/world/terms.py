"""Terms: missing physics written as laws, a part of the robot like any constant.

A robot file holds them as ``[[term]]`` tables::

    [[term]]
    port = "motor_torque"                   # where it acts: gecar.world.ports.PORTS
    law = "-a * speed * abs(speed)"         # variables: gecar.world.ports.VARIABLES
    a = 1.2e-5                              # the law's constants
    unit = "N m"                            # the port's; optional, checked

    [[term]]
    port = "motor_torque"
    side = "left"                           # of that wheel alone; or "right"; default "both"
    law = "-a * store * command"
    store = "square(command)"               # d store / dt = (square(command) - store) / store_s
    store_s = 12.0
    a = 0.05

A law is read by Python's own parser and turned into postfix tokens; it is never run as Python. ``at_x`` and ``at_y``
are the point that ``force_toward`` and ``pose_toward`` pull to, that ``pose_turn`` turns about, and that ``distance``
is measured from.
"""

from __future__ import annotations

import ast
import keyword
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, model_validator

from gecar.world.ports import (
    AT_A_POINT,
    AT_X,
    AT_Y,
    BY_PORT,
    CONSTANTS,
    FIRST_OPERATOR,
    FIRST_VARIABLE,
    FUNCTIONS,
    LAW,
    LENGTH,
    MOST_CONSTANTS,
    MOST_STORE_TOKENS,
    MOST_TOKENS,
    N_TERMS,
    OF_ITSELF,
    OF_TWO,
    OPERATOR,
    OPERATORS,
    PORT,
    PORT_NUMBER,
    SIDE,
    SIDES,
    STACK,
    STORE_LAW,
    STORE_LENGTH,
    STORE_S,
    TERM_WIDTH,
    VARIABLE,
    Port,
)

MOST_CHARACTERS = 300
_NUMBER = re.compile(r"(?<!\w)\.?\d")
POINT = ("at_x", "at_y")
_MARKS: Mapping[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}


_WORKED_OUT: Mapping[str, Any] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "min": np.minimum, "max": np.maximum,
    "/": lambda a, b: a / np.where(np.abs(b) > 1e-9, b, np.copysign(1e-9, b)),
    "negative": np.negative, "abs": np.abs, "sign": np.sign, "square": np.square, "sqrt": lambda a: np.sqrt(np.abs(a)),
    "exp": lambda a: np.exp(np.minimum(a, 50.0)), "sin": np.sin, "cos": np.cos, "tanh": np.tanh,
    "positive": lambda a: np.where(a > 0.0, 1.0, 0.0), "ramp": lambda a: np.maximum(a, 0.0),
}  # fmt: skip


@dataclass(frozen=True)
class Law:
    """A law as tokens.

    Attributes
    ----------
    tokens
        Constants' numbers, variables and operators, postfix.
    variables
        Those it looks at, in the order they are met.
    """

    tokens: tuple[int, ...]
    variables: tuple[str, ...]


@lru_cache(maxsize=4096)
def parse_law(text: str, port: Port, constants: tuple[str, ...], most: int) -> Law:
    """Read a law; the last few thousand that were read are kept.

    Parameters
    ----------
    text
        As in a robot file.
    port
        Where it acts.
    constants
        Names of its constants, in their order.
    most
        Tokens there is room for.

    Raises
    ------
    ValueError
        Where it is none: says what was found and what was expected.
    """
    if len(text) > MOST_CHARACTERS:
        raise ValueError(f"found a law of {len(text)} characters, expected at most {MOST_CHARACTERS}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"found law '{text}', expected a formula as -a * speed * abs(speed)") from None
    tokens = list(_postfix(tree, constants, port))
    if len(tokens) > most:
        raise ValueError(f"found a law of {len(tokens)} steps, expected at most {most}")
    if _deepest(tokens) > STACK:
        raise ValueError(
            f"found law '{text}', which holds more than {STACK} values at once: expected a shallower one"
        )
    looked_at = [k - FIRST_VARIABLE for k in tokens if FIRST_VARIABLE <= k < FIRST_OPERATOR]
    by_number = {number: name for name, number in VARIABLE.items()}
    return Law(tuple(tokens), tuple(dict.fromkeys(by_number[k] for k in looked_at)))


def _postfix(node: ast.AST, constants: Sequence[str], port: Port) -> Iterator[int]:
    """Yield a formula's tokens."""
    match node:
        case ast.BinOp(left, operator, right) if type(operator) in _MARKS:
            yield from _postfix(left, constants, port)
            yield from _postfix(right, constants, port)
            yield OPERATOR[_MARKS[type(operator)]]
        case ast.BinOp(base, ast.Pow(), ast.Constant(2)):
            yield from _postfix(base, constants, port)
            yield OPERATOR["square"]
        case ast.UnaryOp(ast.USub(), inner):
            yield from _postfix(inner, constants, port)
            yield OPERATOR["negative"]
        case ast.UnaryOp(ast.UAdd(), inner):
            yield from _postfix(inner, constants, port)
        case ast.Call(ast.Name(name), arguments, []) if name in FUNCTIONS:
            wanted = 2 if OPERATOR[name] < FIRST_OPERATOR + OF_TWO else 1
            if len(arguments) != wanted:
                raise ValueError(f"found {name} of {len(arguments)} values, expected {wanted}")
            for argument in arguments:
                yield from _postfix(argument, constants, port)
            yield OPERATOR[name]
        case ast.Name(name) if name in constants:
            yield list(constants).index(name)
        case ast.Name(name) if name in port.variables:
            yield FIRST_VARIABLE + VARIABLE[name]
        case _:
            raise _no_law(node, constants, port)


def _no_law(node: ast.AST, constants: Sequence[str], port: Port) -> ValueError:
    if isinstance(node, ast.Name):
        given = ", ".join(constants) or "none"
        return ValueError(
            f"found '{node.id}', expected a constant given with the law ({given}) "
            f"or a variable of {port.id}: {', '.join(port.variables)}"
        )
    found = ast.unparse(node) if isinstance(node, ast.expr) else type(node).__name__
    return ValueError(
        f"found '{found}', expected numbers, variables, + - * / ** 2 and {', '.join(FUNCTIONS)}"
    )


def _deepest(tokens: Sequence[int]) -> int:
    """Return how many values a law holds at most at once."""
    held = most = 0
    for token in tokens:
        held += 1 if token < FIRST_OPERATOR else -1 if token < FIRST_OPERATOR + OF_TWO else 0
        most = max(most, held)
    return most


class Term(BaseModel):
    """A law at a port.

    Attributes
    ----------
    port
        Where it acts.
    law
        What it gives there, in the port's unit.
    side
        Of which wheel; ``both`` where the port has two.
    store, store_s
        The law of what its store fills toward, and the store's time constant [s]; "": it has none.
    unit
        The port's; checked where it is given.

    What else is given is a constant of the law, by name.
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    port: str
    law: str
    side: Literal["both", "left", "right"] = "both"
    store: str = ""
    store_s: float = 1.0
    unit: str = ""

    @model_validator(mode="before")
    @classmethod
    def _with_numbers_named(cls, data: Any) -> Any:
        """Give the numbers written in a law names, so that all its constants are constants."""
        if not isinstance(data, Mapping) or not isinstance(data.get("law"), str):
            return data
        table = dict(data)
        for field in ("law", "store"):
            if isinstance(table.get(field), str) and len(table[field]) <= MOST_CHARACTERS:
                table[field], found = _named(table[field], table)
                table |= found
        if not table.get("unit") and table.get("port") in BY_PORT:
            table["unit"] = BY_PORT[table["port"]].unit
        return table

    @model_validator(mode="after")
    def _is_a_law(self) -> Term:
        if self.port not in BY_PORT:
            raise ValueError(f"found port '{self.port}', expected one of {', '.join(BY_PORT)}")
        port = BY_PORT[self.port]
        if self.unit != port.unit:
            raise ValueError(f"found unit '{self.unit}', expected that of {port.id}: {port.unit}")
        if self.side != "both" and not port.of_wheel:
            raise ValueError(f"found side '{self.side}', but {port.id} has no sides")
        self._check_constants()
        self._check_store(port)
        self.row  # noqa: B018 - a fault in a law is the file's
        return self

    def _check_constants(self) -> None:
        for name, value in self.constants.items():
            if name in VARIABLE or name in FUNCTIONS or not name.isidentifier() or keyword.iskeyword(name):
                raise ValueError(f"found constant '{name}', expected a name that is no variable or function")
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise ValueError(f"found {name} = {value!r}, expected a finite number")
        if len(self.free) > MOST_CONSTANTS:
            raise ValueError(f"found {len(self.free)} constants, expected at most {MOST_CONSTANTS}")
        if self.port in AT_A_POINT and set(POINT) - set(self.constants):
            raise ValueError(f"found {self.port} without at_x and at_y, expected both [m]")

    def _check_store(self, port: Port) -> None:
        if self.store and port.reads:
            raise ValueError(f"found a store at {port.id}, expected none at a sensor's port")
        if not 1e-3 <= self.store_s <= 1e4:
            raise ValueError(f"found store_s = {self.store_s:g}, expected 0.001 to 10000 s")
        if "store" in self.parsed.variables and not self.store:
            raise ValueError("found a law of 'store' without one, expected store = \"...\" and store_s")

    @property
    def constants(self) -> dict[str, float]:
        """Constants by name, the point on the floor included."""
        return dict(self.model_extra or {})

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the law's constants, in their order."""
        return tuple(name for name in self.constants if name not in POINT)

    @property
    def parsed(self) -> Law:
        """The law as tokens."""
        return parse_law(self.law, BY_PORT[self.port], self.free, MOST_TOKENS)

    @property
    def _store_law(self) -> Law:
        return (
            parse_law(self.store, BY_PORT[self.port], self.free, MOST_STORE_TOKENS)
            if self.store
            else Law((), ())
        )

    @property
    def of_itself(self) -> bool:
        """Whether the store's law looks at the store: it moves by its own law, as one that adds up or ramps does."""
        return "store" in self._store_law.variables

    @property
    def row(self) -> npt.NDArray[np.float64]:
        """The term as the kernels take it, shape (TERM_WIDTH,); see `gecar.world.ports`."""
        row = np.zeros(TERM_WIDTH)
        law, store = self.parsed.tokens, self._store_law.tokens
        row[[PORT, SIDE, LENGTH, STORE_LENGTH]] = (
            PORT_NUMBER[self.port],
            SIDES[self.side],
            len(law),
            len(store),
        )
        row[STORE_S], row[OF_ITSELF] = self.store_s, float(self.of_itself)
        row[AT_X], row[AT_Y] = (self.constants.get(name, 0.0) for name in POINT)
        for number, name in enumerate(self.free):
            row[CONSTANTS + number] = self.constants[name]
        row[LAW : LAW + len(law)] = law
        row[STORE_LAW : STORE_LAW + len(store)] = store
        return row

    def value(self, variables: Mapping[str, npt.NDArray[np.float64]]) -> npt.NDArray[np.float64]:
        """Return what the law gives where variables have some values, all of one shape, as the kernels do."""
        names, stack = list(VARIABLE), list[Any]()
        with np.errstate(all="ignore"):
            for token in self.parsed.tokens:
                if token < FIRST_VARIABLE:
                    stack.append(np.asarray(self.constants[self.free[token]], float))
                elif token < FIRST_OPERATOR:
                    stack.append(np.asarray(variables[names[token - FIRST_VARIABLE]], float))
                else:
                    operator = OPERATORS[token - FIRST_OPERATOR]
                    taken = [stack.pop() for _ in range(2 if token < FIRST_OPERATOR + OF_TWO else 1)][::-1]
                    stack.append(np.clip(np.nan_to_num(_WORKED_OUT[operator](*taken)), -1e6, 1e6))
        return np.asarray(stack.pop() + 0.0 * next(iter(variables.values())), float)

    @property
    def typeset(self) -> str:
        """The term as a formula with its numbers: ``motor_torque = -0.00012 speed |speed| [N m]``."""
        formula, filling = self.law, self.store
        for name, value in self.constants.items():
            formula, filling = (re.sub(rf"\b{name}\b", f"{value:.3g}", each) for each in (formula, filling))
        side = "" if self.side == "both" else f" ({self.side} wheel)"
        unit = "" if self.unit == "-" else f" [{self.unit}]"
        words = f"{self.port}{side} = {_pretty(formula)}{unit}"
        if filling.startswith("store + "):
            change = _pretty(filling.removeprefix("store + "))
            words += f", where store changes by {change} every {self.store_s:.3g} s"
        elif self.store:
            words += f", where store follows {_pretty(filling)} with a time constant of {self.store_s:.3g} s"
        if "at_x" in self.constants:
            word = "about" if self.port == "pose_turn" else "from"
            words += f", {word} ({self.constants['at_x']:.2f}, {self.constants['at_y']:.2f}) m"
        return words

    def with_constants(self, values: Mapping[str, float]) -> Term:
        """Return the term with other constants; ``store_s`` among them."""
        return Term(**{**self.as_table(), **values})

    def as_table(self) -> dict[str, Any]:
        """Return the term as a table of a robot file."""
        table: dict[str, Any] = {"port": self.port, "law": self.law}
        if self.side != "both":
            table["side"] = self.side
        if self.store:
            table |= {"store": self.store, "store_s": self.store_s}
        return {**table, **self.constants, "unit": self.unit}


def rows_of(terms: Sequence[Term]) -> npt.NDArray[np.float64]:
    """Return terms as the kernels take them, shape (N_TERMS, TERM_WIDTH)."""
    rows = np.zeros((N_TERMS, TERM_WIDTH))
    for k, term in enumerate(terms):
        rows[k] = term.row
    return rows


def formulas_of(physics: npt.NDArray[Any]) -> list[bytes]:
    """Return of each robot what its terms are but for constants: equal where laws differ in these alone.

    ``physics`` has dtype `gecar.world.effects.PHYSICS` and shape (n,), as in `ports_of`.
    """
    rows = physics["terms"].copy()
    rows[:, :, [STORE_S, AT_X, AT_Y, *range(CONSTANTS, LAW)]] = 0.0
    return [robot.tobytes() for robot in rows]


def ports_of(physics: npt.NDArray[Any]) -> list[bytes]:
    """Return of each robot where its terms act and what kind of store they have: what lanes of the kernel share."""
    rows = physics["terms"][:, :, [PORT, SIDE, OF_ITSELF, STORE_LENGTH]]
    rows[:, :, 3] = rows[:, :, 3] > 0.0
    return [robot.tobytes() + bytes([int(n)]) for robot, n in zip(rows, physics["n_terms"], strict=True)]


def _pretty(formula: str) -> str:
    """Return a formula as it would be printed."""
    formula = re.sub(r"abs\(([^()]+)\)", r"|\1|", formula)
    formula = re.sub(r"square\((\w+)\)", r"\1²", formula).replace(" ** 2", "²")
    return formula.replace(" * ", " ").replace("- -", "+ ").replace("+ -", "- ")


def _named(law: str, taken: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    """Return a law with names in the place of the numbers written in it, and those numbers by name."""
    if not _NUMBER.search(law):
        return law, {}
    try:
        tree = ast.parse(law.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return law, {}
    found: dict[str, float] = {}
    free = (f"k{n}" for n in range(1, 100) if f"k{n}" not in taken)

    class Name(ast.NodeTransformer):
        def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
            if isinstance(node.op, ast.Pow):
                node.left = self.visit(node.left)
                return node
            return self.generic_visit(node)

        def visit_Constant(self, node: ast.Constant) -> ast.AST:
            if isinstance(node.value, bool) or not isinstance(node.value, int | float):
                return node
            name = next(free)
            found[name] = float(node.value)
            return ast.Name(name, ast.Load())

    changed = Name().visit(tree)
    return (ast.unparse(changed), found) if found else (law, {})
