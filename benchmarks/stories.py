"""One case told in a picture: ``python -m benchmarks.stories CASES NAME --out PICTURE``.

The case is judged as `benchmarks.invention` judges it. Left, a drive set aside, as measured and as simulated without
and with the law; right, how far the simulations are off, and the law's curve.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from matplotlib.figure import Figure

from benchmarks.concealed.plan import read_label
from benchmarks.invention import judged
from gecar.plots.reality.law import draw_law
from gecar.plots.style import BLUE, INK, SOFT, VERMILION, headline, look, new_figure, save
from gecar.reality.compare.side_by_side import PLACE, side_by_side, typical
from gecar.reality.verdict import Verdict


def story_figure(verdict: Verdict) -> Figure:
    """Draw a typical drive of those set aside, and the first law of a verdict that holds one, with poses."""
    run = typical(side_by_side(verdict, only_set_aside=True), PLACE)
    assert run is not None  # a case of this examination has poses
    law, off = verdict.invented[0], run.off(PLACE)
    x, y = (run.curves[name] for name in ("x", "y"))
    figure = new_figure(10.0, 5.0)
    with look():
        grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
        floor, over_time, curve = (
            figure.add_subplot(grid[place]) for place in ((slice(None), 0), (0, 1), (1, 1))
        )
        floor.plot(1e-3 * x.measured, 1e-3 * y.measured, color=INK, linewidth=3.0, label="measured")
        floor.plot(1e-3 * x.before, 1e-3 * y.before, color=VERMILION, label="simulated without the law")
        floor.plot(1e-3 * x.after, 1e-3 * y.after, color=BLUE, linestyle="--", label="with it")
        floor.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
        floor.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
        t, before, after = run.apart(PLACE)
        over_time.plot(t, before, color=VERMILION)
        over_time.plot(t, after, color=BLUE)
        over_time.axhline(off.noise, color=SOFT, linewidth=0.8, linestyle=":")
        over_time.set(xlabel="time [s]", ylabel="off by [mm]", ylim=(0.0, None))
        draw_law(curve, law)
        curve.set_title(law.term.typeset, fontsize=8)
        curve.yaxis.label.set_fontsize(7)
        words = (
            f"{run.name}, not used for the fit: off by {off.before:.1f} mm, with the law {off.after:.1f} mm"
        )
        noise = f"(root mean square; noise {off.noise:.1f} mm, dotted)"
        headline(figure, law.looks_like[0].upper() + law.looks_like[1:], f"{words} {noise}")
    return figure


def main() -> None:
    """Judge a case and draw it."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path, help="as benchmarks.concealed draws them: cases/ and sealed/")
    parser.add_argument("name", help="of the case")
    parser.add_argument("--out", type=Path, required=True, help="PNG, PDF or SVG")
    given = parser.parse_args()
    verdict = judged(given.cases / "cases" / given.name, read_label(given.cases, given.name))
    if not verdict.invented:
        raise SystemExit(f"{given.name}: found no law, expected one to draw")
    save(story_figure(verdict), given.out)


if __name__ == "__main__":
    main()
