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
    before
        The robot as it was known.
    """

    motion: Explanation
    sensing: Explanation | None
    where: MismatchMap
    fitted: Residuals
    held: Residuals
    before: Robot

    def __str__(self) -> str:
        words = [_summary("motion", self.motion)]
        if self.sensing is not None:
            words.append(_summary("sensor", self.sensing))
        return "; ".join(words)


def _summary(name: str, explained: Explanation) -> str:
    blocks = max(explained.problem.blocks, 1)
    tried = [
        f"{s.effect}{'' if s.worthwhile else '-'} {s.gain:.0f}/{s.model.excess_energy / blocks:.2f}"
        for s in (explained.tried[-1][:3] if explained.tried else ())
    ]
    before, after = explained.problem.known.excess_energy / blocks, explained.taken.excess_energy / blocks
    return f"{name} {before:.2f} -> {after:.2f} last tried: {', '.join(tried)}"
