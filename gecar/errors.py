"""Errors in input, which a user can correct."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


class InputError(ValueError):
    """An input is not valid; the message is one line that says how to correct it.

    Control characters in quoted input, such as a line end in a file's name, are escaped.
    """

    def __init__(self, message: str) -> None:
        super().__init__("".join(c if c.isprintable() else repr(c)[1:-1] for c in message))


def expected(where: str | Path, found: object, wanted: str) -> InputError:
    """Make the error for a bad input.

    Parameters
    ----------
    where
        File with its line or field, or the option: ``grammars/paper.bnf, line 3`` or ``--workers``.
    found
        What was found there.
    wanted
        What was expected.

    Returns
    -------
    InputError
        ``where: found …, expected …``; raise it.
    """
    return InputError(f"{where}: found {found}, expected {wanted}")


def one_of(where: str | Path, found: str, known: Iterable[str], wanted: str = "") -> InputError:
    """Make the error for an unknown name; it suggests the most similar one.

    Parameters
    ----------
    where
        As in `expected`.
    found
        The name that was found.
    known
        The known names.
    wanted
        What else is accepted, such as ``a course file (.toml)``.
    """
    names = list(known)
    near = difflib.get_close_matches(found, names, 1, 0.6)
    asked = f"; did you mean '{near[0]}'?" if near else ""
    other = f"{wanted} or " if wanted else ""
    return expected(where, f"'{found}'", f"{other}one of {', '.join(names)}{asked}")


def first_fault(error: ValidationError, where: str | Path, fields: str, *, between: str = ", ") -> InputError:
    """Make the error for the first fault pydantic found in a table.

    Parameters
    ----------
    error
        What it raised.
    where
        File, or table, the fields stand in.
    fields
        Which ones there are, for a field that is none of them.
    between
        What stands between `where` and the field's name.
    """
    fault = error.errors(include_url=False)[0]
    field = _field_name(fault["loc"])
    place = f"{where}{between}{field}" if field else where
    message = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if message.startswith("found "):
        return InputError(f"{place}: {message}")
    if fault["type"] == "missing":
        return expected(place, "nothing", "a value")
    if fault["type"] == "extra_forbidden":
        return expected(place, "an unknown field", fields)
    return expected(place, _short(fault["input"]), message)


def _field_name(parts: tuple[int | str, ...]) -> str:
    """Return ``obstacles[0].mass_kg`` for ("obstacles", 0, "mass_kg")."""
    shown = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts)
    return "".join(shown).removeprefix(".")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
