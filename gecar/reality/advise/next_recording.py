"""The recording to make next: from a library of command sequences a robot can drive, the most informative one.

Each is driven by the robot as found and by its rival: the robot with the confused effect exchanged, with a parameter at
the end of its interval, or with an effect of which the recordings say nothing. Chosen is the sequence in which their
sensors differ most, in standard deviations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.parameters import free
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.kernel import HEADING, LEFT_ANGLE, RIGHT_ANGLE, X, Y
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.verdict import Found, Invented, Limit, NextRecording
from gecar.world.robot import Robot
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]
Commands = tuple[tuple[float, float, float], ...]

ROW_S = 0.01
START = (1.2, 0.6, 0.0)  # m, m, rad, where there is no course
LEAST_DIFFERENCE = 9.0  # squared standard deviations: less does not distinguish two robots


def _holds(length_s: float, *duties: tuple[float, float]) -> Commands:
    return tuple(
        (round(k * length_s, 2), left, right) for k, (left, right) in enumerate((*duties, (0.0, 0.0)))
    )


LIBRARY: dict[str, Commands] = {
    "straight at rising speeds": _holds(
        1.5, (15, 15), (25, 25), (40, 40), (55, 55), (-40, -40), (-55, -55), (-20, -20)
    ),
    "reversals": _holds(0.6, *((d, d) for d in (40, -40, 30, -30, 50, -50, 20, -20, 60, -60) for _ in (0,))),
    "spins at rising speeds": _holds(1.2, (15, -15), (30, -30), (50, -50), (70, -70), (-30, 30), (-60, 60)),
    "starts from rest at small duties": _holds(
        0.8, *(d for k in (6, 8, 10, 12, 16, 20) for d in ((k, k), (0, 0)))
    ),
    "arcs to both sides": _holds(1.5, (50, 20), (20, 50), (60, 30), (30, 60), (-50, -20), (-20, -50)),
    "full steps": _holds(0.7, *(d for k in (80, -80, 80, -80) for d in ((k, k), (0, 0), (k, -k), (0, 0)))),
    "long and slow, then long and fast": _holds(4.0, (25, 25), (-25, -25), (60, 60), (-60, -60)),
    "one motor at a time, then both": _holds(
        1.0, *(d for k in (30, 60, -45) for d in ((k, 0), (0, k), (k, k)))
    ),
    "the line, crossed to and fro": _holds(0.8, *((d, d) for d in (25, -25, 25, -25, 40, -40, 40, -40))),
}


def suggest(
    robot: Robot,
    found: Sequence[Found],
    rivals: Sequence[Robot],
    like: RecordingResiduals,
    unexplained: bool,
    laws: Sequence[Invented] = (),
    limits: Mapping[str, Limit | None] | None = None,
    about: str = "",
) -> NextRecording:
    """Return what to record next, and why.

    In this order: what shows the effect asked for; what distinguishes confused effects, or laws; what unexplained error
    depends on; what narrows an interval; what shows most of the effects of which these recordings say nothing.

    Parameters
    ----------
    robot
        As found.
    found
        Its effects.
    rivals
        Robots that do as well on these recordings, one for each effect that has alternatives.
    like
        A recording whose rig, sensors and course the next one will have.
    unexplained
        Whether something is left that nothing explains.
    laws
        Those that were written, parts of ``robot``.
    limits
        The smallest size of other effects that would have been seen; None: of them the recordings say nothing.
    about
        An effect to ask about; default: none in particular.
    """
    unseen = [effect for effect, limit in (limits or {}).items() if limit is None]
    name, why = "reversals", "nothing is missing so far; this stresses gears, friction and grip most"
    if about:
        name, why = _showing(robot, [about], like)
    elif rivals:
        confused = next(f for f in found if f.alternatives)
        name, told = _distinguishing(robot, rivals[0], like)
        why = f"{told} {confused.id} from {_listed(confused.alternatives)}"
    elif laws:
        name, why = _about_laws(robot, laws, like)
    elif unexplained:
        name = "long and slow, then long and fast"
        why = "shows whether the residual depends on speed, distance or time"
    elif found:
        name, _ = _telling(robot, _at_interval_end(robot, found[0]), like)
        why = f"narrows the interval of {found[0].id} further"
    elif unseen:
        name, why = _showing(robot, unseen, like)
    return NextRecording(f"{name}: {why}", LIBRARY[name])


def _showing(robot: Robot, effects: Sequence[str], like: RecordingResiduals) -> tuple[str, str]:
    """Return the sequence that shows most of some effects, each of a size worth a name, and which it shows."""
    rivals = {effect: _with_effect(robot, effect) for effect in effects}
    shown = {
        name: [e for e in effects if difference(commands, robot, rivals[e], like) >= LEAST_DIFFERENCE]
        for name, commands in LIBRARY.items()
    }
    best = max(shown, key=lambda name: len(shown[name]))
    if shown[best]:
        return best, f"would show {_listed(shown[best])}"
    return best, f"no sequence of the library shows {_listed(effects)} with these sensors"


def _distinguishing(robot: Robot, rival: Robot, like: RecordingResiduals) -> tuple[str, str]:
    """Return the sequence in which two robots part furthest, and whether that is far enough, as a verb."""
    name, apart = _telling(robot, rival, like)
    return name, "distinguishes" if apart >= LEAST_DIFFERENCE else "no sequence of the library distinguishes"


def _listed(effects: Sequence[str]) -> str:
    *others, last = effects
    return f"{', '.join(others)} and {last}" if others else last


def _with_effect(robot: Robot, effect: str) -> Robot:
    """Return a robot with one more effect, of a size worth a name."""
    parameters = free(robot, [effect])
    z = parameters.vector({})
    z[0] = 1.0 if parameters.bounds[1][0] >= 1.0 else -1.0
    return robot.with_effects(parameters.values(z))


def _at_interval_end(robot: Robot, found: Found) -> Robot:
    """Return a robot with an effect's first parameter at the end of its interval."""
    label, interval = next(iter(found.parameters.items()))
    values = {name: i.value for name, i in found.parameters.items()}
    return robot.with_effects({found.id: {**values, label: interval.high}})


