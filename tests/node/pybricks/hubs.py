from pybricks.wire import call


class _Buttons:
    def pressed(self):
        return call("pressed")


class _Battery:
    def voltage(self):
        return call("voltage")


class _Speaker:
    def beep(self):
        call("beep")


class _Screen:
    def clear(self):
        call("clear")

    def print(self, *words):
        call("show", " ".join([str(word) for word in words]))


class _Display:
    def char(self, _letter):
        call("clear")


class _System:
    def set_stop_button(self, _button):
        pass

    def storage(self, offset, read=None, write=None):
        if write is not None:
            call("keep", offset, list(write))
            return None
        return bytes(call("kept", offset, read))


class EV3Brick:
    def __init__(self):
        self.buttons = _Buttons()
        self.battery = _Battery()
        self.speaker = _Speaker()
        self.screen = _Screen()
        self.system = _System()


class PrimeHub:
    def __init__(self):
        self.buttons = _Buttons()
        self.battery = _Battery()
        self.speaker = _Speaker()
        self.display = _Display()
        self.system = _System()
