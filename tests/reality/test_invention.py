"""Laws that are written: found again where the simulated robot has one, and none where there is only noise.

The proof that counts is on recordings of other worlds: ``python -m benchmarks.invention``.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded
from test_location import seen_on_the_course

from gecar.cli.actions.discover import draw
from gecar.errors import InputError
from gecar.language.grammar import parse_grammar
from gecar.plots.reality.law import along_ways, laws_figure, laws_map_figure
from gecar.plots.reality.verdict import verdict_drawings, verdict_tables
from gecar.plots.style import is_whole
from gecar.reality import discovery
from gecar.reality.compare.choices import Told
from gecar.reality.discovery import discover
from gecar.reality.invent import beside, invention
from gecar.reality.invent.looks import looks_like
from gecar.reality.invent.proof import left_out_gains, simplified
from gecar.reality.invent.search import Library, fit, search
from gecar.reality.invent.sentences import (
    complexity,
    elsewhere,
    joined,
    key,
    looking_at,
    physics_grammar,
    pieces,
    read_sentence,
    single_laws,
)
from gecar.reality.invent.written import Written
from gecar.reality.materiality import DEFAULT
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.recordings.recording import Case, read_case
from gecar.reality.residuals.of_case import motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.reality.selection import problem as selection_problem
from gecar.reality.selection.observability import observable
from gecar.reality.selection.problem import problem_of
from gecar.reality.selection.share import Share
from gecar.reality.selection.stepwise import concluded, explain
from gecar.reality.selection.thresholds import PRICE
from gecar.report.verdict import sentences
from gecar.report.verdict_page import verdict_html
from gecar.world.effects import BY_ID, CATALOGUE
from gecar.world.ports import PORTS
from gecar.world.robot import read_robot, write_robot
from gecar.world.terms import POINT, Term

FEW = parse_grammar(
    """
    <term> ::= supply_voltage: <s> | motor_torque: <w> | force_x and force_y: <p> | yaw_moment: <y> | pose_x: <p>
    <s> ::= c * 1 | c * draw | c * time
    <w> ::= c * <f> | c * <f> + c * <f>
    <f> ::= speed | speed * abs(speed) | sign(speed) | command | sin(2 * angle)
    <p> ::= c * 1 | c * x | c * y
    <y> ::= c * turn_rate | c * 1
    """
)
PRACTICE = Path(__file__).parents[3] / "shared" / "recordings" / "practice" / "p03"
needs_practice = pytest.mark.skipif(
    not PRACTICE.is_dir(), reason="the practice cases (../shared/recordings) are not here"
)
UNRELATED = [effect for effect in CATALOGUE if effect.id in ("clock_skew", "pose_delay", "start_latency")]


def robot_with(*tables):
    return EV3.with_terms([Term(**table) for table in tables])


@cache
def verdict_on(*tables, invents=False, language=FEW, seeds=5):
    robot = robot_with(*map(dict, tables))
    runs = tuple(recorded(robot, seed) for seed in range(seeds))
    return discover(Case("made", runs), catalogue=UNRELATED, language=language, invents=invents)


def frozen(**table):
    return tuple(table.items())


SAG = frozen(port="supply_voltage", law="-c1 * draw", c1=1.5)
DRAG = frozen(port="motor_torque", law="c1 * speed * abs(speed)", c1=-3e-4)
TILT = frozen(port="force_x", law="c1", c1=0.2), frozen(port="force_y", law="c1", c1=-0.15)
SCRUB = frozen(port="yaw_moment", law="c1 * turn_rate", c1=-0.01)


@pytest.mark.parametrize("hidden", [(SAG,), (DRAG,), TILT, (SCRUB,)], ids=["sag", "drag", "tilt", "scrub"])
def test_a_hidden_law_is_written_anew_and_closes_the_gap(hidden):
    verdict = verdict_on(*hidden)
    assert verdict.verdict == "invented"
    assert verdict.effects == ()
    wanted = {dict(table)["port"]: dict(table) for table in hidden}
    assert {law.term.port for law in verdict.invented} == set(wanted)
    for law in verdict.invented:
        table = wanted[law.term.port]
        true = -table["c1"] if table["law"].startswith("-") else table["c1"]
        found = law.parameters["c1"]
        assert found.low < found.value < found.high
        assert found.value == pytest.approx(true, rel=0.05)
        assert set(law.term.parsed.variables) == set(Term(**table).parsed.variables)
        assert law.left_out_gain > law.null_95
        assert law.holdout_gain > 0.0
    assert verdict.judgement.gap_closed > 0.9
    assert verdict.next_recording.why.endswith(f"the law at {verdict.invented[0].term.port} further") or any(
        law.alternatives for law in verdict.invented
    )
    assert not set(verdict.fitted_on) & set(verdict.judgement.recordings)


HIDDEN_FROM_DERIVATIVES = parse_grammar(
    """
    <term> ::= tyre_grip: c * <f> | wheel_load: c * <f> | command: c * <lost> | motor_torque: c * speed
    <f> ::= 1 | x | sin(10 * y)
    <lost> ::= command * positive(<low> - abs(command)) | sign(command) * min(abs(command), <low>) | command
    <low> ::= 0.15 | 0.25
    """
)
GRIP = frozen(port="tyre_grip", law="c1", c1=-0.75)
THRESHOLD = frozen(port="command", law="-command * positive(k1 - abs(command))", k1=0.25)


@pytest.mark.parametrize(("hidden", "size"), [(GRIP, -0.75), (THRESHOLD, -1.0)], ids=["grip", "threshold"])
def test_what_has_no_derivative_at_none_is_found_by_finite_probes(hidden, size):
    verdict = verdict_on(hidden, language=HIDDEN_FROM_DERIVATIVES)
    (law,) = verdict.invented
    assert law.term.port == dict(hidden)["port"]
    assert law.parameters["c1"].value == pytest.approx(size, rel=0.05)
    assert set(law.parameters) == set(law.term.constants)
    assert law.spread < 0.1


def library_of(*tables, rig="floor"):
    return library_on([recorded(robot_with(*map(dict, tables)), seed, rig=rig) for seed in range(5)])


def library_on(runs):
    fitted = motion_of(runs)
    problem = problem_of(fitted, EV3, observable(UNRELATED, fitted))
    problem = problem.under(problem.known)
    return Library(problem, problem.known)


def test_a_force_comes_from_a_point_that_is_known():
    """A cable tells where it is tied; what is felt within 13 mm of a point that no drive came near may be anywhere."""
    cable = {"port": "force_toward", "law": "c1 * distance", "c1": 0.8, "at_x": 1.5, "at_y": 0.4}
    felt = {
        "port": "force_toward",
        "law": "c1 * exp(-distance / k1)",
        "c1": -1.0,
        "k1": 0.05,
        "at_x": 1.2,
        "at_y": 0.5,
    }
    library = library_of(cable)
    assert invention._from_a_point(library, fit(library, (Term(**cable),)))
    assert not invention._from_a_point(library, fit(library, (Term(**felt),)))
    assert invention._from_a_point(library, fit(library, (Term(**dict(DRAG)),)))


def test_a_camera_that_drifts_does_not_turn_about_a_point_far_off():
    """What a carpet's nap did was told as a camera that turns by -1.1 mrad/s (-3.2 to 1.1) about a point 4 m off."""
    runs = [recorded(EV3, seed) for seed in range(4)]
    near = Term(port="pose_turn", law="c1 * time", c1=0.004, at_x=1.1, at_y=0.6)
    far = Term(port="pose_turn", law="c1 * time", c1=-0.001, at_x=-1.7, at_y=4.0)
    turning, drifting = (
        library_on([seen(run) for run in runs])
        for seen in (lambda run: turned(run, 0.004), lambda run: replace(run, x_m=run.x_m + 0.003 * run.t_s))
    )
    assert invention._turns(turning, fit(turning, (near,)))
    assert not invention._turns(drifting, fit(drifting, (far,)))


