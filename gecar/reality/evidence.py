"""What a verdict rests on."""

from __future__ import annotations

from dataclasses import dataclass

from gecar.reality.locate.mismatch_map import Map
from gecar.reality.residuals.of_recording import Strip
from gecar.reality.selection.selection import Selection
from gecar.reality.selection.stepwise import Explanation
from gecar.world.robot import Robot


@dataclass(frozen=True)
class Evidence:
    """What a verdict rests on: selections and explanations of motion and of sight, for pictures and for the curious."""

    motion: Selection
    moved: Explanation
    sight: Selection | None
    seen: Explanation | None
    where: Map
    strips: tuple[Strip, ...]
    held: tuple[Strip, ...]
    before: Robot

    def __str__(self) -> str:
        words = [_told("motion", self.motion, self.moved)]
        if self.sight is not None and self.seen is not None:
            words.append(_told("sight", self.sight, self.seen))
        return "; ".join(words)


def _told(name: str, selection: Selection, explained: Explanation) -> str:
    blocks = max(selection.blocks.count, 1)
    tried = [
        f"{s.effect}{'' if s.worthwhile else '-'} {s.gain:.0f}/{s.model.structure / blocks:.2f}"
        for s in (explained.tried[-1][:3] if explained.tried else ())
    ]
    before, after = selection.nothing.structure / blocks, explained.taken.structure / blocks
    return f"{name} {before:.2f} -> {after:.2f} last tried: {', '.join(tried)}"
