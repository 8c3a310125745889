"""One winner's nominal drives as a film: gecar and the other engines side by side, in time with each other."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image, ImageDraw

from benchmarks.transfer.drives import Key
from benchmarks.transfer.driving import SENSOR_AHEAD, Drive
from benchmarks.transfer.floor import load_floor
from benchmarks.transfer.pictures import COLOURS, GECAR, draw_floor, paths_of
from benchmarks.transfer.sealing import Winner
from benchmarks.transfer.table import WORDS
from gecar.files import write_whole
from gecar.plots.style import look, new_figure

FRAMES_PER_S = 10
LAST_S = 2.0  # how long the last frame stays
_OUTLINE = ((0.095, 0.0), (0.05, 0.075), (-0.085, 0.06), (-0.085, -0.06), (0.05, -0.075))  # m, ahead and left
_FINE = 2  # drawn so much larger, then reduced, for smooth edges

Spots = npt.NDArray[np.float64]


def film(winner: Winner, drives: Mapping[Key, Drive], engines: Sequence[str], path: Path) -> Path:
    """Film one winner's nominal drives, and save it as a GIF."""
    paths = paths_of(winner, drives, engines)
    ends = {"gecar": f"GOAL at {winner.promised_s:.2f} s"}
    for name, engine in zip(list(paths)[1:], engines, strict=True):
        made = drives[winner.name, engine, 0]
        ends[name] = f"{WORDS[made.outcome]} at {made.time_s:.2f} s"
    colours = dict(zip(paths, [GECAR, *(COLOURS[engine] for engine in engines)], strict=True))
    stage = _Stage(winner, list(paths))
    frames = [stage.frame(t, paths, ends, colours) for t in _moments(paths)]
    palette = frames[-1].quantize(64)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    stream, still = io.BytesIO(), 1000 // FRAMES_PER_S
    lengths = [still] * (len(small) - 1) + [round(1000 * LAST_S)]
    small[0].save(
        stream, "GIF", save_all=True, append_images=small[1:], duration=lengths, loop=0, optimize=True
    )
    write_whole(path, stream.getvalue())
    return path


def _moments(paths: Mapping[str, Spots]) -> Iterator[float]:
    last = max(line[-1, 0] for line in paths.values())
    yield from np.arange(0.0, last + 1.0 / FRAMES_PER_S, 1.0 / FRAMES_PER_S)


class _Stage:
    """The floors, drawn once, and where on the picture each lies."""

    def __init__(self, winner: Winner, names: Sequence[str]) -> None:
        floor = load_floor(winner.course)
        columns, rows = floor.size
        across = 4.2 if columns >= rows else 3.2
        with look():
            figure = new_figure(across * len(names), across * rows / columns + 0.65)
            several = figure.subplots(1, len(names), squeeze=False)[0]
            for axes, name in zip(several, names, strict=True):
                draw_floor(axes, floor)
                axes.set_title(name)
            figure.suptitle(
                f"{winner.name}: one program, {len(names)} simulations", ha="left", x=0.006, size=10
            )
            figure.set_dpi(90 * _FINE)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            self._empty = Image.fromarray(pixels).convert("RGB")
        self._axes: dict[str, Axes] = dict(zip(names, several, strict=True))

    def frame(
        self, time_s: float, paths: Mapping[str, Spots], ends: Mapping[str, str], colours: Mapping[str, str]
    ) -> Image.Image:
        """Draw all robots at a time."""
        picture = self._empty.copy()
        pen = ImageDraw.Draw(picture)
        for name, line in paths.items():
            past = line[line[:, 0] <= time_s + 1e-9]
            over = time_s >= line[-1, 0]
            self._draw_robot(pen, name, past, _pose_at(line, time_s), colours[name])
            words = ends[name] if over else f"{time_s:.1f} s"
            x, y = self._places(name, np.array([[0.0, 0.0]]))[0]
            pen.text((x, y + 4 * _FINE), words, fill=colours[name], font_size=12 * _FINE)
        return picture.resize((picture.width // _FINE, picture.height // _FINE), Image.Resampling.LANCZOS)

    def _draw_robot(self, pen: ImageDraw.ImageDraw, name: str, past: Spots, pose: Spots, colour: str) -> None:
        x, y, heading = pose
        turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
        trail = [tuple(spot) for spot in self._places(name, np.vstack([past[:, 1:3], [[x, y]]]))]
        outline = [tuple(spot) for spot in self._places(name, np.array(_OUTLINE) @ turn + (x, y))]
        ((eye_x, eye_y),) = self._places(name, np.array([[SENSOR_AHEAD, 0.0]]) @ turn + (x, y))
        pen.line(trail, fill=colour, width=2 * _FINE, joint="curve")
        pen.polygon(outline, fill="white", outline=colour, width=2 * _FINE)
        reach = 2 * _FINE
        pen.ellipse((eye_x - reach, eye_y - reach, eye_x + reach, eye_y + reach), fill=colour)

    def _places(self, name: str, spots: Spots) -> Spots:
        """Turn places on the floor (n, 2) [m] into pixels (n, 2)."""
        pixels: Spots = self._axes[name].transData.transform(spots)
        pixels[:, 1] = self._empty.height - pixels[:, 1]
        return pixels


def _pose_at(line: Spots, time_s: float) -> Spots:
    """Return where a robot was [m, m, rad]; after its end, where it ended."""
    heading = np.unwrap(line[:, 3])
    return np.array([np.interp(time_s, line[:, 0], each) for each in (line[:, 1], line[:, 2], heading)])
