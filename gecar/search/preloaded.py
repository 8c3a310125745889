"""What every worker needs, loaded by importing this; see `gecar.search.executors.prepare_workers`."""

from __future__ import annotations

import numpy as np

from gecar.language.opcodes import N_COLUMNS
from gecar.search.evaluation import DriveEvaluator
from gecar.world.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World

# One drive of a program without statements loads the compiled code, or compiles it once for all workers.
_EMPTY = np.zeros((0, N_COLUMNS), np.int32)
DriveEvaluator(World(load_robot("ev3"), load_course("paper")))([_EMPTY], [0])
