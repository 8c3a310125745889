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

``line`` is the statement's line in `gecar.language.program.Program.source`, counted from 1. After the last
row the program starts again at row 0; a target equal to the number of rows means the same.
"""

from __future__ import annotations

OP, A, B, C, TARGET, LINE = range(6)
"""Columns."""
N_COLUMNS = 6

MOTOR, MOTOR_UNTIL, TEST, JUMP = range(4)
"""What column `OP` holds."""

SENSOR, LEFT_SENSOR, RIGHT_SENSOR = range(3)
"""Which colour sensor a TEST reads (column `A`)."""

GREATER, LESS, GREATER_EQUAL, LESS_EQUAL, EQUAL, NOT_EQUAL = range(6)
"""How a TEST compares the sensor with its threshold (column `B`)."""

MAX_DUTY_PCT = 100
MAX_TIME_MS = 60_000  # the paper's limit on a whole run, 60 s (section 3.2.2)
THRESHOLDS_PER_PCT = 1_000
MAX_THRESHOLD_PCT = 1_000  # far outside what a sensor reads, well inside int32