def turned(run, rate_rad_s):
    """A drive as a camera saw it that turned about (1.1, 0.6) m."""
    x, y, angle = run.x_m - 1.1, run.y_m - 0.6, rate_rad_s * run.t_s
    cos, sin = np.cos(angle), np.sin(angle)
    return replace(
        run, x_m=1.1 + x * cos - y * sin, y_m=0.6 + x * sin + y * cos, heading_rad=run.heading_rad + angle
    )


def test_a_part_that_left_out_recordings_do_not_ask_for_is_dropped():
    library = library_of(DRAG)
    sum_of_three = "motor_torque: c * speed * abs(speed) + c * sin(2 * angle) + c * cos(3 * angle)"
    law = fit(library, library.started(read_sentence(sum_of_three)))
    assert [term.law for term in simplified(library, law)[0].terms] == ["c1 * speed * abs(speed)"]


def test_a_language_without_laws_of_what_was_measured_finds_none_and_says_so():
    told = list[str]()
    language = parse_grammar("<t> ::= motor_torque: a")
    assert search(library_on([recorded(EV3, 0)]), language, ["colour_reading"], tell=told.append) == []
    assert told == [f"{language.source} has no law of what is left here: none at colour_reading"]


def test_a_form_that_the_grid_of_points_hides_is_found_at_the_point_of_another():
    """A camera's lens, of the third power: from the only point where the grid has it, its fit ends elsewhere."""
    runs, at = [], np.array([1.2, 0.3])
    for seed in range(5):
        run = recorded(EV3, seed)
        off = np.stack([run.x_m, run.y_m], axis=1) - at
        seen = at + off * (1.0 + 0.25 * np.sum(off**2, axis=1, keepdims=True))
        runs.append(replace(run, x_m=seen[:, 0], y_m=seen[:, 1]))
    square, third = "c * distance ** 2; at: 1.0 0.5", "c * distance * distance ** 2; at: -0.5 2.5"
    language = parse_grammar(f"<t> ::= pose_toward: {square} | pose_toward: {third}")
    (best,) = search(library_on(runs), language, ["pose_toward"])[0].terms
    assert best.law == "c1 * distance * distance ** 2"
    assert best.constants["c1"] == pytest.approx(-0.25, rel=0.05)
    assert [best.constants[name] for name in POINT] == pytest.approx(at, abs=0.02)


TOOTH = frozen(
    port="gear_friction",
    law="c1 * exp(k1 * cos(angle - k2))",
    c1=0.03 * np.exp(-9.0),
    k1=9.0,
    k2=1.2,
    side="right",
)
TEETH = parse_grammar(
    """
    <term> ::= gear_friction: c * exp(4 * cos(angle - <turned>)); side: <side> | gear_friction: c * <f>
    <f> ::= 1 | side * 1 | abs(sin(1 * angle)) | side * abs(sin(1 * angle))
    <turned> ::= 0.8 | 2.4 | 3.9 | 5.5
    <side> ::= left | right
    """
)


def test_a_gear_that_sticks_at_one_angle_of_the_turn_is_found():
    (law,) = verdict_on(TOOTH, language=TEETH).invented
    assert law.looks_like == "a gear that sticks at one angle of a turn, on the right wheel alone"
    assert law.parameters["k2"].value == pytest.approx(1.2, abs=0.05)
    turn = {"angle": np.linspace(0.0, 2.0 * np.pi, 200)}
    assert law.term.value(turn).mean() == pytest.approx(Term(**dict(TOOTH)).value(turn).mean(), rel=0.1)


FAINT_RIPPLE = frozen(port="motor_torque", law="c1 * sin(2 * angle)", c1=1.5e-3)


def test_on_a_bench_a_part_that_brings_little_of_the_gain_is_dropped():
    library = library_of(DRAG, FAINT_RIPPLE, rig="bench")
    whole = fit(
        library, library.started(read_sentence("motor_torque: c * speed * abs(speed) + c * sin(2 * angle)"))
    )
    law, gains = simplified(library, whole)
    assert [term.law for term in law.terms] == ["c1 * speed * abs(speed)"]
    assert left_out_gains(library, whole).sum() - gains.sum() > PRICE


def test_on_a_bench_laws_are_written_as_long_as_each_is_proved():
    faint = frozen(port="motor_torque", law="c1 * speed * abs(speed)", c1=-4e-6)  # 2 mm in a metre
    runs = tuple(recorded(robot_with(dict(SAG), dict(faint)), seed, rig="bench") for seed in range(5))
    verdict = discover(Case("motor", runs), catalogue=UNRELATED, language=FEW, invents=True)
    assert [law.term.port for law in verdict.invented] == ["supply_voltage", "motor_torque"]
    assert verdict.invented[1].parameters["c1"].value == pytest.approx(-4e-6, rel=0.2)


ONE_MOTOR = parse_grammar(
    """
    <term> ::= motor_torque: c * <f> | motor_torque: c * sin(1 * angle) + c * cos(1 * angle); side: each
    <f> ::= speed * abs(speed) | side * speed * abs(speed) | other_speed | load | turn_rate | x | command
    """
)


