class Button:
    LEFT = "LEFT"
    RIGHT = "RIGHT"
    CENTER = "CENTER"
    UP = "UP"
    DOWN = "DOWN"
    BLUETOOTH = "BLUETOOTH"


class Port:
    A = "A"
    B = "B"
    C = "C"
    D = "D"
    E = "E"
    F = "F"
    S1 = "S1"
    S2 = "S2"
    S3 = "S3"
    S4 = "S4"


class Direction:
    CLOCKWISE = 1
    COUNTERCLOCKWISE = -1


class Stop:
    COAST = 0
    BRAKE = 1
    HOLD = 2
