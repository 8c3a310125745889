"""Islands: where the next individuals of each part of a population come from; most populations are one island."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.evolution.settings import EvolutionSettings

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]


class Island(NamedTuple):
    """A part of a population, and what follows it.

    Attributes
    ----------
    places
        Of its individuals in the population, from which parents are selected.
    copied
        Places of those that are copied: elites, or all where parents may live on; then migrants.
    children
        Number of children.
    """

    places: Int32s
    copied: Int32s
    children: int

    @property
    def drawn(self) -> int:
        """Number of children that are made: an even one, as they are made in pairs."""
        return self.children + self.children % 2


class Layout(NamedTuple):
    """Where individuals stand, island by island, in each the copied ones first.

    Attributes
    ----------
    order
        Places in all copied ones followed by all children drawn (population,).
    copied
        Which are copied (population,).
    islands
        The island of each (population,).
    """

    order: Int32s
    copied: Bools
    islands: Int32s


def divide(merits: Floats, settings: EvolutionSettings, generation: int, all_live_on: bool) -> list[Island]:
    """Divide a population into islands; migrants go round in a ring (Cohoon, Hegde, Martin, Richards, ICGA 1987).

    Parameters
    ----------
    merits
        Lower is better (population,).
    settings
        Sizes, islands and migration.
    generation
        Number of the next one.
    all_live_on
        Whether all individuals are copied, and compete with the children afterwards.
    """
    parts = np.array_split(np.arange(len(merits), dtype=np.int32), settings.islands)
    ranked = [part[np.argsort(merits[part], kind="stable")] for part in parts]
    migrants = 1 if settings.islands > 1 and generation % settings.migration_every == 0 else 0
    islands = []
    for k, part in enumerate(parts):
        stay = part if all_live_on else ranked[k][: settings.elites]
        copied = np.concatenate([stay, ranked[k - 1][:migrants]])
        children = (settings.offspring or settings.population) if all_live_on else settings.population
        room = children // settings.islands - (0 if all_live_on else len(copied))
        islands.append(Island(part, copied, room))
    return islands


def lay_out(islands: Sequence[Island]) -> Layout:
    """Return where the next individuals stand."""
    copied_before, drawn_before = 0, sum(len(island.copied) for island in islands)
    order, copied = [], []
    for island in islands:
        order += [copied_before + np.arange(len(island.copied)), drawn_before + np.arange(island.children)]
        copied += [np.ones(len(island.copied), bool), np.zeros(island.children, bool)]
        copied_before, drawn_before = copied_before + len(island.copied), drawn_before + island.drawn
    sizes = [len(island.copied) + island.children for island in islands]
    which = np.repeat(np.arange(len(islands), dtype=np.int32), sizes)
    return Layout(np.concatenate(order).astype(np.int32), np.concatenate(copied), which)