def test_of_one_motor_on_a_bench_no_law_speaks_of_the_other_side_or_the_floor():
    runs = [recorded(robot_with(dict(DRAG)), seed, rig="bench") for seed in range(5)]
    alone = tuple(replace(run, right_angle_rad=np.full(len(run.t_s), np.nan)) for run in runs)
    (law,) = discover(Case("motor", alone), catalogue=UNRELATED, language=ONE_MOTOR, invents=True).invented
    assert law.term.law == "c1 * speed * abs(speed)"
    assert law.parameters["c1"].value == pytest.approx(-3e-4, rel=0.05)
    assert {term.law for term in law.alternatives} == set()


WHEELS_AND_LAG = parse_grammar(
    """
    <term> ::= rolling_radius: c * sin(1 * angle) + c * cos(1 * angle); side: each | rolling_radius: c * 1
             | motor_torque: c * speed | command: c * (store - command); store: command; store_s: 0.1
    """
)
OFF_CENTRE = (
    frozen(port="rolling_radius", law="c1 * sin(angle)", c1=0.08, side="left"),
    frozen(port="rolling_radius", law="c1 * cos(angle)", c1=-0.05, side="right"),
)
LAG = frozen(port="command", law="c1 * (store - command)", c1=1.0, store="command", store_s=0.07)


def test_each_wheel_has_a_law_of_its_own_that_comes_back_once_a_turn():
    verdict = verdict_on(*OFF_CENTRE, invents=True, language=WHEELS_AND_LAG)
    found = {law.term.side: law for law in verdict.invented}
    assert set(found) == {"left", "right"}
    for side, part, size in (("left", "sin", 0.08), ("right", "cos", -0.05)):
        term = found[side].term
        assert f"{part}(k1 * angle)" in term.law
        assert term.constants["k1"] == 1.0
        assert found[side].parameters["c1"].value == pytest.approx(size, rel=0.05)


@pytest.mark.parametrize("share", [Share(1.0, 0.9, 1.1), Share(0.6, 0.3, 0.9)], ids=["all of it", "part"])
def test_a_law_that_hardly_helps_whole_drives_is_written_only_where_all_of_it_is_asked_for(
    monkeypatch, share
):
    monkeypatch.setattr(invention, "gaps", lambda *_: (1.0, 0.9))
    monkeypatch.setattr(invention, "share_asked_for", lambda *_: share)
    runs = tuple(recorded(robot_with(dict(SCRUB)), seed) for seed in range(5))
    verdict = discover(Case("made", runs), catalogue=UNRELATED, language=FEW, invents=True)
    assert bool(verdict.invented) == share.is_whole


def test_commands_that_act_late_are_written_as_such():
    (law,) = verdict_on(LAG, language=WHEELS_AND_LAG).invented
    assert law.looks_like == "commands that act late, by about 70 ms"
    assert law.parameters["c1"].value == pytest.approx(1.0, rel=0.05)
    assert law.parameters["store_s"].value == pytest.approx(0.07, rel=0.05)


@pytest.fixture
def hidden_by_effects(monkeypatch):
    """Laws are found where no effect was named, and nowhere else."""
    invent = discovery.invent

    def without_effects(explained, *args):
        return Written(explained, (), ()) if explained.taken.effects else invent(explained, *args)

    monkeypatch.setattr(discovery, "invent", without_effects)


def late_and_imitated(**language):
    runs = tuple(recorded(robot_with(dict(LAG)), seed) for seed in range(5))
    catalogue = [effect for effect in CATALOGUE if effect.id in ("rotor_inertia", "pose_delay")]
    return discover(Case("lag", runs), catalogue=catalogue, **language)


@pytest.mark.parametrize("without", [False, True], ids=["beside", "instead"])
def test_laws_take_the_place_of_an_effect_that_imitates_them(request, without):
    """The effect goes where the law is found beside it, and where it is found without the effect alone."""
    if without:
        request.getfixturevalue("hidden_by_effects")
    assert "rotor_inertia" in [found.id for found in late_and_imitated().effects]
    verdict = late_and_imitated(language=WHEELS_AND_LAG, invents=True)
    assert verdict.effects == ()
    assert [law.term.port for law in verdict.invented] == ["command"]


@pytest.mark.usefixtures("hidden_by_effects")
@pytest.mark.parametrize(("gained", "stays"), [(10.0, False), (90.0, True)])
def test_laws_that_leave_as_much_must_explain_far_more(monkeypatch, gained, stays):
    monkeypatch.setattr(discovery, "_left", lambda stage: 2.0)
    monkeypatch.setattr(discovery, "_gain", lambda bare, stage: 100.0 if stage.laws else gained)
    verdict = late_and_imitated(language=WHEELS_AND_LAG, invents=True)
    assert (bool(verdict.effects), bool(verdict.invented)) == (stays, not stays)


@pytest.mark.usefixtures("hidden_by_effects")
@pytest.mark.parametrize("again", [True, False])
def test_effects_that_are_all_named_again_beside_laws_stood_in_for_nothing(monkeypatch, again):
    written, named = discovery._with_laws_on, []

    def with_effects_again(context, language, stage, explained):
        found = written(context, language, stage, explained)
        named.append(explained)
        return replace(found, explained=named[0]) if again else found

    monkeypatch.setattr(discovery, "_with_laws_on", with_effects_again)
    monkeypatch.setattr(discovery, "_left", lambda stage: 2.0)
    monkeypatch.setattr(discovery, "_gain", lambda bare, stage: 100.0 if stage.laws else 10.0)
    verdict = late_and_imitated(language=WHEELS_AND_LAG, invents=True)
    assert (verdict.effects != (), verdict.invented == ()) == (again, again)


OVAL = parse_grammar(
    """
    <term> ::= rolling_radius: <r> | rolling_radius: <r> + <r> | motor_torque: c * speed
    <r> ::= c * sin(2 * angle) | c * cos(2 * angle)
    """
)


def with_oval_wheels(share):
    oval = {"port": "rolling_radius", "law": "c1 * sin(2 * angle)", "c1": share}
    runs = tuple(recorded(robot_with(oval), seed) for seed in range(5))
    return discover(Case("oval", runs), catalogue=[BY_ID["torque_ripple"]], language=OVAL)


