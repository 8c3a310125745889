"""What a verdict rests on."""

from __future__ import annotations

from dataclasses import dataclass

from gecar.reality.locate.mismatch_map import MismatchMap
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.stepwise import Explanation
from gecar.world.robot import Robot


@dataclass(frozen=True)
class Evidence:
    """What a verdict rests on, for pictures and for the curious.

    Attributes
    ----------
    motion, sensing
        What explains the motion, and the colour sensor's readings; None where there are none to compare.
    where
        Where simulation and reality part.
    fitted, held
        The recordings fitted on and set aside, beside their simulation, with their nuisances.
    held_before
        Those set aside with the nuisances of the robot as it was known.
    before
        The robot as it was known.
    """

    motion: Explanation
    sensing: Explanation | None
    where: MismatchMap
    fitted: Residuals
    held: Residuals
    held_before: Residuals
    before: Robot

    def __str__(self) -> str:
        words = [_summary("motion", self.motion)]
        if self.sensing is not None:
            words.append(_summary("sensor", self.sensing))
        return "; ".join(words)


def _summary(name: str, explained: Explanation) -> str:
    tried = [
        f"{s.effect}{'' if s.worthwhile else '-'} {s.gain:.0f}"
        for s in (explained.tried[-1][:3] if explained.tried else ())
    ]
    size = explained.left
    left = (
        f"{size.mm_1m:.1f} mm {size.deg_1m:.2f} deg a metre"
        if not size.reading_pct
        else f"{size.reading_pct:.1f} %"
    )
    return f"{name}: left {left}; last tried: {', '.join(tried)}"
