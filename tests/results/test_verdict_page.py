"""The verdict's page: what it says first, what it plays, and in a headless Chromium, how it is laid out."""

from __future__ import annotations

import base64
import csv
import html
import io
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from support.browser import PRESSES, in_chromium, opened
from support.concealing import EV3, verdict_on

from gecar.cli.actions.discover import draw
from gecar.plots.reality.replay_page import replay_page, replays_json
from gecar.plots.reality.verdict import verdict_drawings, verdict_figures, verdict_tables
from gecar.plots.style import is_whole
from gecar.reality.compare.choices import Told, tell
from gecar.reality.compare.side_by_side import PLACE, WHEELS, Beside, Curves, measure_of, typical
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.verdict import Interval, Judgement, Place, Verdict
from gecar.report.units import amount, quantities
from gecar.report.verdict import FAILS, sentences, words
from gecar.report.verdict_page import article, first_screen
from gecar.world.effects import BY_ID, CATALOGUE

CASES = {
    "late": ("actuation_delay", "time_s", 0.03, "floor"),
    "nothing": ("", "", 0.0, "floor"),
    "bench": ("viscous_friction", "coefficient_nms", 0.004, "bench"),
}
SIZES = {"desktop": (1280, 900), "phone": (390, 844)}
# What is wrong with the layout, as JSON in the page's title: what sticks out, and which words overlap.
LAYOUT = """<script>
addEventListener("load", () => setTimeout(() => {
  const wrong = [], boxes = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const outside = (r) => r.left < -1 || r.right > innerWidth + 1;
  document.querySelectorAll("details").forEach((d) => { d.open = true; });
  if (document.documentElement.scrollWidth > innerWidth) wrong.push(`page ${document.documentElement.scrollWidth}`);
  while (walker.nextNode()) {
    const node = walker.currentNode, of = node.parentElement, words = node.data.trim().slice(0, 30);
    if (!words || of.closest("script, style, noscript, select, .controls")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const r of of instanceof SVGElement ? [of.getBoundingClientRect()] : range.getClientRects()) {
      if (r.width < 1 || r.height < 1) continue;
      boxes.push([r, words]);
      if (outside(r) && !of.closest(".wide")) wrong.push(`out: ${words}`);
    }
  }
  for (const box of document.querySelectorAll("section, canvas, svg, button, select, input, article, .bar i")) {
    const r = box.getBoundingClientRect();
    if (r.width && outside(r)) wrong.push(`out: ${box.tagName} ${box.id}`);
  }
  const shared = (a, b, low, high) => Math.min(a[high], b[high]) - Math.max(a[low], b[low]);
  boxes.forEach(([a, one], k) => boxes.slice(k + 1).forEach(([b, other]) => {
    const down = shared(a, b, "top", "bottom") / Math.min(a.height, b.height);
    if (shared(a, b, "left", "right") > 1.5 && down > 0.35) wrong.push(`over: ${one} / ${other}`);
  }));
  const pictures = [...document.images].map((i) => i.naturalWidth > 100);
  const curves = [...document.querySelectorAll("svg path")].map((p) => p.getTotalLength() > 100);
  const bottoms = ["h1", "#number", "#off svg"].map((s) => document.querySelector(s).getBoundingClientRect().bottom);
  parent.postMessage({ wrong, width: innerWidth, pictures, curves, bottoms }, "*");
}, 100));
</script></body>"""
# Chromium's windows have a least width; a frame can be as narrow as a phone.
FRAME = """<!doctype html><meta charset="utf-8"><body style="margin: 0"><script>
onmessage = (event) => { document.title = JSON.stringify(event.data); };
</script><iframe src="%s" style="border: 0; width: %dpx; height: %dpx"></iframe>"""


@cache
def told(name: str) -> Told:
    return tell(verdict_on(*CASES[name]))


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folders = {name: tmp_path_factory.mktemp(name) for name in CASES}
    for name, folder in folders.items():
        draw(verdict_on(*CASES[name]), folder)
    pages = {name: folder / "report.html" for name, folder in folders.items()}
    worse, shown = failed(verdict_on(*CASES["late"])), told("late").shown
    pages["fails"] = tmp_path_factory.mktemp("fails") / "report.html"
    below = article(worse, told("late").choices)
    pages["fails"].write_text(replay_page(worse, shown, first_screen(worse, shown), below))
    return pages


