"""The one kind of error a user can cause and mend."""

from __future__ import annotations

from pathlib import Path


class InputError(ValueError):
    """Something handed to gecar is not what it must be; the message is one line a user can act on.

    Control characters in what it quotes, a line end in a file's name say, are spelt out.
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
        What stands there.
    wanted
        What should.

    Returns
    -------
    InputError
        ``where: found …, expected …``; raise it.
    """
    return InputError(f"{where}: found {found}, expected {wanted}")
