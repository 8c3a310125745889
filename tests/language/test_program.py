"""The robot language: both of the paper's ways of writing, printing, opcodes, and errors."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gecar.errors import InputError
from gecar.language.conditions import Comparison, Threshold
from gecar.language.grammar import load_grammar, parse_grammar
from gecar.language.program import Program, mirrored, parse_program, read_program
from gecar.language.robot_language import check_robot_language
from gecar.language.statements import If, Motor, MotorUntil, Statement
from gecar.language.values import Sensor

FIG_6 = """if(SensorValue > 80):
    motor(80,80,50)
else:
    motor(80,0,160)"""
WHITE = Threshold(Sensor.CENTRE, Comparison.GREATER, 80_000)
LINE_TRACER = Program((If(WHITE, (Motor(80, 80, 50),), (Motor(80, 0, 160),)),))


def test_fig_6_is_read_and_printed_as_printed() -> None:
    assert parse_program(FIG_6) == LINE_TRACER
    assert LINE_TRACER.source == FIG_6


def test_fig_6_as_opcodes() -> None:
    assert LINE_TRACER.opcodes.dtype == np.int32
    assert LINE_TRACER.opcodes.tolist() == [
        [2, 0, 0, 80_000, 3, 1],
        [0, 80, 80, 50, 0, 2],
        [3, 0, 0, 0, 4, 1],
        [0, 80, 0, 160, 0, 4],
    ]


@pytest.mark.parametrize(
    "text",
    [
        "if SensorValue>(100+60)/2{motor(80, 80, 100+-50)} else{motor(80, 0, 100+60)}",
        "if( SensorValue>(100+60)/2): motor(80,80,50) else: motor(80,0,160)",
        "if SensorValue > 80: motor(80,80,50)\nelse: motor(80,0,160)",
        "if ((80) < (SensorValue)) {\n motor(+80, 2*40, 50);\n}\nelse {\n motor(80,-0,160) }\n",
        "\n\n  if 80.0 < SensorValue: # white\n\t motor(80,80,\n50)\n  else:\n\n\t motor(80,0,160)\n\n",
        "if SensorValue > 80 { pass; motor(80,80,50);; } else\n motor".replace(
            "\n motor", ":\n  motor(80,0,160)"
        ),
        "\ufeffif(SensorValue > 80):\r\n    motor(80,80,50)\r\nelse:\r\n    motor(80,0,160)\r\n",
    ],
)
def test_other_ways_of_writing_fig_6(text: str) -> None:
    assert parse_program(text) == LINE_TRACER


def test_statements_follow_each_other_with_and_without_separators() -> None:
    three = (Motor(1, 2, 3),) * 3
    for separator in ("", " ", "\n", "; ", "\n\n # and\n   "):
        assert parse_program(separator.join(["motor(1,2,3)"] * 3)).statements == three


def test_a_block_holds_the_lines_indented_below_its_if() -> None:
    program = parse_program(
        "if SensorValue > 1:\n"
        "    if SensorValue > 2:\n"
        "        motor(1,1,1)\n"
        "        motor(2,2,2)\n"
        "    else:\n"
        "        motor(3,3,3)\n"
        "    motor(4,4,4)\n"
        "motor(5,5,5)"
    )
    outer = program.statements[0]
    assert isinstance(outer, If)
    inner = outer.then[0]
    assert isinstance(inner, If)
    assert (len(program.statements), len(outer.then), len(inner.then), len(inner.otherwise)) == (2, 2, 2, 1)


def test_else_belongs_to_the_if_in_line_with_it() -> None:
    program = parse_program("if SensorValue > 1:\n  if SensorValue > 2 {motor(1,1,1)}\nelse:\n  motor(2,2,2)")
    outer = program.statements[0]
    assert isinstance(outer, If)
    assert outer.otherwise == (Motor(2, 2, 2),)


def test_elif_and_else_if_are_nested_ifs() -> None:
    nested = parse_program(
        "if SensorValue > 9: motor(1,1,1)\n"
        "else:\n"
        "    if SensorValue > 5: motor(2,2,2)\n"
        "    else: motor(3,3,3)"
    )
    for word in ("elif", "else if"):
        flat = f"if SensorValue>9:\n motor(1,1,1)\n{word} 5 < SensorValue:\n motor(2,2,2)\nelse: motor(3,3,3)"
        braces = (
            f"if 9<SensorValue {{motor(1,1,1)}} {word} SensorValue>5 {{motor(2,2,2)}} else {{motor(3,3,3)}}"
        )
        assert parse_program(flat) == parse_program(braces) == nested


def test_motor_until_is_followed_by_its_test() -> None:
    program = parse_program("motor_until(10,-20,500, RightSensorValue <= 12.5)")
    assert program.opcodes.tolist() == [[1, 10, -20, 500, 0, 1], [2, 2, 3, 12_500, 0, 1]]
    assert program.source == "motor_until(10,-20,500,RightSensorValue <= 12.5)"
    assert program.sensors == {Sensor.RIGHT}


def test_an_if_without_else_jumps_over_its_branch_only() -> None:
    program = parse_program("if LeftSensorValue != 5 {motor(1,1,1)} motor(2,2,2)")
    assert program.opcodes.tolist() == [[2, 1, 5, 5_000, 2, 1], [0, 1, 1, 1, 0, 2], [0, 2, 2, 2, 0, 3]]


def test_empty_programs_and_branches_are_legal() -> None:
    assert parse_program(" \n# nothing\n").opcodes.shape == (0, 6)
    program = parse_program("if SensorValue > 1 {} else {motor(1,1,1)}")
    assert program.source == "if(SensorValue > 1):\n    pass\nelse:\n    motor(1,1,1)"
    assert parse_program(program.source) == program


def test_blanks_without_end_take_no_time() -> None:
    assert parse_program(" " * 90_000 + "\x0b" + "\t" * 9_000) == Program(())


def test_numbers_are_rounded_to_what_the_robot_knows() -> None:
    program = parse_program("motor(200/3, -7/2, 100/3) if SensorValue > 100/3 {}")
    assert program.source.splitlines()[:2] == ["motor(67,-4,33)", "if(SensorValue > 33.333):"]


def test_the_same_rows_are_the_same_program_whatever_the_lines() -> None:
    one = Program((If(WHITE, (), ()), Motor(1, 1, 1)))
    two = parse_program("if SensorValue > 80: pass\nmotor(1,1,1)")
    assert one.canonical == two.canonical
    assert one.canonical != mirrored(LINE_TRACER).canonical


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("motr(1,2,3)", "line 1, column 1: found 'motr', expected motor, motor_until, if"),
        ("motor(1,2)", "line 1, column 10: found ')', expected ,"),
        ("motor(1,2,3", "line 1, column 12: found the end, expected )"),
        ("motor(1,2,3)\n  motor 1", "line 2, column 9: found '1', expected ("),
        ("motor(101,2,3)", "column 7: found '101', expected a duty of -100..100 percent"),
        ("motor(1,60 + 41,3)", "column 9: found '60 + 41', expected a duty"),
        ("motor(1,2,-1)", "column 11: found '-1', expected a time of 0..60000 ms"),
        ("motor(1,2,SensorValue)", "found 'SensorValue', expected a time of 0..60000 ms"),
        ("motor(1 + (SensorValue > 5),2,1)", "expected a value, since conditions are only asked"),
        ("motor(100001*SensorValue,2,1)", "expected numbers within 100000 where the robot calculates"),
        ("r0 = 1" + "+r0" * 101, "expected at most 100 operations in a statement"),
        ("r8 = 1", "found 'r8', expected motor, motor_until, if, while"),
        ("f()", "expected motor, motor_until, if, while, r0 = ..., reset_timer, def, a name it defined"),
        ("def f() { f() }", "found 'f', expected motor, motor_until, if"),
        ("def r0() {}", "found 'r0', expected a new name"),
        ("def f() {} def f() {}", "column 16: found 'f', expected a new name"),
        ("def a(){" + "motor(-10,-10,10000)" * 80 + "}" + "a()" * 99, "characters, macros written out"),
        ("def a(){" + "pass;" * 99 + "}" + "a();" * 99, "expected a program of at most 10000 statements"),
        ("motor(1/0,2,1)", "column 9: found '0', expected a divisor other than 0"),
        ("motor(99999999999999,2,1)", "expected numbers and divisors up to a million million"),
        ("motor(" + "9" * 50 + ",2,1)", "expected a number of at most 20 digits"),
        ("motor($,2,1)", "column 7: found '$', expected a number or SensorValue"),
        (
            "if 5 > 3 {}",
            "found '5 > 3', expected a sensor, timer or register on a side of the comparison",
        ),
        ("if SensorValue {}", "found 'SensorValue', expected a comparison, as SensorValue > 50"),
        ("if SensorValue > 1001 {}", "expected a threshold within 1000 percent"),
        ("if SensorValue > 5 motor(1,2,3)", "column 20: found 'motor', expected : or {"),
        ("if SensorValue > 5 { motor(1,2,3)", "found the end, expected } to close the branch"),
        ("if SensorValue > 5:", "found the end, expected motor, motor_until, if, while"),
        (
            "if SensorValue > 5:\nmotor(1,2,3)",
            "line 2, column 1: found 'motor', expected motor, motor_until, if, while",
        ),
        (
            "if SensorValue > 5:\n    motor(1,2,3)\n  motor(1,2,3)",
            "line 3, column 3: found 'motor', expected an indent of 4",
        ),
        (
            "if SensorValue > 5:\n motor(1,2,3)\n  else:\n motor(1,2,3)",
            "line 3, column 3: found 'else', expected an if bef",
        ),
        ("else: motor(1,2,3)", "found 'else', expected an if before it"),
        ("motor(1,2,3) }", "column 14: found '}', expected motor"),
        ("motor(1,2,3)" * 10_001, "expected a program of at most 100000"),
        (
            "pass\n" * 10_001,
            "line 10001, column 1: found 'pass', expected a program of at most 10000 statements",
        ),
        ("if SensorValue > 5 {" * 5_000, "expected at most 100 ifs and parentheses within each other"),
        ("motor(" + "(" * 5_000, "expected at most 100 ifs and parentheses within each other"),
        ("if SensorValue > " + "-" * 5_000 + "(" * 100, "expected at most 100 ifs"),
    ],
)
def test_a_bad_program_is_told_with_its_place(text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        parse_program(text, "best.txt")
    assert str(error.value).startswith("best.txt")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_programs_are_read_from_files(tmp_path: Path) -> None:
    (tmp_path / "fig6.txt").write_text(FIG_6)
    assert read_program(tmp_path / "fig6.txt") == LINE_TRACER
    with pytest.raises(InputError, match="no such file"):
        read_program(tmp_path / "fig7.txt")


duties = st.integers(-100, 100)
drives = st.tuples(duties, duties, st.integers(0, 60_000))
conditions = st.builds(
    Threshold, st.sampled_from(Sensor), st.sampled_from(Comparison), st.integers(-1_000_000, 1_000_000)
)
simple: st.SearchStrategy[Statement] = drives.map(lambda drive: Motor(*drive)) | st.builds(
    lambda drive, condition: MotorUntil(drive[0], drive[1], drive[2], condition), drives, conditions
)
statements = st.recursive(
    simple,
    lambda inner: st.builds(If, conditions, *[st.lists(inner, max_size=3).map(tuple)] * 2),
    max_leaves=12,
)
programs = st.lists(statements, max_size=4).map(lambda several: Program(tuple(several)))


def braced(several: tuple[Statement, ...]) -> str:
    """Write statements in one line, as Table 3 does."""
    return "".join(
        f"if {s.condition}{{{braced(s.then)}}} else{{{braced(s.otherwise)}}}" if isinstance(s, If) else str(s)
        for s in several
    )


@given(programs)
@settings(deadline=None, max_examples=150)
def test_what_is_printed_reads_back_the_same(program: Program) -> None:
    assert parse_program(program.source) == program
    assert parse_program(braced(program.statements)) == program


@given(programs)
@settings(deadline=None, max_examples=100)
def test_rows_know_their_lines_and_jump_forward(program: Program) -> None:
    lines = program.source.split("\n")
    words = {0: "motor(", 1: "motor_until(", 2: ("if(", "motor_until("), 3: "if("}
    for row, (op, _, _, _, target, line) in enumerate(program.opcodes.tolist()):
        assert lines[line - 1].lstrip().startswith(words[op])
        until = op == 2 and lines[line - 1].lstrip().startswith("motor_until(")
        assert row < target <= len(program.opcodes) if op in {2, 3} and not until else target == 0


@given(programs)
@settings(deadline=None, max_examples=100)
def test_a_mirror_image_s_mirror_image_is_the_program(program: Program) -> None:
    assert mirrored(mirrored(program)) == program
    assert [row[:2] for row in mirrored(Program((Motor(1, 2, 3),))).opcodes[:, 1:3].tolist()] == [[2, 1]]


table_3 = [
    "motor",
    "motor_until",
    "if",
    "else",
    "elif",
    "SensorValue",
    *"(){}:;,<>+-*/",
    "\n",
    " ",
    "\n  ",
    "5",
]
memory = [
    "while ",
    "def f()",
    "f()",
    "reset_timer()",
    "Timer",
    "PreviousValue",
    "r0",
    "r1 = ",
    " and ",
    " or ",
    "not ",
]
words = st.sampled_from(table_3 + memory)


@given(st.lists(words | st.text(max_size=2), max_size=30).map("".join))
@settings(deadline=None, max_examples=300)
def test_any_text_is_a_program_or_an_input_error(text: str) -> None:
    with suppress(InputError):
        program = parse_program(text)
        assert parse_program(program.source) == program


@pytest.mark.parametrize("name", ["paper", "fine", "rich", "rich_one_sensor", "nested"])
def test_shipped_grammars_speak_the_robot_language(name: str) -> None:
    grammar = load_grammar(name)
    assert grammar.warnings == ()
    check_robot_language(grammar)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "<a> ::= motor(1,2,3)\n | motor(1,2)",
            "g.bnf, line 2: found 'motor(1,2)', which gives 'motor(1,2)' (phenotype, ",
        ),
        (
            "<a> ::= motor(<d>,1,2)\n<d> ::= 1 | 2\n | 200",
            "g.bnf, line 3: found '200', which gives 'motor(200,1,2)'",
        ),
        (
            "<a> ::= <a0>\n"
            + "\n".join(f"<a{k}> ::= <a{k + 1}><a{k + 1}>" for k in range(60))
            + '\n<a60> ::= ""',
            "g.bnf, line 1: found '<a0>', whose shallowest phenotype is endlessly long",
        ),
    ],
)
def test_a_grammar_of_another_language_is_told(text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        check_robot_language(parse_grammar(text, "g.bnf"))
    assert message in str(error.value)