def laid_out(page: Path, size: tuple[int, int], tmp_path: Path) -> dict[str, Any]:
    """Return what a page of some width and height says about its layout."""
    (tmp_path / "laid.html").write_text(page.read_text().replace("</body>", LAYOUT))
    frame = tmp_path / "frame.html"
    frame.write_text(FRAME % ("laid.html", *size))
    dom = opened(frame, tmp_path, "--dump-dom", budget=2000)
    title = re.search("<title>(.*?)</title>", dom)
    assert title is not None
    found: dict[str, Any] = json.loads(html.unescape(title.group(1)))
    return found


def failed(verdict: Verdict) -> Verdict:
    """Return a verdict of which the robot found is further off than the robot as it was."""
    evidence = verdict.evidence
    worse = EV3.with_effects({"actuation_delay": {"time_s": 0.2}})
    misfits = judge(Contender(evidence.before, evidence.held_before), Contender(worse, evidence.held))
    return replace(verdict, robot=worse, judgement=Judgement(verdict.judgement.recordings, False, misfits))


def test_the_number_is_what_the_simulation_is_off_by_over_a_recording() -> None:
    verdict = verdict_on(*CASES["late"])
    shown = told("late").shown
    run = typical(shown, PLACE)
    assert measure_of(verdict) == PLACE
    assert run is not None
    assert run.set_aside
    x, y = run.curves["x"], run.curves["y"]
    before = np.sqrt(np.mean((x.measured - x.before) ** 2 + (y.measured - y.before) ** 2))
    assert run.off(PLACE).before == pytest.approx(before)
    assert run.off(PLACE).after < 0.3 * run.off(PLACE).before
    assert run.off(PLACE).noise == pytest.approx(np.sqrt(2.0), rel=0.3)  # the camera's 1 mm along x and y
    assert f"<strong>{amount(float(before), 'mm')}</strong>" in first_screen(verdict, shown)


def test_paths_that_cross_at_the_end_do_not_flatter_the_number() -> None:
    t = np.linspace(0.0, 10.0, 501)
    wrong = 50.0 * np.sin(np.pi * t / 10.0)  # mm; as good as nothing at the end
    x, y = Curves(t, wrong, 0.0 * t, 0.1 * wrong), Curves(t, 0.0 * t, 0.0 * t, 0.0 * t)
    run = Beside(
        "run", True, 0.0, 10.0, {"x": x, "y": y}, dict.fromkeys(("x", "left_angle", "reflection"), 1.0)
    )
    assert run.off(PLACE)[:2] == pytest.approx([50.0 / np.sqrt(2.0), 45.0 / np.sqrt(2.0)], rel=0.01)


def test_the_taken_effect_leaves_less_than_its_runners_up() -> None:
    (choice,) = told("late").choices
    best = choice.rivals[0]
    assert best.taken
    assert best.effect == "actuation_delay"
    assert len(choice.rivals) > 2
    assert best.left < 0.5 * min(rival.left for rival in choice.rivals[1:])
    assert choice.before > 2.0 * best.left


def test_a_proof_that_fails_is_said_first() -> None:
    verdict = failed(verdict_on(*CASES["late"]))
    assert verdict.judgement.gap_closed is not None
    assert verdict.judgement.gap_closed < 0.0
    assert words(verdict)[0].startswith(FAILS)
    assert " instead of " in words(verdict)[1]
    screen = first_screen(verdict, ())
    assert html.escape(FAILS) in re.search("<h1>(.*?)</h1>", screen).group(1)  # type: ignore[union-attr]
    assert "Missing in the simulation" not in screen
    assert "Found, but not reliable" in words(verdict)[0]
    beside = replace(verdict, verdict="missing_and_unexplained")
    assert "Something unknown acts in these, too" in words(beside)[0]


def test_a_headline_names_three_causes_at_most() -> None:
    verdict = verdict_on(*CASES["late"])
    (one,) = verdict.effects
    others = ("backlash", "track_width", "sensor_lag", "dead_band")
    many = [replace(one, id=e, holdout_gain=k, parameters={}) for k, e in enumerate(others, start=1)]
    first = sentences(replace(verdict, effects=(*verdict.effects, *many)))[0]
    assert first.endswith("and 2 smaller causes.")
    assert first.count(",") == 3


def test_more_than_is_material_is_not_said_to_be_immaterial() -> None:
    verdict = verdict_on(*CASES["late"])
    for mm, said in ((2.0, "which is not material"), (17.5, "several small imperfections together")):
        size = replace(verdict.residual.size, mm_1m=mm, deg_1m=0.1)
        left = replace(verdict, residual=replace(verdict.residual, size=size, material=False))
        (sentence,) = (each for each in sentences(left) if each.startswith("The remaining error"))
        assert said in sentence


