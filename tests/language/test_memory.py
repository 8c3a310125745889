"""Programs with memory: what they calculate, ask, keep and repeat; equal to plain Python, in lanes, and on a brick."""

import operator
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import brick
from test_export import compiled_by_the_brick

from gecar.brick.export import TARGETS, export_program
from gecar.brick.memory_template import CALCULATION
from gecar.errors import InputError
from gecar.language import opcodes
from gecar.language.conditions import And, Compared, Comparison, Not, Or, Threshold
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper
from gecar.language.program import Program, mirrored, parse_program
from gecar.language.robot_language import check_robot_language
from gecar.language.statements import If, Motor, MotorUntil, ResetTimer, Set, While
from gecar.language.values import Constant, Operation, Operator, Previous, Reading, Register, Sensor, Timer
from gecar.world.course.course import load_course
from gecar.world.kernel.calculation import arithmetic
from gecar.world.perturbation import drawn_conditions
from gecar.world.robot import load_robot
from gecar.world.rollout import Driver, Fleet, Outcome, World, simulate
from gecar.world.stepped_robot import SteppedRobot

needs_brick = pytest.mark.skipif(brick.MISSING is not None, reason=str(brick.MISSING))
EV3 = load_robot("ev3")
WORLD = World(EV3, load_course("paper"), time_limit_s=12.0)
ARITHMETIC = {
    Operator.ADD: operator.add,
    Operator.SUBTRACT: operator.sub,
    Operator.MULTIPLY: operator.mul,
    Operator.DIVIDE: lambda a, b: a / b if b else a * 10**9,
}
COMPARED = {
    Comparison.GREATER: operator.gt,
    Comparison.LESS: operator.lt,
    Comparison.GREATER_EQUAL: operator.ge,
    Comparison.LESS_EQUAL: operator.le,
    Comparison.EQUAL: operator.eq,
    Comparison.NOT_EQUAL: operator.ne,
}

numbers = st.integers(-opcodes.MAX_VALUE, opcodes.MAX_VALUE)
small = st.integers(-200, 200).map(lambda n: Constant(n * 500))
registers = st.integers(0, 2).map(Register)
calculated = st.recursive(
    small | numbers.map(Constant) | registers,
    lambda inner: st.builds(Operation, st.sampled_from(Operator), inner, inner),
    max_leaves=10,
)
sources = st.sampled_from([Timer(), *map(Reading, Sensor), *map(Previous, Sensor)])
nonzero = small.filter(lambda constant: constant.thousandths != 0)
values = st.recursive(
    registers | sources,
    lambda inner: (
        st.builds(Operation, st.sampled_from(Operator), inner, inner | nonzero)
        | st.builds(Operation, st.sampled_from(Operator), nonzero, inner)
    ),
    max_leaves=6,
)


def asked(what):
    return st.recursive(
        st.builds(Compared, what, st.sampled_from(Comparison), what),
        lambda inner: st.builds(Not, inner) | st.builds(And, inner, inner) | st.builds(Or, inner, inner),
        max_leaves=6,
    )


# --- plain Python's answers


def worked_out(value, memory) -> int:
    """Return what a value comes to [thousandths], with fractions instead of fixed point."""
    if isinstance(value, Constant):
        return value.thousandths
    if isinstance(value, Register):
        return memory[value.number]
    left, right = (Fraction(worked_out(side, memory), 1000) for side in (value.left, value.right))
    exact = ARITHMETIC[value.operator](left, right)
    return max(-opcodes.MAX_VALUE, min(opcodes.MAX_VALUE, floor(1000 * exact)))


def answered(condition, memory) -> bool:
    if isinstance(condition, Not):
        return not answered(condition.condition, memory)
    if isinstance(condition, And | Or):
        both = all if isinstance(condition, And) else any
        return both(answered(part, memory) for part in (condition.left, condition.right))
    left, right = worked_out(condition.left, memory), worked_out(condition.right, memory)
    return COMPARED[condition.comparison](left, right)


