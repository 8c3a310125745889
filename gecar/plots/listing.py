"""A program beside a picture: its lines, each in the colour its part of the drive has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from gecar.plots.style import INK, LIGHT, SOFT

MOST_LINES = 30


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
    around
        A line to keep in view where the program is longer than the picture.
    """

    def __init__(self, axes: Axes, source: str, colours: Mapping[int, str], around: int = 1) -> None:
        self.axes = axes
        axes.set_axis_off()
        axes.set(xlim=(0, 1), ylim=(0, 1))
        lines = source.splitlines()
        self.first = _first_shown(len(lines), around)
        shown = lines[self.first : self.first + MOST_LINES]
        size, pitch = _type_size(axes, shown)
        self.pitch = pitch
        self.texts: list[Text] = []
        self.light = Rectangle((0.155, 0), 0.845, pitch, facecolor=LIGHT, edgecolor="none", visible=False)
        axes.add_patch(self.light)
        for k, line in enumerate(shown):
            self._line(k, self.first + k + 1, line, colours.get(self.first + k + 1), size)
        self._rest(len(lines), len(shown), size)

    def _line(self, k: int, number: int, line: str, colour: str | None, size: float) -> None:
        y = 1 - (k + 0.5) * self.pitch
        if colour:
            self.axes.add_patch(
                Rectangle((0.0, y - 0.42 * self.pitch), 0.025, 0.84 * self.pitch, facecolor=colour)
            )
        mono: dict[str, Any] = {"family": "DejaVu Sans Mono", "size": size, "va": "center"}
        self.axes.text(0.13, y, str(number), color=SOFT, ha="right", **mono)
        self.texts.append(self.axes.text(0.17, y, line, color=INK, **mono))

    def _rest(self, total: int, shown: int, size: float) -> None:
        above, below = self.first, total - self.first - shown
        words = [f"{above} lines above" if above else "", f"{below} more lines" if below else ""]
        said = ", ".join(word for word in words if word)
        if said:
            self.axes.text(
                0.17, 1 - (shown + 0.5) * self.pitch, f"... {said}", color=SOFT, size=size, va="center"
            )

    def lit(self, number: int) -> Rectangle:
        """Light a line by its number from 1, and return what to draw; a line out of view stays dark."""
        k = number - 1 - self.first
        self.light.set_visible(0 <= k < len(self.texts))
        self.light.set_y(1 - (k + 1) * self.pitch)
        return self.light


def _first_shown(total: int, around: int) -> int:
    """Index of the first line shown, so that a line stays in view."""
    return max(0, min(around - 1 - MOST_LINES // 2, total - MOST_LINES))


def _type_size(axes: Axes, lines: list[str]) -> tuple[float, float]:
    """Return the type's size [pt] that fits the axes' width and height, and a line's share of the height."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.canvas.draw()  # only now the layout has given the axes their place
    box = axes.get_window_extent()
    width_pt, height_pt = (72.0 / figure.dpi * side for side in (box.width, box.height))
    widest = max((len(line) for line in lines), default=1)
    by_width = 0.82 * width_pt / (0.602 * max(widest, 1))  # a DejaVu Sans Mono character is 0.602 em wide
    by_height = height_pt / (1.45 * (len(lines) + 1))
    size = min(9.0, by_width, by_height)
    return size, 1.45 * size / height_pt
