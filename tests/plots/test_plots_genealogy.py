"""The genealogy of a run's best program, and the film of how it got better."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image
from support.command import call
from support.searching import MAPPER, SMALL, generations, new_evolution

from gecar.cli.actions import run_pictures
from gecar.errors import InputError
from gecar.evolution.lineage import Lineage
from gecar.plots.drives.animation import BETWEEN_S, LAST_FRAME_S
from gecar.plots.runs.evolution_film import LONGEST_S, MOST_SHOWN, PACE, choose_shown, pace_of
from gecar.plots.runs.genealogy import fitness_words, genealogy, steps_of
from gecar.plots.style import is_whole
from gecar.results.ancestry import read_ancestry
from gecar.results.folder import read_result

VARIED = SMALL.model_copy(update={"crossover": "subtree", "mutation": "used_codon", "creep_rate": 0.3})


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ancestry") / "run"
    words = (
        "--population",
        30,
        "--generations",
        5,
        "--workers",
        1,
        "--time-limit",
        4,
        "--set",
        "creep_rate=0.3",
    )
    assert call("evolve", *words, "--out", folder, "--quiet", "--no-pictures") == 0
    return folder


def kept(settings, n):
    evolving = generations(new_evolution(settings, MAPPER), n)
    return Lineage.read(evolving.state().lineage, settings.population)


def program_of(lineage):
    return lambda member: MAPPER.map(lineage.codons_of(member)[None]).program(0)


def half(_member):
    return 0.5


@pytest.mark.parametrize("n", [1, 2, 7])
def test_a_genealogy_is_within_its_edges(n):
    lineage = kept(VARIED, n)
    winner = (n - 1, int(lineage.generations[-1]["merit"].argmin()))
    assert is_whole(genealogy(lineage, winner, program_of(lineage), half, "A title", "a detail"))


def test_a_long_genealogy_lists_the_latest_steps(monkeypatch):
    monkeypatch.setattr("gecar.plots.runs.genealogy.MAX_STEPS", 3)
    lineage = kept(VARIED, 7)
    program = program_of(lineage)
    most = max(((6, k) for k in range(20)), key=lambda member: len(steps_of(lineage, member, program, half)))
    steps = steps_of(lineage, most, program, half)
    assert steps_of(lineage, most, program, half, 3) == steps[-3:]
    words = [text.get_text() for text in genealogy(lineage, most, program, half).axes[1].texts]
    assert any(f"({len(steps) - 3} earlier steps are not shown)" in text for text in words)
    assert str(steps[-1].generation) in words


def test_each_step_shows_what_is_new():
    lineage = kept(VARIED, 7)
    steps = steps_of(lineage, (6, 4), program_of(lineage), half)
    assert "".join(text for text, _ in steps[-1].words).startswith(("if(", "motor("))
    assert steps[0].by == "first population"
    assert all(any(fresh for _, fresh in step.words) for step in steps[1:] if step.by == "creep")


@pytest.mark.parametrize(
    ("merit", "share", "words"),
    [
        (15.7, 0.985, "15.70 s, 98.5 % arrive"),
        (15.7, None, "15.70 s, - % arrive"),
        (10_000.6, 0.0, "40 % of the way"),
        (10_002.0, None, "no program"),
    ],
)
def test_fitness_in_words(merit, share, words):
    assert fitness_words(merit, share) == words


def test_the_winner_is_the_program_that_the_run_reports(finished):
    ancestry = read_ancestry(finished)
    assert ancestry.program(ancestry.winner).source == read_result(finished)["program"]
    assert ancestry.winner[0] == read_result(finished)["found_in_generation"]


@pytest.mark.parametrize("change", ["cut", "gone", "flipped"])
def test_a_damaged_lineage_is_one_line(change, finished, tmp_path):
    folder = Path(shutil.copytree(finished, tmp_path / "run"))
    raw = (folder / "checkpoint").read_bytes()
    if change == "gone":
        (folder / "checkpoint").unlink()
    else:
        damaged = raw[:-20] if change == "cut" else raw[:-20] + bytes([raw[-20] ^ 1]) + raw[-19:]
        (folder / "checkpoint").write_bytes(damaged)
    with pytest.raises(InputError, match=r"checkpoint: found [^\n]*, expected [^\n]*$"):
        read_ancestry(folder)


def test_plot_draws_only_what_is_named(gecar, finished, tmp_path):
    before = set(finished.iterdir())
    named = (
        "--tree",
        tmp_path / "t.svg",
        "--genealogy",
        tmp_path / "new/g.png",
        "--evolution",
        tmp_path / "e.gif",
    )
    ended = gecar("plot", finished, *named, "--json").json
    assert ended["pictures"] == [str(tmp_path / "t.svg"), str(tmp_path / "new/g.png")]
    assert ended["films"] == [str(tmp_path / "e.gif")]
    assert set(finished.iterdir()) == before
    with Image.open(tmp_path / "e.gif") as film:
        assert film.n_frames > min(len(read_ancestry(finished).lineage.champions()), MOST_SHOWN)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("one", "two", "--tree", "t.png"), "--tree"),
        (("one", "--evolution", "e.avi"), "--evolution"),
        (("one", "--genealogy", "g.gif"), ".png"),
        (("one", "--tree", "t.png"), "config.toml"),
    ],
)
def test_what_can_not_be_drawn_is_one_line(gecar, words, named):
    assert named in gecar.error("plot", *words)


@pytest.mark.parametrize("chosen", [0, 2, 4])
def test_a_film_of_an_evolution_ends_with_the_program_the_run_chose(chosen, finished, monkeypatch):
    filmed = []
    monkeypatch.setattr(run_pictures, "film_evolution", lambda world, champions, *_: filmed.extend(champions))
    ancestry = read_ancestry(finished)
    arrives = next(k for k in range(20) if ancestry.program((chosen, k)) is not None)
    told = replace(ancestry, winner=(chosen, arrives))
    monkeypatch.setattr(run_pictures, "read_ancestry", lambda folder: told)
    run_pictures.film_run(finished, finished / "e.gif")
    assert (filmed[-1].generation, filmed[-1].program) == (chosen, told.program(told.winner))
    assert [each.generation for each in filmed] == sorted({each.generation for each in filmed})
    assert filmed[-1].title.startswith(f"Generation {chosen} · ")


@pytest.mark.parametrize("count", [1, 2, 8, 65])
def test_a_film_of_an_evolution_begins_with_the_failures_and_lasts_half_a_minute(count):
    shown = choose_shown(range(count))
    assert len(shown) == len(set(shown)) == min(count, MOST_SHOWN)
    assert shown == sorted(shown)
    assert (shown[0], shown[-1]) == (0, count - 1)
    times_s = [60.0] * len(shown)
    held_s = BETWEEN_S * (len(shown) - 1) + LAST_FRAME_S
    assert sum(times_s) / pace_of(times_s) + held_s <= LONGEST_S < 30.0
    assert pace_of([17.0]) == PACE