def first_duties(*statements) -> tuple[int, int]:
    """Return the duties the simulator first drives with, after some statements [%]."""
    drive = simulate(WORLD, Program((*statements, Motor(0, 0, 60_000))).opcodes, trace=True)
    return round(100 * drive.trace["left_duty"][0]), round(100 * drive.trace["right_duty"][0])


# --- calculation


@given(st.tuples(numbers, numbers, numbers), calculated)
@settings(deadline=None, max_examples=150)
def test_values_are_worked_out_as_fractions_are_and_rounded_down(held, value) -> None:
    memory = [worked_out(Constant(number), ()) for number in held]
    result = worked_out(value, memory)
    sets = [Set(k, Constant(number)) for k, number in enumerate(memory)]
    exact = Compared(value, Comparison.EQUAL, Constant(result))
    assert first_duties(*sets, If(exact, (Motor(1, 2, 100),), (Motor(3, 4, 100),))) == (1, 2)


@given(numbers, numbers)
@settings(deadline=None, max_examples=200)
def test_a_brick_calculates_as_the_simulator_does(left, right) -> None:
    brick_s: dict = {}
    exec(CALCULATION, brick_s)
    for kind in Operator:
        name = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide"}[kind.word]
        assert brick_s[name](left, right) == arithmetic(kind.op, left, right)


@given(st.tuples(numbers, numbers, numbers), asked(small | registers))
@settings(deadline=None, max_examples=150)
def test_and_or_and_not_lead_where_pythons_lead(held, condition) -> None:
    sets = [Set(k, Constant(number)) for k, number in enumerate(held)]
    wanted = (1, 2) if answered(condition, held) else (3, 4)
    assert first_duties(*sets, If(condition, (Motor(1, 2, 100),), (Motor(3, 4, 100),))) == wanted


def test_duties_are_rounded_to_whole_percent_and_cut_at_100() -> None:
    text = "motor(12.4 + 0.2 * r0, 40 * (SensorValue - 50), 100)"
    assert first_duties(*parse_program(text).statements) == (12, 100)
    assert first_duties(*parse_program("motor(12.5 + r0, r0 - 101, 100)").statements) == (13, -100)


# --- text


statements = st.recursive(
    st.builds(Motor, st.integers(-100, 100) | sources, sources, st.integers(0, 60_000))
    | st.builds(MotorUntil, st.integers(-100, 100), sources, st.integers(0, 60_000), asked(sources))
    | st.builds(Set, st.integers(0, 7), values | small)
    | st.just(ResetTimer()),
    lambda inner: (
        st.builds(If, asked(sources), *[st.lists(inner, max_size=2).map(tuple)] * 2)
        | st.builds(While, asked(sources), st.lists(inner, max_size=2).map(tuple))
    ),
    max_leaves=6,
)


@given(st.lists(statements, max_size=3).map(tuple))
@settings(deadline=None, max_examples=150)
def test_what_is_printed_reads_back_the_same(several) -> None:
    once = parse_program(Program(several).source)  # which works out what stands between numbers
    assert parse_program(once.source) == once
    assert mirrored(mirrored(once)) == once
    assert (
        once.opcodes[once.opcodes[:, opcodes.OP] != opcodes.LOOP][:, opcodes.TARGET] <= len(once.opcodes)
    ).all()


def test_a_sensor_beside_a_number_stays_the_test_it_was() -> None:
    program = parse_program("if 50 < SensorValue and not SensorValue > 80 {motor(1,2,3)}")
    both = And(
        Threshold(Sensor.CENTRE, Comparison.GREATER, 50_000),
        Not(Threshold(Sensor.CENTRE, Comparison.GREATER, 80_000)),
    )
    assert program == Program((If(both, (Motor(1, 2, 3),)),))
    assert program.opcodes[:, opcodes.OP].tolist() == [opcodes.TEST, opcodes.TEST, opcodes.MOTOR]


