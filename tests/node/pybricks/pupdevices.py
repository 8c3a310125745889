from pybricks.ev3devices import ColorSensor, Motor

__all__ = ["ColorSensor", "Motor"]
