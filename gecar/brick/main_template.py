"""The text of main.py around the program: MicroPython 1.11, so no f-strings and nothing newer.

Words in double brackets are filled in by `gecar.brick.export`. Facts that shaped it: the ``Back`` button (on a SPIKE
hub the Bluetooth button) ends a program at once, unsaved. ``print`` and the log's file take milliseconds a line, so the
run is kept in memory, 17 bytes a row, and written after it, which also leaves little for the garbage collector to stop
the robot for.
"""

SHEBANG = "#!/usr/bin/env pybricks-micropython\n"

TOP = '''"""[[TITLE]]

Made by gecar export. [[HOW_TO_START]]

1. The first time, or on LEFT: put the colour sensor over bare floor and then over the line, with CENTER each time.
2. Put the robot on START and press CENTER. It drives [[LIMIT]] s at most, or until a button is pressed.
   (Not the [[STOP_BUTTON]] button: it ends the program at once, and the log is lost.)
3. [[HOW_TO_GET_THE_LOG]]
"""

from ustruct import calcsize, pack_into, unpack_from

from pybricks.[[DEVICES]] import ColorSensor, Motor
from pybricks.hubs import [[HUB]]
from pybricks.parameters import Button, Direction, Port
from pybricks.tools import [[TOOLS]]

# Your robot. Change these where it is built otherwise.
LEFT_MOTOR = Port.[[LEFT_MOTOR]]
RIGHT_MOTOR = Port.[[RIGHT_MOTOR]]
LEFT_FORWARD = Direction.[[LEFT_FORWARD]]
RIGHT_FORWARD = Direction.[[RIGHT_FORWARD]]
[[SENSOR_PORTS]]
WHEEL_DIAMETER_MM = [[WHEEL_DIAMETER]]
TRACK_WIDTH_MM = [[TRACK_WIDTH]]
DUTY_CAP_PCT = [[DUTY_CAP]]

# The program's thresholds are meant for a sensor that reads these, whatever yours reads on your floor.
WHITE_PCT = [[WHITE]]
BLACK_PCT = [[BLACK]]

TIME_LIMIT_MS = [[LIMIT]]000
ROW_MS = [[ROW_MS]]


'''

SAY_ON_SCREEN = '''def say(*lines):
    """Show lines on the brick's screen."""
    hub.screen.clear()
    for line in lines:
        hub.screen.print(line)
'''

SAY_IN_TERMINAL = '''def say(*lines):
    """Print lines in Pybricks Code, as remarks of the log, and show the first letter on the hub."""
    hub.display.char(lines[0][0])
    for line in lines:
        print("# " + line)
'''