def test_a_macro_stands_for_its_statements() -> None:
    text = "def turn() {motor(1,2,3); motor(4,5,6)}\nif SensorValue > 50 {turn()} else {pass; turn()}"
    assert parse_program(text).source == parse_program(text.replace("turn()", "motor(1,2,3) motor(4,5,6)", 3)
        .split("\n", 1)[1]).source  # fmt: skip
    nested = parse_program("def a():\n    motor(1,2,3)\ndef b():\n    a()\n    a()\nb()")
    assert nested.statements == (Motor(1, 2, 3),) * 2


@pytest.mark.parametrize("name", ["proportional", "memory"])
def test_grammars_speak_the_robot_language(name) -> None:
    grammar = load_grammar(name)
    assert grammar.warnings == ()
    check_robot_language(grammar)


# --- memory


def duties_of(text, seconds=1.0) -> list[int]:
    """Return the left duties of a drive [%], each as long as it is commanded."""
    world = World(EV3, WORLD.course, time_limit_s=seconds)
    trace = simulate(world, parse_program(text).opcodes, trace=True).trace
    duties = np.rint(100 * trace["left_duty"]).astype(int)
    return duties[np.r_[True, duties[1:] != duties[:-1]]].tolist()


def test_registers_keep_what_they_hold_from_pass_to_pass() -> None:
    assert duties_of("r3 = r3 + 1\nmotor(r3, 0, 100)") == list(range(1, 11))


def test_the_previous_reading_is_that_of_the_last_motor_statement() -> None:
    assert duties_of("motor(PreviousValue, -99, 20) motor(PreviousValue - SensorValue, -100, 20)", 0.04) == [
        0
    ]
    assert duties_of("motor(PreviousValue + 1, 0, 20) motor(PreviousValue / 2, 0, 20)", 0.06) == [1, 50, 100]


def test_the_timer_counts_milliseconds_and_starts_again() -> None:
    text = "if Timer >= 300 {reset_timer()}\nmotor(Timer / 10, 0, 100)"
    assert duties_of(text, 0.7) == [0, 10, 20, 0, 10, 20, 0]


def test_a_loop_turns_while_its_condition_holds() -> None:
    text = "while r0 < 3 {r0 = r0 + 1 motor(10 * r0, 0, 100)}\nr0 = 0\nmotor(5,0,100)"
    assert duties_of(text, 0.8) == [10, 20, 30, 5, 10, 20, 30, 5]


def test_a_turn_that_takes_no_time_waits_for_the_next_step() -> None:
    text = "motor(50,50,0)\nwhile Timer < 100 {r0 = r0 + 1}\nmotor(r0, 0, 60000)"
    assert duties_of(text) == [50, 51]  # steps of 2 ms, of which the first turns twice


def test_motors_turn_until_any_condition_holds() -> None:
    assert duties_of("motor_until(r0 + 9, 0, 500, Timer > 200 and not SensorValue < 50)\nmotor(7,0,800)") == [
        9,
        7,
    ]
    world = World(EV3, WORLD.course, time_limit_s=1.0)
    text = "motor_until(9, 0, 500, Timer > {} or r0 > 5)\nmotor(7,0,800)"
    for ms, least in ((203, 0.204), (700, 0.5)):
        trace = simulate(world, parse_program(text.format(ms)).opcodes, trace=True).trace
        assert trace["t_s"][np.argmax(trace["left_duty"] < 0.08)] == pytest.approx(least, abs=0.0101)


@pytest.mark.parametrize(
    ("text", "outcome"),
    [
        ("r0 = SensorValue", Outcome.STUCK),
        ("while SensorValue > 20 {r1 = 5}", Outcome.STUCK),
        ("r0 = r0 + 1", Outcome.OUT_OF_TIME),
        ("while Timer < 90000 {}", Outcome.OUT_OF_TIME),
        ("while r0 < 1 {while r0 < 1 {r0 = r0 + 1}}", Outcome.STUCK),
    ],
)
def test_every_program_ends_and_is_only_stuck_if_nothing_can_change(text, outcome) -> None:
    assert simulate(WORLD, parse_program(text).opcodes).outcome == outcome


def test_a_robot_that_waits_for_its_timer_is_not_stuck() -> None:
    assert duties_of("while Timer < 500 {}\nmotor(30,30,1000)") == [0, 30]