def test_laws_are_tried_where_what_is_left_is_not_material_but_stands_out(monkeypatch):
    verdict = with_oval_wheels(0.02)
    assert verdict.verdict == "invented"
    (law,) = verdict.invented
    assert law.term.law == "c1 * sin(k1 * angle)"
    assert law.parameters["c1"].value == pytest.approx(0.02, rel=0.1)
    with monkeypatch.context() as patched:  # as if effects' own laws were off by as much
        patched.setattr(discovery, "left_share_of_each", lambda *_: 1.0)
        assert with_oval_wheels(0.02).invented == ()
    with monkeypatch.context() as patched:  # as if they left most of what there was
        patched.setattr(discovery, "INSTEAD", 0.0)
        assert with_oval_wheels(0.02).invented == ()
    monkeypatch.setattr(selection_problem, "STANDING_OUT", np.inf)
    assert with_oval_wheels(0.02).invented == ()


def test_of_a_law_that_recordings_set_aside_do_not_show_the_others_decide(monkeypatch):
    assert with_oval_wheels(0.03).invented[0].holdout_gain > 100.0
    monkeypatch.setattr(invention, "LEAST_SHOWN", np.inf)
    verdict = with_oval_wheels(0.03)
    assert [law.holdout_gain for law in verdict.invented] == [0.0]
    assert any("do not show the law at rolling_radius" in note for note in verdict.notes)
    assert sentences(verdict)[1].startswith("What was found does not show in ")


@pytest.fixture
def proved_law(monkeypatch):
    """Let one law be proved, of one size."""
    for name in ("added", "pruned", "_told", "_indistinguishable"):
        monkeypatch.setattr(invention, name, lambda *_: Written(None, (), ()))
    monkeypatch.setattr(invention, "_proved", lambda *_: iter([(None, None)]))
    monkeypatch.setattr(invention, "_spread", lambda *_: 0.0)
    monkeypatch.setattr(invention, "_leaves_more", lambda *_: False)


def test_a_law_of_uneven_size_that_leaves_much_of_a_large_error_is_refused(monkeypatch, proved_law):
    """What comes at random has a mean, as a radio that drops out brakes a robot."""
    monkeypatch.setattr(invention, "_gain_set_aside", lambda *_: 9.0)
    problem = SimpleNamespace(on_bench=False, material=SimpleNamespace(times=lambda left: left))
    monkeypatch.setattr(invention, "left_before", lambda _: 20.0)
    for spread, left, holds in ((0.2, 10.0, False), (0.1, 10.0, True), (0.2, 5.0, True)):
        explained = SimpleNamespace(problem=problem, left=left)
        monkeypatch.setattr(invention, "_spread", lambda *_, spread=spread: spread)
        monkeypatch.setattr(invention, "pruned", lambda *_, e=explained: Written(e, (), ()))
        found = invention._first_that_holds(Written(None, (), ()), None, None, [], None, None)
        assert (found is not None) == holds


def test_beside_a_law_whole_drives_part_no_farther():
    """A pull at one place of the floor fits what a step that was logged late did to a second of a drive."""
    for on_bench, left, more in ((False, 3.0, True), (False, 0.9, False), (True, 3.0, False)):
        problem = SimpleNamespace(on_bench=on_bench, material=SimpleNamespace(times=lambda left: left))
        before, after = (SimpleNamespace(problem=problem, left=each) for each in (1.0, left))
        assert invention._leaves_more(after, before) == more


def test_a_further_law_must_show_in_recordings_set_aside(monkeypatch, proved_law):
    held = SimpleNamespace(recordings=["one"])
    for gain, terms, holds in ((0.0, (), True), (0.0, ("law",), False), (9.0, ("law",), True)):
        monkeypatch.setattr(invention, "_gain_set_aside", lambda *_, gain=gain: gain)
        found = invention._first_that_holds(Written(None, terms, ()), None, None, [], held, None)
        assert (found is not None) == holds


def test_a_law_that_is_not_material_is_not_told_where_nothing_material_is_left(monkeypatch):
    monkeypatch.setattr(discovery, "_is_left", lambda _: True)
    assert with_oval_wheels(0.004).verdict == "nothing"
    monkeypatch.setattr(discovery, "_is_material", lambda *_: True)
    assert with_oval_wheels(0.004).verdict == "invented"


WITH_THE_OTHER = parse_grammar(
    "<term> ::= supply_voltage: c * 1 | command: c * command * positive(abs(other_command) - 0.01)"
)
WEAK = [effect for effect in CATALOGUE if effect.id in ("supply_voltage", "viscous_friction", "clock_skew")]


@cache
def verdict_on_weak_motors(language, *table):
    runs = tuple(recorded(robot_with(dict(table)) if table else FLAT, seed, most=5) for seed in range(5))
    return discover(Case("made", runs), catalogue=WEAK, language=language)


FLAT = EV3.with_effects({"supply_voltage": {"scale": 0.97}})
WEAKER_TOGETHER = frozen(
    port="command", law="-c1 * command * positive(abs(other_command) - k1)", c1=0.02, k1=0.01
)


def test_motors_that_weaken_each_other_have_a_law_and_no_flat_battery():
    found = verdict_on_weak_motors(WITH_THE_OTHER, *WEAKER_TOGETHER)
    assert [effect.id for effect in found.effects] == []
    (law,) = found.invented
    assert law.term.port == "command"
    assert law.parameters["c1"].value == pytest.approx(-0.02, rel=0.1)
    assert DEFAULT.times(law.size) > 1.0
    # Without the law the recordings ask for a battery that is not flat.
    assert [effect.id for effect in verdict_on_weak_motors(None, *WEAKER_TOGETHER).effects] != []


def test_a_flat_battery_is_named_beside_laws_of_both_motors():
    found = verdict_on_weak_motors(WITH_THE_OTHER)
    assert [effect.id for effect in found.effects] == ["supply_voltage"]
    assert found.invented == ()


def with_nothing_named(robot, *effects):
    """Return an explanation of a robot's recordings that names none of some effects, and recordings set aside."""
    runs = [recorded(robot, seed) for seed in range(6)]
    noise = estimate_noise(runs, EV3.physics, 1.0)
    fitted, held = (motion_residuals(some, noise, 1.0, Threads(1)) for some in (runs[:4], runs[4:]))
    catalogue = [*UNRELATED, *(BY_ID[effect] for effect in effects)]
    problem = problem_of(fitted, EV3, observable(catalogue, fitted), held=held)
    return concluded(problem, problem.known, (), explain(problem).tried), held