DRIVING = '''

hub = [[HUB]]()
[[STOP_SETTING]]left_motor = Motor(LEFT_MOTOR, LEFT_FORWARD)
right_motor = Motor(RIGHT_MOTOR, RIGHT_FORWARD)
sensors = [[SENSORS]]
calibration = []  # what each sensor reads over bare floor and over the line
clock = StopWatch()
due_ms = 0  # the schedule: when the motor statement now running is over
left_duty = 0
right_duty = 0

# The log, packed: ms, two duties, reflection, two angles, battery.
COLUMNS = (
    [[COLUMNS]]
)
ROW = "<IbbBiiH"
ROW_BYTES = calcsize(ROW)
MOST_ROWS = 2 * TIME_LIMIT_MS // ROW_MS
rows = bytearray(MOST_ROWS * ROW_BYTES)
row_count = 0
row_ms = -1
battery_ms = -1000


class Finished(Exception):
    """The time is over, or a button was pressed."""


def motor(left, right, time_ms):
    """Drive with two duties for a time."""
    global due_ms
    command(left, right)
    due_ms += time_ms
    drive_until_due(None)


def motor_until(left, right, most_ms, test):
    """Drive with two duties until a test holds, for a time at most."""
    global due_ms
    command(left, right)
    due_ms += most_ms
    drive_until_due(test)


def command(left, right):
    """Set both duties, and log from when."""
    global left_duty, right_duty
[[KEEP_READINGS]]    left_duty = left
    right_duty = right
    left_motor.[[COMMAND]]
    right_motor.[[COMMAND_RIGHT]]
    log_row()


def capped(duty):
    return max(-DUTY_CAP_PCT, min(DUTY_CAP_PCT, duty))


def drive_until_due(test):
    """Let the schedule run, with a row in the log every ROW_MS.

    Waiting is until a time, never for a time: what the calls in between take is not added up.
    """
    global due_ms
    next_row_ms = clock.time() // ROW_MS * ROW_MS + ROW_MS
    while True:
        now = clock.time()
        if now >= TIME_LIMIT_MS or hub.buttons.pressed():
            raise Finished
        if now >= due_ms:
            return
        if now >= next_row_ms:
            log_row()
            next_row_ms += ROW_MS
        pause = min(due_ms, next_row_ms) - clock.time()
        if test:
            pause = min(pause, 2)
        if pause > 0:
            wait(pause)
        if test and test():
            due_ms = min(due_ms, clock.time())
            return


[[MEMORY]][[SENSOR_FUNCTIONS]]
def reading(number):
    """Return a sensor's reflected light on the scale of WHITE_PCT and BLACK_PCT, in whole percent."""
    white, black = calibration[number]
    share = (sensors[number].reflection() - black) / (white - black)
    return max(0, min(100, int(BLACK_PCT + share * (WHITE_PCT - BLACK_PCT) + 0.5)))


def log_row():
    """Keep what is so now; a second row of the same millisecond takes the place of the first."""
    global row_count, row_ms, battery_ms
    now = clock.time()
    if now == row_ms:
        row_count -= 1
    if row_count == MOST_ROWS:
        return
    battery = 0
    if now >= battery_ms + 100 or now == battery_ms:
        battery = hub.battery.voltage()
        battery_ms = now
    angles = (left_motor.angle(), right_motor.angle())
    light = [[LIGHT]]
    pack_into(ROW, rows, row_count * ROW_BYTES, now, left_duty, right_duty, light, angles[0], angles[1], battery)
    row_count += 1
    row_ms = now


def save_log():
    """Write the rows, times in seconds; a battery that was not read stays blank."""
[[OPEN_LOG]]
    for number in range(row_count):
        ms, left, right, light, left_angle, right_angle, battery = unpack_from(ROW, rows, number * ROW_BYTES)
        volts = "{}.{:03d}".format(battery // 1000, battery % 1000) if battery else ""
        time = "{}.{:03d}".format(ms // 1000, ms % 1000)
        [[WRITE_ROW]]


[[SAY]]

def wait_for(*buttons):
    """Wait until one of some buttons is pressed and let go, and return it; one held from before does not count."""
    while hub.buttons.pressed():
        wait(10)
    while True:
        pressed = [button for button in buttons if button in hub.buttons.pressed()]
        if pressed:
            while hub.buttons.pressed():
                wait(10)
            return pressed[0]
        wait(10)


def calibrate():
    """Read every sensor over bare floor and over the line, and keep that for the next time."""
    del calibration[:]
    for number in range(len(sensors)):
        white = read_over(number, "bare floor")
        black = read_over(number, "the line")
        while white < black + 10:
            say("Too alike:", str(white) + " and " + str(black), "Once more ...")
            wait(2000)
            white = read_over(number, "bare floor")
            black = read_over(number, "the line")
        calibration.append((white, black))
    keep_calibration()


def read_over(number, place):
    """Return what a sensor reads over a place, the mean of 20 readings."""
    say("Sensor " + str(number + 1), "over " + place, "then CENTER")
    wait_for(Button.CENTER)
    total = 0
    for _ in range(20):
        total += sensors[number].reflection()
        wait(10)
    return (total + 10) // 20


'''

RUN = '''

def drive():
    """Repeat the program until it is over."""
    global due_ms
    while True:
        before_ms = due_ms
        program()
        if due_ms == before_ms:  # a pass that takes no time must not hang the brick
            due_ms += 1
            drive_until_due(None)


def run():
    find_calibration()
    if not calibration:
        calibrate()
    while True:
        say("CENTER drives", "LEFT calibrates", "white, black:", *[str(pair) for pair in calibration])
        if wait_for(Button.CENTER, Button.LEFT) == Button.CENTER:
            break
        calibrate()
    say("Any button stops.", "Not [[STOP_BUTTON]]: that", "loses the log.")
    for sensor in sensors:
        sensor.reflection()  # the first reading switches its light on, which takes a while
    wait(500)
    left_motor.reset_angle(0)
    right_motor.reset_angle(0)
    clock.reset()
    try:
        drive()
    except Finished:
        pass
    finally:
        left_motor.brake()
        right_motor.brake()
[[BEFORE_SAVING]]
    save_log()
    per_degree = 3.1416 * WHEEL_DIAMETER_MM / 360
    left = left_motor.angle() * per_degree
    right = right_motor.angle() * per_degree
    turned = (right - left) / TRACK_WIDTH_MM * 57.3
    say("Saved. Drove", "{:.2f} m".format((left + right) / 2000), "turned left by", "{:.0f} deg".format(turned))
    hub.speaker.beep()
    wait(5000)


run()
'''