# --- in lanes


@pytest.mark.parametrize("name", ["proportional", "memory"])
def test_lanes_drive_programs_with_memory_as_they_drive_alone(name) -> None:
    genomes = np.random.default_rng(4).integers(0, 256, (300, 200), dtype=np.uint8)
    mapped = Mapper(load_grammar(name)).map(genomes)
    programs = [p.opcodes for p in map(mapped.program, range(300)) if p is not None and len(p.opcodes)][:60]
    under = drawn_conditions(WORLD, 3, 5)
    pairs = [(p, row) for p in range(len(programs)) for row in range(3)]
    summary, _ = Fleet(WORLD).drive(programs, under, pairs, np.arange(len(pairs)))
    for k, (program, row) in enumerate(pairs):
        alone = Driver(WORLD, _row(under, row)).simulate(programs[program], k)
        assert (summary["outcome"][k], summary["steps"][k]) == (alone.outcome, alone.steps)


def _row(under, row):
    return type(under)(*[column[[row]] for column in under])


# --- on the brick


EVERYTHING = """
def look() { r0 = 0.7 * r0 + 0.3 * SensorValue }
look()
if not SensorValue > 40 and r0 < 60 or PreviousValue - SensorValue > 20 {
    motor(-40 - r0 / 9, -100, 20)
} else {
    motor(10 + 0.4 * SensorValue, 50 - 0.1 * (r0 - 60), 40)
}
while Timer < 200 { look() motor_until(40, r0 / 2, 60, SensorValue < 20 or Timer > 150) }
if Timer > 400 { reset_timer() }
"""


@pytest.mark.parametrize("target", TARGETS)
def test_exported_memory_is_readable_python(target) -> None:
    main = export_program(parse_program(EVERYTHING), EV3, target)["main.py"]
    compile(main, "main.py", "exec")
    assert "[[" not in main
    assert (
        "    # r0 = 0.7 * r0 + 0.3 * SensorValue\n    r0 = add(multiply(700, r0), multiply(300, sensor_value() * 1000))"
        in main
    )


def test_exports_of_table_3s_language_have_no_calculation_in_them() -> None:
    main = export_program(parse_program("if SensorValue > 80 {motor(1,2,3)}"), EV3, "pybricks2")["main.py"]
    assert "multiply" not in main
    assert "timer" not in main


def test_the_bricks_compiler_takes_the_longest_calculation(tmp_path) -> None:
    sums = ("r0 = r1" + " + SensorValue * SensorValue" * 49 + "\n") * 15
    text = f"if SensorValue > 12.5 {{{sums}}}"
    assert (
        compiled_by_the_brick(export_program(parse_program(text), EV3, "pybricks2")["main.py"], tmp_path)
        == ""
    )
    with pytest.raises(InputError, match="5942 rows of opcodes, expected at most 3000"):
        export_program(parse_program(text * 2), EV3, "pybricks2")


@needs_brick
def test_an_exported_program_with_memory_drives_as_simulated(tmp_path) -> None:
    program = parse_program(EVERYTHING)
    world = World(EV3, WORLD.course, time_limit_s=3.0)
    trace = simulate(world, program.opcodes, trace=True).trace
    main = export_program(program, EV3, "pybricks2")["main.py"]
    played = brick.SimulatedBrick(SteppedRobot(world), world.course)
    assert (
        brick.run_on(played, main.replace("TIME_LIMIT_MS = 60000", "TIME_LIMIT_MS = 2500"), tmp_path) is None
    )
    log = np.loadtxt(played.files["gecar_log_2026.csv"].splitlines()[2:], delimiter=",", usecols=(0, 1, 2))
    log = log[np.rint(1000 * log[:, 0]) % 10 == 0][
        :-1
    ]  # between them rows of commands, which the trace has not
    rows = np.rint(log[:, 0] / 0.01).astype(int)
    assert len(rows) > 240
    for column, name in ((1, "left_duty"), (2, "right_duty")):
        np.testing.assert_array_equal(log[:, column], np.rint(100 * trace[name][rows]), err_msg=name)
