"""A table out of somebody's file: numbers in whatever units they have, under the names they have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gecar.reality.recordings.columns import Series


@dataclass(frozen=True)
class ForeignTable:
    """A table found in a file, one run's, as numbers in whatever units they have.

    Attributes
    ----------
    source
        The file.
    kind
        What it looks like, in words.
    names
        Column names as the file has them.
    values
        Shape (rows, columns); NaN where a cell is blank, or holds a word.
    remarks
        The file's lines that start with ``#``, without it.
    repairs
        What was left out, a line each.
    number
        Which of the file's runs it is, from 1; 0: the only one.
    """

    source: Path
    kind: str
    names: tuple[str, ...]
    values: Series
    remarks: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()
    number: int = 0

    @property
    def name(self) -> str:
        """The file's name, with the run's number where it holds several."""
        return f"{self.source.name}, run {self.number}" if self.number else self.source.name

    @property
    def stem(self) -> str:
        """Name of the recording that it makes."""
        return f"{self.source.stem}_{self.number}" if self.number else self.source.stem