def test_errors_stand_in_units_beside_every_percentage() -> None:
    proof = sentences(verdict_on(*CASES["late"]))[1]
    assert "% of the gap is closed" in proof
    assert re.search(r"x off by [\d.]+ mm → [\d.]+ mm", proof)
    assert re.search(r"heading off by [\d.]+° → [\d.]+°", proof)
    on_bench = sentences(verdict_on(*CASES["bench"]))[1]
    assert re.search(r"wheel's angle off by [\d.]+° → [\d.]+°, rolled [\d.]+ mm → [\d.]+ mm", on_bench)


def test_a_misfit_in_units_is_its_rmse() -> None:
    verdict = verdict_on(*CASES["late"])
    run, misfit = verdict.evidence.held.recordings, verdict.judgement.channels["x_m"]
    measured = np.concatenate([r.recording.x_m - np.nanmean(r.recording.x_m) for r in run])
    assert misfit.deviation == pytest.approx(np.sqrt(np.nanmean(measured**2)))
    assert set(verdict.as_json()["holdout"]["channels"]["x_m"]) == {"before", "after", "floor"}


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.id)
def test_every_effect_has_units_people_use(effect) -> None:  # type: ignore[no-untyped-def]
    interval = {p.label: Interval(0.05, 0.04, 0.06, p.unit) for p in effect.parameters}
    found = quantities(effect.id, interval, EV3)
    assert found
    assert all("nan" not in str(q) and "rad" not in q.unit and q.low <= q.now <= q.high for q in found)


def test_a_scale_is_said_as_what_it_scales() -> None:
    (battery,) = quantities("supply_voltage", {"scale": Interval(0.946, 0.94, 0.952, "-")}, EV3)
    assert str(battery) == "battery 8.67 → 8.20 V (8.15 to 8.25)"


@pytest.mark.parametrize(
    ("effect", "found", "words"),
    [
        ("tyre_friction", Interval(1.7, 1.1, 2.0, "-"), "grip 0.90 → 1.70 (1.10 or more)"),
        ("tyre_friction", Interval(0.05, 0.03, 0.1, "-"), "grip 0.900 → 0.050 (0.100 or less)"),
        ("com_offset", Interval(0.0, -0.03, 0.0, "m"), "to"),
    ],
)
def test_an_interval_that_ends_where_the_search_does_is_open(effect, found, words) -> None:  # type: ignore[no-untyped-def]
    (parameter, *_) = BY_ID[effect].parameters
    (told, *_) = quantities(effect, {parameter.label: found}, EV3)
    assert words in str(told)


def test_what_was_found_is_drawn_where_it_is() -> None:
    verdict = verdict_on(*CASES["late"])
    (one,) = verdict.effects
    at = {"radius_m": 0.2, "x_m": 1.1, "y_m": 0.6, "coefficient": 0.1}
    patch = replace(one, id="slippery_patch", parameters={k: Interval(v, v, v, "") for k, v in at.items()})
    spot = Place("x", "place on the floor", 1.0, 0.01, ((1.0, 2.0),), verdict.fitted_on[0], (0.4, 0.5, 0.15))
    shown = told("late").shown
    marks = replays_json(replace(verdict, effects=(patch,), located=(spot,)), shown)["marks"]
    assert [(m["kind"], m["x"], m["y"], m["r"]) for m in marks] == [("patch", 1.1, 0.6, 0.2)]
    table = replays_json(replace(verdict, located=(spot,)), shown)
    assert [(m["kind"], m["x"]) for m in table["marks"]] == [("place", 0.4)]
    spans = {r["name"]: r["spans"] for r in table["recordings"]}
    assert spans[verdict.fitted_on[0]] == [[1.0, 2.0]]
    assert not any(spans[name] for name in verdict.judgement.recordings)


def test_a_bench_is_told_by_its_wheels() -> None:
    verdict = verdict_on(*CASES["bench"])
    table = replays_json(verdict, told("bench").shown)
    assert (table["measure"], table["course"], table["marks"]) == (WHEELS, None, [])
    assert "degrees" not in " ".join(sentences(verdict))  # a wheel on a bench turns no robot


def test_data_behind_every_picture_can_be_saved(pages: dict[str, Path]) -> None:
    folder = pages["late"].parent
    verdict = verdict_on(*CASES["late"])
    assert (
        {p.stem for p in folder.glob("*.png")}
        == set(verdict_drawings(verdict))
        == {p.stem for p in folder.glob("*.csv")}
    )
    traces = list(csv.DictReader(io.StringIO((folder / "traces.csv").read_text())))
    assert {row["channel"] for row in traces} == {"x", "y", "heading", "left_angle", "right_angle"}
    links = re.findall(r"download='(.*?)' href='data:text/csv;base64,(.*?)'", pages["late"].read_text())
    assert {name for name, _ in links} == {"why.csv", "next_recording.csv", "gap.csv", "where.csv"}
    for _, data in links:
        rows = list(csv.reader(io.StringIO(base64.b64decode(data).decode())))
        assert len(rows) > 1
        assert len({len(row) for row in rows}) == 1


