"""What every worker needs, loaded by importing this; see `gecar.parallel.executors.prepare_workers`."""

from __future__ import annotations

import os
import threading

from gecar.parallel.signals import end_late_workers_quietly

_LOOK_EVERY_S = 0.2


def load() -> None:
    """Drive a program without statements: it loads the compiled code, or compiles it once for all workers."""
    import numpy as np  # noqa: PLC0415  all this takes time, in which the parent may end

    from gecar.language.opcodes import N_COLUMNS  # noqa: PLC0415
    from gecar.world.course.course import load_course  # noqa: PLC0415
    from gecar.world.robot import load_robot  # noqa: PLC0415
    from gecar.world.rollout import World, simulate_many  # noqa: PLC0415

    empty = np.zeros((0, N_COLUMNS), np.int32)
    simulate_many(World(load_robot("ev3"), load_course("paper")), [empty])


def _end_with(parent: int, loaded: threading.Event) -> None:
    """End this process with its parent, as long as it is still loading; afterwards the fork server sees to that."""
    while not loaded.wait(_LOOK_EVERY_S):
        if os.getppid() != parent:
            os._exit(1)


end_late_workers_quietly()
_loaded = threading.Event()
_watch = threading.Thread(target=_end_with, args=(os.getppid(), _loaded), daemon=True)
_watch.start()
try:
    load()
finally:
    _loaded.set()
    _watch.join()  # workers are forked from this process, which must have no other thread by then
