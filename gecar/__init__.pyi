from gecar.api import Run as Run
from gecar.api import Simulation as Simulation
from gecar.api import discover as discover
from gecar.api import evolve as evolve
from gecar.api import simulate as simulate
from gecar.errors import InputError as InputError
from gecar.language.grammar import load_grammar as load_grammar
from gecar.language.program import parse_program as parse_program
from gecar.language.program import read_program as read_program
from gecar.reality.recordings.recording import read_case as read_case
from gecar.reality.recordings.recording import read_recording as read_recording
from gecar.world.course.course import load_course as load_course
from gecar.world.robot import load_robot as load_robot

__version__: str
