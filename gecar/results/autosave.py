"""Saving a run while it goes on, for a small and bounded share of its time."""

from __future__ import annotations

import signal
import sys
import threading
import time
from contextlib import suppress

from gecar.calling import command
from gecar.errors import InputError
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.state import State
from gecar.language.program import Program
from gecar.results.folder import RunFolder

SHARE = 0.02
"""Largest share of the time that checkpoints may take; slower generations than 50 ms are all saved."""
REPORT_EVERY_S = 2.0
"""How often history.csv and best.txt are written while a run goes on [s]."""


class Saver:
    """Keeps a run's folder up to date.

    Parameters
    ----------
    folder
        The run's.
    evolution
        What is saved.
    configuration
        What its checkpoints belong to.
    """

    def __init__(self, folder: RunFolder, evolution: Evolution[Program], configuration: str) -> None:
        self.folder, self.evolution, self.configuration = folder, evolution, configuration
        self._unsaved: State | None = (
            None  # taken between two generations, whatever may interrupt the next one
        )
        self._next_save = time.monotonic()
        self._next_report = self._next_save + REPORT_EVERY_S

    def __call__(self) -> None:
        """Save after a generation, unless the last checkpoint was only just written."""
        self._unsaved = self.evolution.state()
        began = time.monotonic()
        if began >= self._next_save:
            self.save()
            now = time.monotonic()
            self._next_save = now + (now - began) / SHARE
        if time.monotonic() >= self._next_report:
            self.folder.write_reports(self.evolution, durable=False)
            self._next_report = time.monotonic() + REPORT_EVERY_S

    def save(self) -> None:
        """Write the checkpoint, if it is not written yet.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        if self._unsaved is not None:
            self.folder.save(self._unsaved, self.configuration)
            self._unsaved = None

    def leave(self) -> None:
        """Save at a Ctrl-C and say how to go on; a second Ctrl-C does not cut this short."""
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        self.save()
        last, generations = self.evolution.generation, self.evolution.settings.generations
        done = (
            f"after generation {last} of {generations}; it is saved"
            if last >= 0
            else "before the first generation"
        )
        words = f"stopped {done}. Go on with: {command()} evolve --resume --out {self.folder.path}"
        print(words, file=sys.stderr, flush=True)
        with suppress(InputError):  # what counts is saved
            self.folder.write_reports(self.evolution)