@pytest.mark.parametrize("before", ["nothing", "refused", "another"])
def test_an_effect_beside_unlisted_physics_is_found_with_the_law(monkeypatch, before):
    """After the law, which hides it till then, before a second one; or taken back where no law holds without it.

    An effect that was named for it makes room.
    """
    robot = robot_with(dict(SCRUB)).with_effects({"battery_resistance": {"resistance_ohm": 0.3}})
    explained, held = with_nothing_named(robot, "battery_resistance", "viscous_friction")
    tried = explained.tried
    again = ()
    if before == "another":
        other = next(step for step in tried[0] if step.effect == "viscous_friction")
        problem = explained.problem.under(other.model)
        taken = problem.estimator.at(other.model, other.model.z)
        explained = replace(explained, problem=problem, taken=taken, steps=(other,))
    if before == "refused":
        again = [step for step in tried[0] if step.effect == "battery_resistance"]
        first_that_holds = invention._first_that_holds

        def beside_effects_alone(written, first, library, *others):
            return first_that_holds(written, first, library, *others) if library.model.effects else None

        monkeypatch.setattr(invention, "_first_that_holds", beside_effects_alone)
    written = invention.invent(explained, held, FEW, refused=again)
    assert [term.port for term in written.terms] == ["yaw_moment"]
    (step,) = written.explained.steps
    assert step.effect == "battery_resistance"
    assert step.holdout_gain > 0.0
    values = written.explained.taken.values["battery_resistance"]
    assert values["resistance_ohm"] == pytest.approx(0.3, rel=0.05)
    assert written.terms[0].constants["c1"] == pytest.approx(-0.01, rel=0.05)


def test_what_does_far_less_than_a_law_is_not_added_to_it(monkeypatch):
    """The test above names the resistance; it is refused where it has to do a thousand times as much as the law."""
    monkeypatch.setattr(beside, "MENDS", 1e3)
    robot = robot_with(dict(SCRUB)).with_effects({"battery_resistance": {"resistance_ohm": 0.3}})
    written = invention.invent(*with_nothing_named(robot, "battery_resistance"), FEW)
    assert [term.port for term in written.terms] == ["yaw_moment"]
    assert written.explained.steps == ()


def test_a_cause_that_became_a_part_of_a_law_is_named_in_its_place():
    robot = robot_with(dict(DRAG)).with_effects({"viscous_friction": {"coefficient_nms": 4e-3}})
    written = invention.invent(*with_nothing_named(robot, "viscous_friction"), FEW)
    assert [term.law for term in written.terms] == ["c1 * speed * abs(speed)"]
    assert [step.effect for step in written.explained.steps] == ["viscous_friction"]
    assert written.terms[0].constants["c1"] == pytest.approx(-3e-4, rel=0.1)
    (told,) = written.invented
    assert list(told.range) == ["speed"]
    rest = EV3.with_effects(written.explained.taken.values)
    whole = rest.with_terms(written.terms)
    assert told.size == written.explained.problem.sizes.apart(whole.physics, rest.physics)


def test_an_only_law_that_is_an_effect_is_told_as_that_effect():
    robot = EV3.with_effects({"battery_drain": {"rate_v_s": 0.08}})
    explained, held = with_nothing_named(robot, "battery_drain")
    written = invention.invent(explained, held, FEW)
    assert written.terms == written.invented == ()
    (step,) = written.explained.steps
    assert step.effect == "battery_drain"
    assert step.holdout_gain > 0.0
    assert step.left_out.sum() > step.null_95
    assert written.explained.taken.values["battery_drain"]["rate_v_s"] == pytest.approx(0.08, rel=0.05)
    assert not explained.steps


def test_an_only_law_makes_room_for_an_effect_that_explains_more():
    """A lag is much like a delay of 60 ms, and unlike its derivative."""
    language = parse_grammar("<term> ::= command: c * (store - command); store: command; store_s: 0.1")
    robot = EV3.with_effects({"actuation_delay": {"time_s": 0.06}})
    written = invention.invent(*with_nothing_named(robot, "actuation_delay"), language)
    assert written.terms == written.invented == ()
    assert [step.effect for step in written.explained.steps] == ["actuation_delay"]


@pytest.mark.parametrize(("c1", "left"), [(-1e-7, []), (-3e-4, ["c1 * speed * abs(speed)"])])
def test_a_law_that_an_effect_makes_idle_goes(c1, left):
    drag = Term(**{**dict(DRAG), "c1": c1})
    robot = EV3.with_terms([drag]).with_effects({"viscous_friction": {"coefficient_nms": 4e-3}})
    explained, _ = with_nothing_named(robot, "viscous_friction")
    step = next(step for step in explained.tried[0] if step.effect == "viscous_friction")
    problem = explained.problem.under(step.model)
    first = replace(
        explained, problem=problem, taken=problem.estimator.at(step.model, step.model.z), steps=(step,)
    )
    both = beside.together(first, problem, (drag,), step.model.effects, step.model.z)
    written = beside.written_with(Written(first, (), ("of drag",)), first, both)
    found = beside._without_idle(written, first)
    assert [term.law for term in found.terms] == left
    assert len(found.invented) == len(left)
    assert found.explained.taken.effects == ("viscous_friction",)


def test_a_law_goes_as_a_whole_and_a_sum_part_by_part():
    scrub, drag = (
        Term(**dict(SCRUB)),
        Term(port="motor_torque", law="c1 * speed + c2 * sign(speed)", c1=-1.0, c2=-2.0),
    )
    shorter = list(beside._shorter(Written(None, (scrub, drag), ("scrubs", "drags"))))
    assert [told for _, told in shorter] == [("drags",), ("scrubs", "drags"), ("scrubs", "drags")]
    assert [[term.law for term in terms] for terms, _ in shorter] == [
        [drag.law], [scrub.law, "c1 * sign(speed)"], [scrub.law, "c1 * speed"]
    ]  # fmt: skip
    assert list(beside._shorter(Written(None, (scrub,), ("scrubs",)))) == [((), ())]


def with_rough_bearings(coefficient_nms):
    """Return what is discovered where the only effect in the catalogue is beside a moment that scrubs."""
    rough = robot_with(dict(SCRUB)).with_effects({"viscous_friction": {"coefficient_nms": coefficient_nms}})
    runs = tuple(recorded(rough, seed) for seed in range(5))
    catalogue = [effect for effect in CATALOGUE if effect.id == "viscous_friction"]
    return discover(Case("both", runs), catalogue=catalogue, language=FEW, invents=True)


