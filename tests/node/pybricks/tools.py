from pybricks.wire import call


def wait(time):
    call("wait", time)


class StopWatch:
    def __init__(self):
        self.started = call("time")

    def time(self):
        return call("time") - self.started

    def reset(self):
        self.started = call("time")


class DataLog:
    def __init__(self, *headers, name="log", timestamp=True, extension="csv", append=False):
        self.name = name + ("_2026" if timestamp else "") + "." + extension
        if headers:
            self.log(*headers)

    def log(self, *values):
        call("log", self.name, ", ".join([str(value) for value in values]))
