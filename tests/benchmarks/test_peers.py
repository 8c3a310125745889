"""The peers drive the robot that gecar drives, and map what gecar maps; those not installed are skipped."""

import math

import numpy as np
import pytest

from benchmarks.peers.control import Eye, drive
from benchmarks.peers.engines import ENGINES
from benchmarks.peers.mappers import LIBRARIES, agree, genomes
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import parse_program
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

COURSE, ROBOT = load_course("paper"), load_robot("ev3")
START = COURSE.start.x_m, COURSE.start.y_m, COURSE.start.heading_rad


@pytest.mark.parametrize(
    ("name", "module"), [("PyBullet", "pybullet"), ("MuJoCo", "mujoco"), ("pymunk", "pymunk")]
)
def test_an_engine_drives_the_same_arc(name, module):
    pytest.importorskip(module)
    opcodes = parse_program("motor(60,40,100)").opcodes
    x, y, _ = drive(ENGINES[name](ROBOT), Eye(COURSE, ROBOT), opcodes, START, 1.0)
    trace = simulate(World(ROBOT, COURSE), opcodes, trace=True).trace
    assert math.hypot(x - trace["x_m"][100], y - trace["y_m"][100]) < 0.01


@pytest.mark.parametrize(
    ("name", "module"), [("grape-bds", "grape"), ("alogos", "alogos"), ("finchge", "finchge")]
)
def test_a_library_maps_genomes_to_the_same_programs(name, module):
    pytest.importorskip(module)
    drawn = genomes(50, codons=200)
    text, grammar = LIBRARIES[name](), load_grammar("paper")
    both = [Mapper(grammar, MappingOptions(single_choice_consumes=consumes)) for consumes in (False, True)]
    codons, texts = np.array(drawn, np.uint8), [text(genome) for genome in drawn]
    assert max(agree(mapper.map(codons), texts) for mapper in both) == 1.0