def test_an_effect_that_gains_more_beside_a_law_is_not_doubted(monkeypatch):
    monkeypatch.setattr(discovery, "_is_left", lambda _: True)
    told = []
    rough = robot_with(dict(SCRUB)).with_effects({"viscous_friction": {"coefficient_nms": 8e-3}})
    case = Case("both", tuple(recorded(rough, seed) for seed in range(5)))
    verdict = discover(case, catalogue=[BY_ID["viscous_friction"]], language=FEW, tell=told.append)
    assert [found.id for found in verdict.effects] == ["viscous_friction"]
    assert any("a law: yaw_moment" in line for line in told)
    assert not any("in the place of" in line for line in told)


def test_sizes_told_of_effects_are_those_fitted_beside_the_law():
    verdict = with_rough_bearings(8e-3)
    assert [law.term.port for law in verdict.invented] == ["yaw_moment"]
    told = verdict.effects[0].parameters["coefficient_nms"]
    assert told.value == pytest.approx(verdict.robot.effects["viscous_friction"]["coefficient_nms"], rel=1e-9)
    assert told.low < 8e-3 < told.high


@pytest.mark.parametrize("material", [True, False])
def test_an_effect_beside_a_law_is_named_only_if_it_is_material_there(monkeypatch, material):
    monkeypatch.setattr(beside, "is_material", lambda *_: material)
    verdict = with_rough_bearings(1.5e-3)
    assert "yaw_moment" in [law.term.port for law in verdict.invented]
    assert [found.id for found in verdict.effects] == ["viscous_friction"] * material


@pytest.mark.parametrize("absent", [True, False])
def test_an_effect_that_may_as_well_be_absent_beside_a_law_is_not_named(monkeypatch, absent):
    # It is there: without it drives are farther off, and much is left.
    monkeypatch.setattr(discovery, "gaps", lambda *_: (1.0, 1.0))
    monkeypatch.setattr(discovery, "kind_of_driving", lambda *_: None)
    monkeypatch.setattr(
        beside, "weakest_absent", lambda _, steps, *__, **___: next(iter(steps if absent else ()), None)
    )
    verdict = with_rough_bearings(8e-3)
    assert "yaw_moment" in [law.term.port for law in verdict.invented]
    assert [found.id for found in verdict.effects] == ["viscous_friction"] * (not absent)
    assert ("viscous_friction" in verdict.robot.effects) is not absent


@pytest.mark.parametrize("waxing", [0.0, 0.1], ids=["darker", "flickers"])
def test_no_law_makes_readings_darker_where_the_light_waxes_and_wanes(waxing):
    language, runs = parse_grammar("<t> ::= colour_reading: c * 1 | yaw_moment: c * 1"), []
    for seed in range(4):
        run = seen_on_the_course(seed, EV3)
        light = 0.88 + waxing * np.sin(2.0 * np.pi * 1.1 * run.t_s + seed)
        runs.append(replace(run, reflection_pct=np.round(run.reflection_pct * light)))
    verdict = discover(Case("lamp", tuple(runs)), catalogue=UNRELATED, language=language, invents=True)
    assert [law.term.port for law in verdict.invented] == ["colour_reading"] * (not waxing)


@pytest.mark.parametrize("there", [False, True])
def test_laws_are_refused_that_leave_whole_drives_set_aside_farther_off(monkeypatch, there):
    with_law = robot_with(dict(DRAG))
    runs = [recorded(with_law if there else EV3, seed) for seed in range(4)]
    fitted, held = motion_of(runs[:3]), motion_of(runs[3:])
    effects, found = (
        discovery._Stage(explain(problem_of(fitted, robot, [])), (), (), {}, held, robot.term)
        for robot in (EV3, with_law)
    )
    monkeypatch.setattr(discovery, "_with_law_of_both_motors", lambda _, stage: stage)
    monkeypatch.setattr(discovery, "_with_laws", lambda *_: found)
    assert discovery._written(None, effects) is (found if there else effects)


DRIFTS = "<t> ::= pose_y: c * time | yaw_moment: c * 1 | colour_reading: c * 1"


@pytest.mark.parametrize("of_floor", [False, True], ids=["camera", "floor"])
def test_a_camera_that_drifts_is_told_from_a_floor_that_does_by_where_lines_are_read(of_floor):
    drift, runs = 0.005, []
    for seed in (0, 2, 3, 5, 7):
        run = seen_on_the_course(seed, EV3, up_m=0.5, drift_m_s=drift * of_floor)
        runs.append(replace(run, y_m=run.y_m + drift * (not of_floor) * run.t_s))
    verdict = discover(Case("drift", tuple(runs)), catalogue=UNRELATED, language=parse_grammar(DRIFTS))
    assert [law.term.port for law in verdict.invented] == ["pose_y"] * (not of_floor)
    assert verdict.verdict == ("unexplained" if of_floor else "invented")


@pytest.mark.parametrize(
    ("laws", "holds"),
    [
        ({"sensor_ahead": "0.0025"}, False),
        ({"sensor_ahead": "0.0035"}, True),
        ({"sensor_ahead": "0.0025", "sensor_aside": "-0.0025"}, True),
        ({"sensor_aside": "0.0035 * positive(turn_rate - 100)"}, False),
        ({"yaw_moment": "0.001"}, True),
    ],
)
def test_a_law_of_the_sensors_place_must_move_it_farther_than_its_path_is_known_to(laws, holds):
    run = recorded(EV3, 0)
    residuals = motion_of([run])
    library = SimpleNamespace(problem=SimpleNamespace(residuals=residuals))
    terms = [Term(port=port, law=law) for port, law in laws.items()]
    fitted = SimpleNamespace(physics=lambda _: EV3.physics)
    law = SimpleNamespace(terms=terms, parameters=fitted, minimum=SimpleNamespace(z=None))
    assert invention._beyond_path(library, law) == holds


def test_a_language_without_a_law_of_one_part_writes_none():
    language = parse_grammar("<t> ::= motor_torque: c * speed * abs(speed) + c * sin(2 * angle)")
    assert verdict_on(DRAG, language=language).invented == ()


def test_without_a_camera_no_law_speaks_of_places():
    runs = [recorded(robot_with(*map(dict, TILT)), seed) for seed in range(4)]
    blind = tuple(
        replace(r, **{f: np.full(len(r.t_s), np.nan) for f in ("x_m", "y_m", "heading_rad")}) for r in runs
    )
    verdict = discover(Case("blind", blind), catalogue=UNRELATED, language=FEW, invents=True)
    assert not {law.term.port for law in verdict.invented} & {"force_x", "force_y", "force_toward"}
    assert not {name for law in verdict.invented for name in law.term.parsed.variables} & {
        "x",
        "y",
        "heading",
    }


