"""Signals and worker processes: the parent alone answers Ctrl-C, always, and no worker outlives its parent."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

A_MOMENT = 0.01  # s; a deletion takes microseconds

_interrupted = threading.Event()


def remember_interrupts() -> None:
    """Let a Ctrl-C raise `KeyboardInterrupt`, as usual, and remember it for `raise_if_interrupted`.

    An extension module may drop the exception if it comes while the module asks Python for something, as many do while
    they are imported; once a run went on. Python itself drops it where an object is being deleted, and prints a
    traceback: there it is raised a moment later. A Ctrl-C that the shell has this process ignore stays ignored.
    """

    def remember(number: int, frame: FrameType | None) -> None:
        _interrupted.set()
        if _deletes(frame) and sys.platform != "win32":
            signal.signal(signal.SIGALRM, try_again)
            signal.setitimer(signal.ITIMER_REAL, A_MOMENT)
        else:
            signal.default_int_handler(number, frame)

    def try_again(number: int, frame: FrameType | None) -> None:
        if _interrupted.is_set():  # not answered by a loop meanwhile
            remember(number, frame)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, remember)


def _deletes(frame: FrameType | None) -> bool:
    """Whether a frame, or one that called it, is an object's `__del__`."""
    while frame is not None:
        if frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False


def raise_if_interrupted() -> None:
    """Raise `KeyboardInterrupt` if a Ctrl-C is remembered; to be called in every turn of a long loop."""
    if _interrupted.is_set():
        _interrupted.clear()
        raise KeyboardInterrupt


@contextmanager
def interrupts_told() -> Iterator[None]:
    """Raise `KeyboardInterrupt` for a Ctrl-C that came out as another exception, with the Ctrl-C as its cause.

    Numba makes it a `SystemError` if it is interrupted while it reads its arguments: it returns a result and leaves the
    exception set. Python before 3.12 makes it a `RuntimeError` while a class is made, as in a module that is imported.
    """
    try:
        yield
    except (SystemError, RuntimeError) as error:
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        raise KeyboardInterrupt from error


@contextmanager
def sigint_ignored() -> Iterator[None]:
    """Let processes started within never hear of Ctrl-C; this one hears of it afterwards, since it has to answer."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # noqa: PLC0415  not there on every system

    resource_tracker.ensure_running()  # starting it lets Ctrl-C through again, so it must not come later
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def start_worker() -> None:
    """Prepare a worker process: Ctrl-C is its parent's business, and it ends when its parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def end_late_workers_quietly() -> None:
    """Let a worker that starts only after its run was stopped end silently: the run's locks are gone by then.

    To be called in the fork server, which prints what a worker raises before it works; later errors go to the parent.
    """
    from multiprocessing import synchronize  # noqa: PLC0415  every command imports this module first

    usual = sys.excepthook

    def say(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        innermost = trace
        while innermost is not None and innermost.tb_next is not None:
            innermost = innermost.tb_next
        at = innermost.tb_frame.f_code.co_filename if innermost is not None else ""
        if not (kind is FileNotFoundError and at == synchronize.__file__):
            usual(kind, error, trace)

    sys.excepthook = say


def _end_with_parent() -> None:
    import multiprocessing  # noqa: PLC0415  every command imports this module first

    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
