"""The command line: ``python -m gecar``, or ``gecar`` where it is installed."""

from __future__ import annotations

import io
import os
import sys

from gecar.errors import InputError

REPORT = "Please report this with the command you typed; GECAR_DEBUG=1 shows where it happened."


def main() -> None:
    """Run the command line; exit code 0, 2 for a bad input, 130 for Ctrl-C, 1 for a fault of gecar's own."""
    _print_anywhere()
    try:
        from gecar.parallel.signals import (  # noqa: PLC0415  an interrupt now is caught, too
            interrupts_told,
            remember_interrupts,
        )

        remember_interrupts()
        with interrupts_told():
            from gecar.cli.application import application  # noqa: PLC0415

            application()()
    except InputError as error:
        _end(f"error: {error}", 2)
    except KeyboardInterrupt:
        _end("stopped", 130)
    except OSError as error:  # a file or folder that cannot be read or written, a full disk
        if os.environ.get("GECAR_DEBUG"):
            raise
        _end(f"error: {error.filename or 'files'}: {error.strerror or error}", 2)
    except Exception as error:  # the last place before the user: a traceback only for who asks
        if os.environ.get("GECAR_DEBUG"):
            raise
        _end(f"internal error: {type(error).__name__}: {error}\n{REPORT}", 1)


def _print_anywhere() -> None:
    """Let what a stream's encoding lacks, as → on Windows, come out as a question mark, and not as an error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _end(words: str, code: int) -> None:
    print(words, file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
