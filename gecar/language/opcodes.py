"""The numbers of compiled programs: rows of int32, ``[op, a, b, c, target, line]``.

=========== === ================================================== =======================================
op           #   a, b, c                                            then
=========== === ================================================== =======================================
MOTOR        0   left duty [%], right duty [%], time [ms]           the next row
MOTOR_UNTIL  1   left duty [%], right duty [%], longest time [ms]   the row after the TEST in the next row,
                                                                    when that holds or the time is over
TEST         2   sensor, comparison, threshold [%/1000]             the next row if it holds, else `target`
JUMP         3                                                      row `target`
=========== === ================================================== =======================================

Calculation is on a stack, which is empty between statements. Numbers are whole thousandths within `MAX_VALUE`, and
whatever leaves that range stays at its end; products and quotients are rounded down. So results are equal, to the bit,
in the simulator and on a brick, whatever its floating-point numbers are.

=========== === ================================================== =======================================
op           #   a, b, c                                            does
=========== === ================================================== =======================================
CONSTANT     4   c: a number [1/1000]                               pushes it
READING      5   a: sensor                                          pushes what the sensor reports now
PREVIOUS     6   a: sensor                                          pushes what REMEMBER kept of the sensor
TIMER        7                                                      pushes the time since RESET_TIMER [ms]
REGISTER     8   a: register                                        pushes what SET put there
ADD          9   a: whether with c [1/1000]                         replaces two numbers by their sum, or adds c
                                                                    to one
SUBTRACT     10  as ADD                                             the same, with their difference
MULTIPLY     11  as ADD                                             their product
DIVIDE       12  as ADD                                             their quotient; by 0: `MAX_VALUE`, -`MAX_VALUE`
                                                                    or 0
COMPARE      13  a, c: as ADD, b: comparison                        takes two, or one; goes on if it holds, else
                                                                    to `target`
SET          14  a: register                                        takes a number, into the register
RESET_TIMER  15                                                     starts the timer again
REMEMBER     16  a: sensor                                          keeps what it reports, for PREVIOUS
DRIVE        17  b: until, c: time [ms]                             takes two duties [%], rounded and cut to
                                                                    100: as MOTOR; if b, the rows from the
                                                                    next one on are asked in every step
HOLD         18                                                     asked so: drive on; at `target` of the
                                                                    DRIVE, go on there
LOOP         19                                                     row `target`, which stands before it; in
                                                                    the next step if the turn took no time
=========== === ================================================== =======================================

``line`` is the statement's line in `gecar.language.program.Program.source`, counted from 1. After the last
row the program starts again at row 0; a target equal to the number of rows means the same. Only LOOP goes backwards.
"""

from __future__ import annotations

OP, A, B, C, TARGET, LINE = range(6)
"""Columns."""
N_COLUMNS = 6

MOTOR, MOTOR_UNTIL, TEST, JUMP = range(4)
CONSTANT, READING, PREVIOUS, TIMER, REGISTER, ADD, SUBTRACT, MULTIPLY, DIVIDE, COMPARE = range(4, 14)
SET, RESET_TIMER, REMEMBER, DRIVE, HOLD, LOOP = range(14, 20)
"""What column `OP` holds."""

SENSOR, LEFT_SENSOR, RIGHT_SENSOR = range(3)
"""Which colour sensor a row reads (column `A`)."""

READING_OPS = (TEST, READING, PREVIOUS)
"""The rows that do."""

GREATER, LESS, GREATER_EQUAL, LESS_EQUAL, EQUAL, NOT_EQUAL = range(6)
"""How a TEST compares the sensor with its threshold, or a COMPARE two numbers (column `B`)."""

MAX_DUTY_PCT = 100
MAX_TIME_MS = 60_000  # the paper's limit on a whole run, 60 s (section 3.2.2)
THRESHOLDS_PER_PCT = 1_000
MAX_THRESHOLD_PCT = 1_000  # far outside what a sensor reads, well inside int32

ONE = THRESHOLDS_PER_PCT
"""What calculation has for 1."""
MAX_VALUE = 100_000 * ONE  # more than a run has milliseconds; well inside int32, its square inside int64
N_REGISTERS = 8
MAX_OPERATIONS = 100
"""Operations in one statement."""
STACK = MAX_OPERATIONS + 4
"""What its rows need at most."""
