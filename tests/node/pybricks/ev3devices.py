from pybricks.wire import call


class Motor:
    def __init__(self, port, positive_direction=1):
        self.port = port
        self.sign = positive_direction

    def dc(self, duty):
        call("dc", self.port, self.sign * int(max(-100, min(100, duty))))  # whole percent, as on the brick

    def run(self, speed):
        call("run", self.port, self.sign * speed)

    def brake(self):
        call("dc", self.port, 0)

    def angle(self):
        return self.sign * call("angle", self.port)

    def reset_angle(self, angle):
        call("reset_angle", self.port, self.sign * angle)


class ColorSensor:
    def __init__(self, port):
        self.port = port

    def reflection(self):
        return call("reflection", self.port)
