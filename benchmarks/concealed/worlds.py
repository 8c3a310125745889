"""The truth worlds by name, and what each can hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol

from benchmarks.concealed.history import ROW_TICKS, Array, Controller, History, Pose
from benchmarks.concealed.robot import NEUTRAL, Concealed

WORLDS = ("mujoco", "continuous", "bullet")

# Fields of `Concealed` that a world has no law for.
_NOT_HELD = {
    "mujoco": {"loosening", "inductance_scale", "presliding_scale", "creep_scale"},
    "continuous": set(),
    "bullet": {"oval", "creep_scale", "clutch", "nap", "leak"},
}


class Truth(Protocol):
    """One concealed robot in one world, ready to be driven any number of times."""

    concealed: Concealed

    def run(
        self,
        start: Pose,
        controller: Controller,
        seconds: float,
        reading_noise: Array | None = None,
        turn_ticks: int = ROW_TICKS,
        ended: Callable[[float, float], bool] | None = None,
    ) -> History:
        """Drive from rest.

        Parameters
        ----------
        start
            Pose of the axle's centre [m, m, rad].
        controller
            From time [s] and sensor reading [%] to left and right duty [%]; ``None`` ends the run.
        seconds
            Length of the run by the brick's clock [s].
        reading_noise
            Noise on the sensor's reading per tick (n,) [%], before rounding.
        turn_ticks
            Ticks between two turns of the controller.
        ended
            From the axle's place [m] to whether the run is over; asked whenever the controller is.

        Returns
        -------
        History
            One entry per tick, the first before anything moved.

        Raises
        ------
        ToppledError
            If the robot falls over: it leans by more than 20 degrees, or a wheel or the caster stays in the air.
        """
        ...


def truth(world: str, concealed: Concealed) -> Truth:
    """Build a robot in a world.

    Parameters
    ----------
    world
        One of ``WORLDS``.
    concealed
        What differs from the nominal robot.

    Returns
    -------
    Truth

    Raises
    ------
    ValueError
        If there is no such world, or it cannot hold what is concealed.
    """
    if world not in WORLDS:
        message = f"found world {world}, expected one of: {', '.join(WORLDS)}"
        raise ValueError(message)
    unlike = {field for field, number in vars(concealed).items() if number != getattr(NEUTRAL, field)}
    if foreign := unlike & _NOT_HELD[world]:
        message = f"the {world} world has no law for: {', '.join(sorted(foreign))}"
        raise ValueError(message)
    # Each world is imported when it is asked for: none needs another's engine.
    if world == "mujoco":
        from benchmarks.concealed.truth import Truth as Mujoco  # noqa: PLC0415

        return Mujoco(concealed)
    if world == "continuous":
        from benchmarks.concealed.continuous.world import Truth as Continuous  # noqa: PLC0415

        return Continuous(concealed)
    from benchmarks.concealed.bullet.world import Truth as Bullet  # noqa: PLC0415

    return Bullet(concealed)


def holds(world: str, fields: Iterable[str]) -> bool:
    """Say whether a world has laws for these fields of ``Concealed``."""
    return not _NOT_HELD[world] & set(fields)
