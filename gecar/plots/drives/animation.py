"""Drives as a film: GIF, or MP4 where ffmpeg is installed.

Only what moves is drawn anew for each frame; the rest is kept as an image. A frame then takes about 30 ms.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from PIL import Image

from gecar.errors import expected
from gecar.files import write_whole
from gecar.language.program import Program
from gecar.plots.courses.robot import RobotArtist, shape_of
from gecar.plots.drives.obstacles import draw_floor
from gecar.plots.drives.program_listing import Listing
from gecar.plots.drives.trajectory import choose
from gecar.plots.style import CYCLE, INK, LIGHT, PAPER, SOFT, look, new_figure
from gecar.world.rollout import TRACE_S, Drive, World

FRAMES_PER_S = 20
LAST_FRAME_S, BETWEEN_S = 2.0, 1.0
"""How long the last frame stays, and that of each drive before another [s]."""
WIDTH_IN, DPI = 9.0, 100

Frame = npt.NDArray[np.uint8]


def film(
    world: World, program: Program, drive: Drive, path: Path, *, title: str = "", pace: float = 1.0
) -> Path:
    """Film a drive.

    Parameters
    ----------
    world, program, drive
        Who drove where, with what program, and what came of it; the drive holds its trace.
    path
        Where to write it; ``.gif`` or ``.mp4``.
    title
        What to write above it.
    pace
        Seconds of driving in a second of film.

    Raises
    ------
    InputError
        If the ending is another, or an MP4 is wanted where there is no ffmpeg.
    """
    check_film(path, pace)
    return _write(_held(Scene(world, program, drive, title).frames(pace), LAST_FRAME_S), path)


def film_of(scenes: Sequence[Callable[[], Scene]], path: Path, *, pace: float) -> Path:
    """Film drives one after the other.

    Parameters
    ----------
    scenes
        Each made when its turn comes, on the same course.
    path, pace
        As in `film`.

    Raises
    ------
    InputError
        As in `film`.
    """
    check_film(path, pace)
    *_, last = scenes[-1]().frames(pace)
    films = [_held(scene().frames(pace), BETWEEN_S) for scene in scenes[:-1]]
    frames = chain(*films, _held(scenes[-1]().frames(pace), LAST_FRAME_S))
    return _write(frames, path, _palette(Image.fromarray(last)))


def _held(frames: Iterator[Frame], seconds: float) -> Iterator[Frame]:
    """Yield frames, and the last one for as long as it is to stay [s]."""
    frame = next(frames)
    yield frame
    for frame in frames:
        yield frame
    yield from repeat(frame, round(seconds * FRAMES_PER_S))


def _write(frames: Iterator[Frame], path: Path, palette: Image.Image | None = None) -> Path:
    write_whole(path, _gif(frames, palette) if path.suffix.lower() == ".gif" else _mp4(frames))
    return path


def check_film(path: Path, pace: float = 1.0, option: str = "--animate") -> None:
    """Check that a film can be made; see `film`."""
    kind = path.suffix.lower()
    if kind not in (".gif", ".mp4"):
        raise expected(option, f"'{path.name}'", "a name that ends in .gif or .mp4")
    if not 0.1 <= pace <= 100.0:
        raise expected("--pace", pace, "0.1 to 100")
    if kind == ".mp4" and shutil.which("ffmpeg") is None:
        raise expected(
            option, f"'{path.name}' but no ffmpeg on this machine", "ffmpeg, or a name that ends in .gif"
        )


class Scene:
    """What a film shows, and the parts that move."""

    def __init__(self, world: World, program: Program, drive: Drive, title: str) -> None:
        assert drive.trace is not None
        self.world, self.drive, self.trace = world, drive, drive.trace
        self.colouring = choose(world, drive, "auto")
        course = world.course
        height = min(max(0.72 * WIDTH_IN * course.height_m / course.width_m, 2.4), 6.0)
        with look():
            self.figure = new_figure(WIDTH_IN, height + 1.7)
            self.figure.set_dpi(DPI)
            self.figure.suptitle(title, x=0.012, ha="left", weight="bold")
            grid = self.figure.add_gridspec(2, 2, height_ratios=(height, 1.0), width_ratios=(0.74, 0.26))
            self.floor = self.figure.add_subplot(grid[0, 0])
            self.obstacles = draw_floor(self.floor, course)
            self.below = self.figure.add_subplot(grid[1, :])
            self._draw_below()
            self.listing = Listing(self.figure.add_subplot(grid[0, 1]), program.source, self.colouring.lines)
            self.robot = RobotArtist(self.floor, shape_of(world.robot))
            self.clock = self.below.text(
                0.995, 1.08, "", transform=self.below.transAxes, ha="right", weight="bold", color=INK
            )

    def _draw_below(self) -> None:
        """Draw what stands below the course: what the sensor sees."""
        t = self.trace["t_s"]
        self.below.plot(t, self.trace["reflection_pct"], color=SOFT, linewidth=0.9)
        self.below.set(
            ylabel="sensor [%]", xlabel="time [s]", ylim=(-6, 106), xlim=(0.0, max(float(t[-1]), TRACE_S))
        )
        self.cursor = self.below.axvline(0.0, color=INK, linewidth=1.4)

    def frames(self, pace: float) -> Iterator[Frame]:
        """Yield the film, frame by frame, shape (height, width, 3)."""
        with look():
            canvas: Any = FigureCanvasAgg(self.figure)
            moving: list[tuple[Axes, Artist]] = [
                *((self.floor, part) for part in (*self.obstacles.patches, *self.robot.parts))
            ]
            moving += [(self.listing.axes, part) for part in (self.listing.light, *self.listing.texts)]
            moving += [(self.below, self.cursor), (self.below, self.clock)]
            for _, part in moving:
                part.set_animated(True)
            canvas.draw()
            kept, shown = canvas.copy_from_bbox(self.figure.bbox), 0
            for sample in self._samples(pace):
                canvas.restore_region(kept)
                self._trail(shown, sample)
                kept, shown = canvas.copy_from_bbox(self.figure.bbox), sample
                self._move(sample)
                for axes, part in moving:
                    axes.draw_artist(part)
                yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()

    def _samples(self, pace: float) -> npt.NDArray[np.int64]:
        """Return the samples that frames show, the last one included."""
        last = len(self.trace["t_s"]) - 1
        count = max(2, round(last * TRACE_S / pace * FRAMES_PER_S) + 1)
        return np.linspace(0, last, count).round().astype(np.int64)

    def _trail(self, begin: int, end: int) -> None:
        """Draw the way between two samples, to stay."""
        points = np.column_stack((self.trace["x_m"], self.trace["y_m"]))[begin : end + 1]
        pieces = list(np.stack((points[:-1], points[1:]), axis=1))
        trail = LineCollection(
            pieces, colors=self.colouring.rgb[begin:end], linewidths=2.2, capstyle="round", zorder=5
        )
        self.floor.add_collection(trail, autolim=False)
        self.floor.draw_artist(trail)
        trail.remove()

    def _move(self, sample: int) -> None:
        """Put all that moves where it is at a sample."""
        trace = self.trace
        self.robot.move(trace["x_m"][sample], trace["y_m"][sample], trace["heading_rad"][sample])
        self._mark(sample)
        self.clock.set_text(f"{trace['t_s'][sample]:.1f} s")
        self.listing.lit(int(trace["line"][sample]))
        if self.drive.obstacles is not None:
            self.obstacles.move(self.drive.obstacles[min(sample, len(self.drive.obstacles) - 1)])

    def _mark(self, sample: int) -> None:
        """Mark below where the drive is."""
        self.cursor.set_xdata([self.trace["t_s"][sample]] * 2)


def _gif(frames: Iterator[Frame], palette: Image.Image | None = None) -> bytes:
    """Pack frames; all share one set of colours, by default the last frame's."""
    if palette is None:
        kept = list(frames)
        frames, palette = iter(kept), _palette(Image.fromarray(kept[-1]))
    small = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    stream = io.BytesIO()
    next(small).save(
        stream,
        "GIF",
        save_all=True,
        append_images=small,
        duration=1000 // FRAMES_PER_S,
        loop=0,
        optimize=False,
    )  # frames that are alike become one that stays
    return stream.getvalue()