def test_pictures_are_whole() -> None:
    verdict = verdict_on(*CASES["late"])
    assert all(is_whole(figure) for figure in verdict_figures(verdict, told("late")).values())
    assert set(verdict_tables(verdict, told("late"))) == set(verdict_drawings(verdict))


@pytest.mark.parametrize("name", CASES)
def test_the_page_loads_nothing_and_says_what_it_shows(name: str, pages: dict[str, Path]) -> None:
    text = pages[name].read_text()
    assert "default-src 'none'" in text
    sources = re.findall(r"(?:src|href)='(.*?)'", text)
    assert all(source.startswith("data:") for source in sources)
    assert not re.findall(r"https?:(?!//www\.w3\.org/2000/svg)|@import|url\(", text)
    assert "aria-label" in re.search('<section id="floor".*?>', text).group(0)  # type: ignore[union-attr]
    assert all("alt='" in image for image in re.findall("<img.*?>", text))
    assert len(text) < 2_000_000


def test_names_can_not_become_markup() -> None:
    evil = replace(verdict_on(*CASES["late"]), case="</script><b>")
    shown = [replace(each, name="</script><b>") for each in told("late").shown]
    assert "</script><b>" not in replay_page(evil, shown, first_screen(evil, shown), article(evil))


@in_chromium
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", [*CASES, "fails"])
def test_nothing_sticks_out_and_no_words_overlap(
    name: str, size: str, pages: dict[str, Path], tmp_path: Path
) -> None:
    found = laid_out(pages[name], SIZES[size], tmp_path)
    assert found["width"] == SIZES[size][0]
    assert found["wrong"] == []
    assert found["pictures"] == [True] * (name != "fails")
    assert len(found["curves"]) >= (3 if name == "nothing" else 5)
    assert all(found["curves"])
    if name != "fails":  # its first screen has more to say
        sentence, number, curves = found["bottoms"]
        assert 0 < sentence < number < curves < SIZES[size][1]


@in_chromium
def test_keys_move_in_time(pages: dict[str, Path], tmp_path: Path) -> None:
    names = ("Home", "ArrowRight!", "ArrowRight", ".", "ArrowLeft!", " ", " ", "End")
    keys = [[name.rstrip("!"), name.endswith("!")] for name in names]
    pressed = tmp_path / "pressed.html"
    pressed.write_text(pages["late"].read_text().replace("</body>", PRESSES % json.dumps(keys)))
    title = re.search("<title>(.*?)</title>", opened(pressed, tmp_path, "--dump-dom")).group(1)  # type: ignore[union-attr]
    assert title == "0.00f 1.00f 1.10f 1.12f 0.12f 0.12t 0.12f 7.98f"


@in_chromium
@pytest.mark.parametrize("name", ["late", "bench"])
def test_robots_and_wheels_are_drawn_and_part(name: str, pages: dict[str, Path], tmp_path: Path) -> None:
    shots = []
    for moment in ("0", "6"):
        picture = tmp_path / f"{moment}.png"
        opened(pages[name], tmp_path, f"--screenshot={picture}", after=f"#t={moment}")
        with Image.open(picture) as shot:
            shots.append(shot.convert("RGB").crop((40, 140, 700, 560)))
    colours = [{c for _, c in shot.getcolors(1 << 24)} for shot in shots]
    assert {(31, 41, 51), (213, 94, 0), (0, 114, 178)} <= colours[1]  # recorded, before, now
    assert shots[0].tobytes() != shots[1].tobytes()


@in_chromium
def test_curves_are_saved_as_csv(pages: dict[str, Path], tmp_path: Path) -> None:
    dom = opened(pages["late"], tmp_path, "--dump-dom")
    link = re.search(r'id="save" download="(.*?)" href="data:text/csv;charset=utf-8,(.*?)"', dom)
    assert link is not None
    assert link.group(1).endswith(".curves.csv")
    assert link.group(2).startswith("t_s%2Cx_measured_mm%2Cx_before_mm%2Cx_after_mm")


def test_notes_of_the_page_name_effects_in_words() -> None:
    verdict = verdict_on(*CASES["late"])
    noted = replace(verdict, notes=("duty_curve explains the fitted recordings.", "See next_recording."))
    page = article(noted, told("late").choices)
    assert f"“{html.escape(BY_ID['duty_curve'].title)}” explains the fitted recordings." in page
    assert "See next_recording." in page
