"""Texts people write: their line ends, and the line and column of a character, for errors."""

from __future__ import annotations


def plain(text: str) -> str:
    """Return a text without a byte order mark and with every line end a single newline."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def place(source: str, text: str, offset: int) -> str:
    """Name a place in a text.

    Parameters
    ----------
    source
        The file's name, or what stands for it.
    text
        The whole text.
    offset
        Index of the character in `text`.

    Returns
    -------
    str
        ``source, line 3, column 7``; both count from 1.
    """
    line = text.count("\n", 0, offset) + 1
    column = offset - text.rfind("\n", 0, offset)
    return f"{source}, line {line}, column {column}"