def _palette(last: Image.Image) -> Image.Image:
    """Return the colours of the last frame, where everything has been drawn, and those of small parts."""
    named = [round(255 * level) for colour in (*CYCLE, INK, SOFT, LIGHT, PAPER) for level in to_rgb(colour)]
    seen = last.quantize(256 - len(named) // 3, method=Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*seen, *named][: 3 * 256])
    return palette


def _mp4(frames: Iterator[Frame]) -> bytes:
    """Encode frames with ffmpeg."""
    first = next(frames)
    height, width = first.shape[0] // 2 * 2, first.shape[1] // 2 * 2  # the codec halves colours
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "film.mp4"
        command: list[Any] = [
            "ffmpeg", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-r", FRAMES_PER_S, "-i", "-", "-pix_fmt", "yuv420p", "-movflags", "+faststart", target,
        ]  # fmt: skip
        words = [str(part) for part in command]
        process = subprocess.Popen(  # noqa: S603  fixed words
            words, stdin=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            for frame in (first, *frames):
                process.stdin.write(frame[:height, :width].tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass  # its own words follow
        said = process.stderr.read().decode(errors="replace").strip()
        if process.wait() != 0:
            raise expected("ffmpeg", said or f"exit code {process.returncode}", "a film")
        return target.read_bytes()