def _about_laws(robot: Robot, laws: Sequence[Invented], like: RecordingResiduals) -> tuple[str, str]:
    """Return what tells a law from one that does as well at another port, or else knows its constants better."""
    doubtful = next((law for law in laws if law.alternatives), None)
    if doubtful is None:
        name, _ = _telling(robot, _with_law(robot, laws[0].term, _at_end(laws[0])), like)
        return name, f"narrows the constants of the law at {laws[0].term.port} further"
    law, other = doubtful.term, doubtful.alternatives[0]
    name, told = _distinguishing(robot, _with_law(robot, law, other), like)
    return name, f"{told} a law at {law.port} from one at {other.port}"


def _with_law(robot: Robot, law: Term, other: Term) -> Robot:
    """Return a robot with another law in the place of one of its own."""
    return robot.with_terms([other if term == law else term for term in robot.term])


def _at_end(law: Invented) -> Term:
    """Return a law with its first constant at the end of its interval."""
    name, interval = next(iter(law.parameters.items()))
    return law.term.with_constants({name: interval.high})


def _telling(robot: Robot, rival: Robot, like: RecordingResiduals) -> tuple[str, float]:
    """Return the sequence in which two robots part furthest, and how far [squared standard deviations]."""
    apart = {name: difference(commands, robot, rival, like) for name, commands in LIBRARY.items()}
    best = max(apart, key=lambda name: apart[name])
    return best, apart[best]


def difference(commands: Commands, robot: Robot, rival: Robot, like: RecordingResiduals) -> float:
    """Return how far apart two robots' recordings of a command sequence lie, in squared standard deviations.

    What encoders and camera would measure of the first is replayed by the second; what the colour sensors of both would
    read is compared along the first one's path, on the course of a recording that read one.
    """
    course, noise, run = like.course, like.noise, like.recording
    start = START if course is None else (course.start.x_m, course.start.y_m, course.start.heading_rad)
    rows = replayer_of(_recording(commands, {}, run), noise.sd).play(robot.physics, np.array(start)).rows
    angles = {
        "left_angle_deg": np.degrees(rows[:, LEFT_ANGLE]),
        "right_angle_deg": np.degrees(rows[:, RIGHT_ANGLE]),
    }
    poses = {"x_m": rows[:, X], "y_m": rows[:, Y], "heading_deg": np.degrees(rows[:, HEADING])}
    measured = {**angles, **(poses if run.setup.rig == "floor" else {})}
    replayer = replayer_of(_recording(commands, measured, run), noise.sd, noise.walk, memory_s=1.0)
    found = replayer.play(rival.physics)
    apart = float(np.nansum(found.row_errors[:, :2] ** 2) + np.nansum(found.pose_errors**2))
    if course is None:
        return apart
    path = np.ascontiguousarray(rows[:, [X, Y, HEADING]])
    own, other = (
        readings_along(replayer.t, path, 0.0, noise.reflection_sd, course.surface, each.physics, np.zeros(3))
        for each in (robot, rival)
    )
    return apart + float(np.sum((own - other) ** 2)) / noise.reflection_sd**2


def _recording(commands: Commands, seen: dict[str, Array], like: Recording) -> Recording:
    table = np.array(commands)
    t = np.arange(0.0, table[-1, 0] + 0.5, ROW_S)
    at = np.searchsorted(table[:, 0], t, side="right") - 1
    duties = {"left_duty_pct": table[at, 1], "right_duty_pct": table[at, 2]}
    return make_recording(
        "next", {"t_s": t, **duties, **seen}, Setup(rig=like.setup.rig, duty_cap=like.setup.duty_cap)
    )
