"""A simulated EV3: exported programs run on it under MicroPython (in node), their motors and sensor gecar's own.

Needs node, and what `make test` installs where there is npm: `npm install --prefix tests/node`.
"""

import json
import shutil
import subprocess
from pathlib import Path

NODE = Path(__file__).parents[1] / "node"
PATIENCE_MS = 200_000.0
MISSING = None
if shutil.which("node") is None:
    MISSING = "node is not installed"
elif not (NODE / "node_modules" / "@micropython").is_dir():
    MISSING = "MicroPython is not installed: npm install --prefix tests/node"


class SimulatedBrick:
    """What `pybricks` talks to: a clock, buttons, a screen, files, and a robot on a course.

    A person is played, too: who puts the sensor where the screen says, presses what it says, and presses a button
    again when the robot is at GOAL.

    Parameters
    ----------
    robot
        A `gecar.world.stepped_robot.SteppedRobot`; None for a brick on the table.
    course
        Where the robot drives.
    white, black
        What the brick's own sensor reads where the simulated one reads 100 and 0.
    cost_ms
        What each call of a device takes [ms].
    pressed_after_ms
        When the person presses a button, whatever happens.
    """

    def __init__(self, robot=None, course=None, white=100, black=0, cost_ms=0.0, pressed_after_ms=None):
        self.robot, self.course = robot, course
        self.white, self.black = white, black
        self.cost_ms, self.pressed_after_ms = cost_ms, pressed_after_ms
        self.now_ms = 0.0
        self.start_ms = None
        self.arrival_s = None
        self.visited = 0
        self.screen, self.screens, self.printed = [], [], []
        self.cleared_ms = 0.0
        self.files = {}
        self.storage = bytearray(512)
        self.duties = {}
        self.commands = []
        self.zeros = {}

    # --- time

    def advance(self, ms):
        """Let time pass in steps of a millisecond, once the robot drives."""
        left = ms
        while left > 0:
            step = min(1.0, left)
            left -= step
            self.now_ms += step
            if self.robot is not None and self.start_ms is not None:
                self.robot.advance(step)
                self.look_for_goal()

    def look_for_goal(self):
        """Follow the checkpoints, as the course's `sequence` has them."""
        if self.visited < len(self.course.sequence):
            x, y, _ = self.robot.pose
            tile = int(y / self.course.tile_size_m) * self.course.columns + int(x / self.course.tile_size_m)
            if tile == self.course.sequence[self.visited]:
                self.visited += 1
                if self.visited == len(self.course.sequence):
                    self.arrival_s = self.robot.time_s

    # --- what the stub package calls

    def answer(self, name, *values):
        if self.now_ms > PATIENCE_MS:
            raise TimeoutError(f"the program is still running; the screen shows {self.screen}")
        if name in ("dc", "run", "angle", "reflection", "voltage", "pressed"):
            self.advance(self.cost_ms)
        return getattr(self, "on_" + name)(*values)

    def on_time(self):
        return int(self.now_ms)

    def on_wait(self, ms):
        self.advance(ms)

    def on_dc(self, port, duty):
        if self.start_ms is None:
            self.start_ms = self.now_ms
        self.duties[port] = duty / 100.0
        self.commands.append((self.now_ms - self.start_ms, port, duty))
        if self.robot is not None:
            self.robot.set_duty(self.duties.get("B", 0.0), self.duties.get("C", 0.0))

    def on_run(self, port, speed):
        self.on_dc(port, speed / 10.0)

    def on_angle(self, port):
        angle = 0.0 if self.robot is None else self.robot.angles_deg[port == "C"]
        return round(angle) - self.zeros.get(port, 0)

    def on_reset_angle(self, port, angle):
        self.zeros[port] = self.on_angle(port) + self.zeros.get(port, 0) - angle

    def on_reflection(self, _port):
        if "over bare floor" in self.screen or "over the line" in self.screen:
            return self.white if "over bare floor" in self.screen else self.black
        seen = self.seen()
        return round(self.black + (self.white - self.black) * seen / 100.0)

    def seen(self):
        """What a sensor of 100 on white and 0 on black sees while driving [%]."""
        return 100.0 if self.robot is None else self.robot.reflection_pct

    def on_voltage(self):
        return 8000 if self.robot is None else round(1000 * self.robot.battery_v)

    def on_pressed(self):
        if "Any button stops." in self.screen:
            driven_ms = 0.0 if self.start_ms is None else self.now_ms - self.start_ms
            late = self.pressed_after_ms is not None and driven_ms >= self.pressed_after_ms
            return ["CENTER"] if self.arrival_s is not None or late else []
        pressing = 300.0 <= self.now_ms - self.cleared_ms < 400.0
        return ["CENTER"] if pressing and any("CENTER" in line for line in self.screen) else []

    def on_clear(self):
        self.screen = []
        self.cleared_ms = self.now_ms

    def on_show(self, line):
        self.screen.append(line)
        self.screens.append(line)

    def on_print(self, line):
        self.printed.append(line)
        if line.startswith("# "):  # a SPIKE hub's screen is the terminal
            self.on_show(line[2:])

    def on_log(self, name, line):
        self.files[name] = self.files.get(name, "") + line + "\n"

    def on_keep(self, offset, values):
        self.storage[offset : offset + len(values)] = bytes(values)

    def on_kept(self, offset, count):
        return list(self.storage[offset : offset + count])

    def on_beep(self):
        pass


def run_on(brick, main, tmp_path):
    """Run a main.py on a simulated brick to its end; return the error it ended with, or None.

    It has the memory of the real one: a megabyte on an EV3 under 2.0, a quarter of one on a SPIKE hub.
    """
    path = tmp_path / "main.py"
    path.write_text(main, newline="")
    heap = 256 * 1024 if "PrimeHub" in main else 1024 * 1024
    command = ["node", str(NODE / "brick.mjs"), str(path), str(heap)]
    node = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
    try:
        for line in node.stdout:
            name, *values = json.loads(line)
            if name == "end":
                return values[0]
            node.stdin.write(json.dumps(brick.answer(name, *values)) + "\n")
            node.stdin.flush()
        return f"node ended with code {node.wait()}"
    finally:
        node.kill()
        node.wait()