def test_the_robot_found_carries_the_law(tmp_path):
    verdict = verdict_on(SAG)
    write_robot(verdict.robot, tmp_path / "robot.toml")
    again = read_robot(tmp_path / "robot.toml")
    assert again.term == tuple(law.term for law in verdict.invented)
    runs = tuple(recorded(robot_with(dict(SAG)), seed) for seed in range(5))
    anew = discover(Case("made", runs), robot=again, catalogue=UNRELATED, language=FEW)
    assert anew.verdict == "nothing"


@pytest.mark.parametrize("own", [3, 4])
def test_a_robot_that_is_full_of_laws_gets_no_more_than_fit(own):
    none = Term(port="motor_torque", law="a * time", a=0.0)
    runs = tuple(recorded(robot_with(*map(dict, TILT)), seed) for seed in range(4))
    full = EV3.with_terms([none] * own)
    verdict = discover(Case("full", runs), robot=full, catalogue=UNRELATED, language=FEW)
    assert len(verdict.robot.term) <= 4
    assert verdict.robot.physics["n_terms"] == len(verdict.robot.term)


def test_a_law_is_told_in_words_numbers_and_pictures(tmp_path):
    verdict = verdict_on(SAG)
    assert (
        sentences(verdict)[0]
        == "Missing in the simulation, and not in the catalogue: a battery that sags under load."
    )
    (table,) = json.loads(json.dumps(verdict.as_json()["invented"]))
    assert (table["port"], table["variables"], table["unit"]) == ("supply_voltage", ["draw"], "V")
    assert table["evidence"]["p"] < 0.05
    low, high = table["range"]["draw"]
    assert low == 0.0
    assert high > 1.0
    assert "supply_voltage = -1.5" in verdict_html(verdict, {})
    draw(verdict, tmp_path)
    assert "The law that was written" in (tmp_path / "report.html").read_text()
    for each in (verdict, verdict_on(*TILT), verdict_on(DRAG)):
        assert is_whole(laws_figure(each))


def test_a_law_that_differs_by_side_alone_is_drawn_as_it_is_on_the_right():
    verdict = verdict_on(SAG)
    (law,) = verdict.invented
    span = replace(law.parameters["c1"], value=2e-4, low=1e-4, high=3e-4)
    apart = Term(port="motor_torque", law="c1 * side", c1=2e-4)
    law = replace(law, term=apart, range={"side": (-1.0, 1.0)}, parameters={"c1": span})
    figure = laws_figure(replace(verdict, invented=(law,)))
    assert is_whole(figure)
    assert "the opposite on the left" in figure.axes[0].get_xlabel()


def test_a_law_of_the_place_is_drawn_on_the_floor():
    verdict = verdict_on(*TILT)
    told = Told((), ())
    assert "law_map" not in verdict_drawings(verdict, told)
    pull = Term(port="force_toward", law="c1 * distance", c1=0.4, at_x=1.5, at_y=0.4)
    law = replace(verdict.invented[0], term=pull)
    verdict = replace(verdict, invented=(law, verdict.invented[1]), robot=EV3.with_terms([pull]))
    assert "law_map" in verdict_drawings(verdict, told)
    assert is_whole(laws_map_figure(verdict))
    _, x, y, force = np.concatenate(along_ways(verdict, law)).T
    assert force == pytest.approx(0.4 * np.hypot(x - 1.5, y - 0.4))
    table = verdict_tables(verdict, told)["law_map"].splitlines()
    assert len(table) == 1 + len(x)
    assert table[1].startswith("force_toward,")


RIVALS = (
    "coulomb_friction", "viscous_friction", "rotor_inertia", "motor_gain_asymmetry", "dead_band", "battery_drain",
    "wheel_radius", "track_width", "load_transfer", "actuation_delay", "pose_delay", "sensor_delay",
)  # fmt: skip


@needs_practice
def test_an_effect_taken_out_is_written_anew_in_a_3d_world_with_a_course():
    # Some of the catalogue, without what is concealed and its like: all of it takes four times as long.
    catalogue = [BY_ID[effect] for effect in RIVALS]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        case = read_case(PRACTICE)
        some = replace(case, recordings=case.recordings[:5])  # in half the time of all
        verdict = discover(some, catalogue=catalogue, language=FEW)
    (law,) = (law for law in verdict.invented if law.term.port == "supply_voltage")
    assert law.term.parsed.variables == ("draw",)
    assert law.parameters["c1"].value == pytest.approx(-1.2, rel=0.15)


def test_without_a_language_nothing_is_written():
    verdict = verdict_on(SAG, language=None)
    assert verdict.verdict == "unexplained"
    assert verdict.invented == ()


def test_nothing_is_written_where_nothing_is_missing():
    assert verdict_on(invents=True).verdict == "nothing"


def test_noise_is_no_law():
    """A push that is another in every recording, as wind is."""
    runs = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        gust = {"port": "force_ahead", "law": "a * sin(w * time + p)", "a": 0.5}
        gust |= {"w": rng.uniform(0.5, 3.0), "p": rng.uniform(0.0, 6.0)}
        runs.append(recorded(robot_with(gust), seed))
    verdict = discover(Case("gusts", tuple(runs)), catalogue=UNRELATED, language=FEW, invents=True)
    assert verdict.invented == ()


def test_every_single_law_of_the_shipped_language_is_one():
    laws = single_laws(physics_grammar())
    assert len(laws) > 1000
    assert {term.port for each in laws for term in each} == {port.id for port in PORTS}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<t> ::= motor_torque: c * sped", "found 'sped'"),
        ("<t> ::= engine: c", "found port 'engine'"),
        ("<t> ::= pose_x: c * speed", "found 'speed'"),
        ("<t> ::= motor_torque: c; shop: 3", "found 'shop'"),
    ],
)
def test_a_language_that_is_none_of_physics_is_refused(tmp_path, text, words):
    path = tmp_path / "mine.bnf"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as raised:
        physics_grammar(str(path))
    assert "mine.bnf" in str(raised.value)


