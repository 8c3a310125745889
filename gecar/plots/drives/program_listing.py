"""A program beside a picture: its lines, each in the colour its part of the drive has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from gecar.plots.style import INK, LIGHT, SOFT

SMALLEST_PT, LARGEST_PT = 5.5, 9.0
_LEADING = 1.45


class Listing:
    """A program's text on axes of its own.

    Parameters
    ----------
    axes
        Where; they lose their frame.
    source
        The program.
    colours
        Colour of each line that drove, by its number from 1.
    """

    def __init__(self, axes: Axes, source: str, colours: Mapping[int, str]) -> None:
        self.axes = axes
        axes.set_axis_off()
        axes.set(xlim=(0, 1), ylim=(0, 1))
        lines = source.splitlines()
        count, size, self.pitch = _type_size(axes, lines)
        self.texts: list[Text] = []
        self.light = Rectangle(
            (0.155, 0), 0.845, self.pitch, facecolor=LIGHT, edgecolor="none", visible=False
        )
        axes.add_patch(self.light)
        for number, line in enumerate(lines[:count], start=1):
            self._line(number, line, colours.get(number), size)
        if count < len(lines):
            words = f"... {len(lines) - count} more lines"
            axes.text(0.17, 1 - (count + 0.5) * self.pitch, words, color=SOFT, size=size, va="center")

    def _line(self, number: int, line: str, colour: str | None, size: float) -> None:
        y = 1 - (number - 0.5) * self.pitch
        if colour:
            bar = Rectangle((0.0, y - 0.42 * self.pitch), 0.025, 0.84 * self.pitch, facecolor=colour)
            self.axes.add_patch(bar)
        mono: dict[str, Any] = {"family": "DejaVu Sans Mono", "size": size, "va": "center"}
        self.axes.text(0.13, y, str(number), color=SOFT, ha="right", **mono)
        self.texts.append(self.axes.text(0.17, y, line, color=INK, **mono))

    def lit(self, number: int) -> Rectangle:
        """Light a line by its number from 1, and return what to draw; a line out of view stays dark."""
        self.light.set_visible(1 <= number <= len(self.texts))
        self.light.set_y(1 - number * self.pitch)
        return self.light


def _type_size(axes: Axes, lines: list[str]) -> tuple[int, float, float]:
    """Return how many lines fit, the type's size [pt], and a line's share of the height."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()  # only now the layout has given the axes their place
    box = axes.get_window_extent()
    width_pt, height_pt = (72.0 / figure.dpi * side for side in (box.width, box.height))
    count = min(len(lines), max(int(height_pt / (_LEADING * SMALLEST_PT)) - 1, 1))
    widest = max((len(line) for line in lines[:count]), default=1)
    by_width = 0.82 * width_pt / (0.602 * max(widest, 1))  # a DejaVu Sans Mono character is 0.602 em wide
    by_height = height_pt / (_LEADING * (count + 1))
    size = min(LARGEST_PT, by_width, by_height)
    return count, size, _LEADING * size / height_pt
