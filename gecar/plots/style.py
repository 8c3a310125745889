"""Style of all pictures: fonts, colours for any colour vision, and saving."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from gecar.errors import expected
from gecar.files import write_whole

# Okabe and Ito, "Color Universal Design" (2008): eight colours told apart with any kind of colour vision.
BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, YELLOW = "#CC79A7", "#56B4E9", "#F0E442"
INK, SOFT, PALE, FAINT, PAPER, LIGHT = "#1F2933", "#667380", "#A0ACB8", "#D8DEE4", "#FFFFFF", "#FFF3C4"
CYCLE = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, YELLOW)
SPEED_COLOURS = "viridis"
DPI = 150

LOOK: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": SOFT,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.prop_cycle": cycler(color=CYCLE),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "figure.dpi": DPI,
    "figure.facecolor": PAPER,
    "figure.titlesize": 13,
    "font.family": "DejaVu Sans",  # comes with matplotlib, so pictures are the same everywhere
    "font.size": 9,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "pdf.fonttype": 42,  # TrueType, as journals ask for
    "savefig.dpi": DPI,
    "text.color": INK,
    "xtick.color": SOFT,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.color": SOFT,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8,
}


@contextmanager
def look() -> Iterator[None]:
    """Draw in gecar's look; figures keep it, the rest of the process does not."""
    with mpl.rc_context(LOOK):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Make a figure that keeps its parts from touching; width and height in inches."""
    with look():
        return Figure(figsize=(width_in, height_in), layout="constrained")


def headline(figure: Figure, title: str, detail: str = "") -> None:
    """Write a picture's message above it, and below that in small what it was made with."""
    # The second line only keeps room: a title has one size of type.
    figure.suptitle(title + "\n" if detail else title, x=0.012, ha="left", weight="bold", linespacing=1.7)
    if detail:
        top = figure.get_figheight() - 30.0 / 72.0
        figure.text(
            0.012 * figure.get_figwidth(),
            top,
            detail,
            size=9,
            color=SOFT,
            va="top",
            transform=figure.dpi_scale_trans,
        )


def log_ticks(axis: Axis) -> None:
    """Label a logarithmic axis of what is drawn 0.1, 0.2, 0.5, 1 and so on; over more than 2.5 decades 0.1, 1, 10."""
    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def settle(figure: Figure) -> None:
    """Lay a figure out; the layout measures words where the pass before has put them, so it takes two."""
    with look():
        for _ in range(2):
            figure.draw_without_rendering()


def picture_kind(path: Path, option: str = "picture") -> str:
    """Return the format that a file name's ending asks for; an error names ``option``.

    Raises
    ------
    InputError
        If it is none of PNG, PDF and SVG.
    """
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise expected(option, f"'{path}'", "a name that ends in .png, .pdf or .svg")
    return path.suffix.lower().removeprefix(".")


def save(figure: Figure, path: Path) -> Path:
    """Write a picture whole or not at all; the ending of its name says which kind.

    Raises
    ------
    InputError
        If the ending is none of a picture.
    """
    write_whole(path, picture(figure, picture_kind(path)))
    return path


def picture(figure: Figure, kind: str = "png") -> bytes:
    """Return a picture as the contents of a file of a kind."""
    stream = io.BytesIO()
    settle(figure)
    with look():
        undated = {"CreationDate": None} if kind == "pdf" else None  # the same figure, the same file
        figure.savefig(stream, format=kind, facecolor=PAPER, metadata=undated)
    return stream.getvalue()


def is_whole(figure: Figure) -> bool:
    """Whether nothing reaches over the picture's edge."""
    settle(figure)
    drawn, edge = figure.get_tightbbox(), figure.bbox_inches.padded(1.0 / DPI)  # a pixel of antialiasing
    return bool(edge.x0 <= drawn.x0 and edge.y0 <= drawn.y0 and drawn.x1 <= edge.x1 and drawn.y1 <= edge.y1)