def test_sums_are_taken_apart_and_put_together():
    (law,) = read_sentence("motor_torque: c * speed + c * sin(2 * angle) + c * tanh(speed / 0.3)")
    parts = pieces(law)
    assert [part.law for part in parts] == ["c1 * speed", "c2 * sin(k1 * angle)", "c3 * tanh(speed / k2)"]
    again = joined(
        [part.with_constants({name: 5.0 for name in part.constants if name[0] == "c"}) for part in parts]
    )
    assert again.constants == {"c1": 5.0, "c2": 5.0, "c3": 5.0, "k1": 2.0, "k2": 0.3}
    assert key((again,)) == key((law,)) == key((joined(parts[::-1]),))
    assert key((law,)) != key(
        read_sentence("motor_torque: c * speed + c * sin(3 * angle) + c * tanh(speed / 0.3)")
    )
    assert complexity((law,)) > complexity(read_sentence("motor_torque: c * speed"))
    assert [t.law for t in read_sentence("force_x and force_y: c * x")] == ["c1 * x", "c1 * y"]
    late = read_sentence("pose_x and pose_y: c * ahead * cos(heading)")
    assert [t.law for t in late] == ["c1 * ahead * cos(heading)", "c1 * ahead * sin(heading)"]
    each = read_sentence("rolling_radius: c * sin(1 * angle); side: each")
    assert [t.side for t in each] == ["left", "right"]
    assert {t.law for t in each} == {"c1 * sin(k1 * angle)"}


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"port": "motor_torque", "law": "c1 * speed * abs(speed)", "c1": -1e-4}, "drag growing with the square"),
        ({"port": "force_toward", "law": "c1 * distance", "c1": 0.3, "at_x": 1.21, "at_y": 0.58},
         "a pull toward (1.21, 0.58) growing with distance: a spring"),
        ({"port": "rolling_radius", "law": "c1 * sin(k1 * angle) + c2 * cos(k2 * angle)", "c1": 0.1, "c2": 0.1,
          "k1": 1.0, "k2": 1.0}, "a wheel off its centre by 4.0 mm"),
        ({"port": "motor_torque", "law": "c1 * side", "c1": 1e-4},
         "a torque on the motor's shaft, opposite on the two sides"),
        ({"port": "tyre_grip", "law": "c1 * sin(k1 * angle)", "c1": 0.04, "k1": 2.0, "side": "left"},
         "twice per turn: a share of the tyre's grip that varies with the shaft's angle, on the left wheel alone"),
        ({"port": "motor_torque", "law": "c1 * angle", "c1": -0.01, "side": "left"},
         "a spring that winds up as the wheel turns, on the left wheel alone"),
        ({"port": "motor_torque", "law": "c1 * store * command", "c1": -0.1, "store": "draw", "store_s": 15.0},
         "grows over the first 30 s of use and stays: heat"),
        ({"port": "command", "law": "c1 * (store - command)", "c1": 2.0, "store": "command", "store_s": 0.03},
         "commands that act late, by about 60 ms"),
        ({"port": "command", "law": "c1 * (store - command)", "c1": 1.0, "store_s": 0.025,
          "store": "store + max(-0.05, min(0.05, command - store))"}, "commands that ramp, at 200 % a second"),
        ({"port": "command", "law": "c1 * command * positive(-store * command)", "c1": -1.0,
          "store": "sign(command)", "store_s": 0.04}, "a pause of about 28 ms before a motor turns round"),
        ({"port": "motor_torque", "law": "c1 * tanh((speed - other_speed) / k2)", "c1": -0.01, "k2": 0.3},
         "axles that rub on each other"),
        ({"port": "command", "law": "c1 * (store - angle) * positive(k1 - abs(command))", "c1": 0.06, "k1": 0.005,
          "store": "store + (angle - store) * positive(abs(command) - k2)", "k2": 0.005},
         "motors that hold the angle at which they were stopped"),
        ({"port": "yaw_moment", "law": "c1 * store", "c1": -3e-3, "store": "store + turn_rate"},
         "a cable that winds up as the robot turns"),
        ({"port": "gear_play", "law": "c1 * time", "c1": 0.01, "side": "right"},
         "a wheel that comes loose, on the right wheel alone"),
        ({"port": "sensor_ahead", "law": "c1 * ahead", "c1": -0.02}, "a colour sensor that is late, by about 20 ms"),
        ({"port": "pose_y", "law": "c1 * ahead * sin(heading)", "c1": -0.04}, "a camera that is late, by about 40 ms"),
        ({"port": "pose_turn", "law": "c1 * time", "c1": 0.01, "at_x": 1.2, "at_y": 0.6},
         "a camera that turns slowly"),
        ({"port": "pose_late", "law": "c1 * time", "c1": 0.009}, "a camera whose clock runs slow"),
        ({"port": "caster_friction", "law": "c1", "c1": 0.04}, "a caster that drags"),
        ({"port": "command", "law": "c1", "c1": -0.006}, "motors that drive less forward and more backward"),
        ({"port": "command", "law": "c1 * command * positive(abs(other_command) - k1)", "c1": -0.02, "k1": 0.01},
         "motors that are weaker while the other is driven, too"),
        ({"port": "colour_reading", "law": "c1 * reading * cos(heading)", "c1": 0.1}, "light that comes from one side"),
        ({"port": "pose_toward", "law": "c1 * distance * distance ** 2", "c1": 0.1, "at_x": 1.2, "at_y": 0.6},
         "a camera whose lens bends the picture, about (1.20, 0.60)"),
        ({"port": "yaw_moment", "law": "c1 * heading * y", "c1": 0.1}, "depends on the heading and the place along y"),
    ],
)  # fmt: skip
def test_what_a_law_looks_like(table, words):
    assert words in looks_like(Term(**table))


def test_laws_of_both_motors_are_those_that_look_at_what_the_other_is_told():
    language = looking_at(physics_grammar(), invention.OF_BOTH_MOTORS)
    laws = [law for law, *_ in single_laws(language)]
    assert {law.port for law in laws} == {"command"}
    assert all("other_command" in law.parsed.variables for law in laws)
    assert looking_at(FEW, invention.OF_BOTH_MOTORS) is None


def test_the_laws_elsewhere_are_those_at_other_ports():
    ports = [laws[0].port for laws in single_laws(elsewhere(FEW, ["supply_voltage"]))]
    assert "supply_voltage" not in ports
    assert set(ports) == {laws[0].port for laws in single_laws(FEW)} - {"supply_voltage"}
    assert elsewhere(HIDDEN_FROM_DERIVATIVES, ["tyre_grip", "wheel_load", "command", "motor_torque"]) is None


@pytest.mark.parametrize(
    ("option", "words"),
    [("--without=gravity", "expected one of coulomb_friction"), ("--physics=none.bnf", "none.bnf")],
)
def test_the_command_line_names_what_it_does_not_know(gecar, tmp_path, option, words):
    (tmp_path / "case").mkdir()
    assert words in gecar.error("discover", tmp_path / "case", option)
