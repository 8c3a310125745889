"""Limits: what recordings must show of an effect for it to be named, on residuals that are linear in effects."""

from dataclasses import replace

import numpy as np
import pytest
from support.linear_case import EV3, LinearSizes, bumps, linear, linear_problem

from gecar.reality.materiality import Size
from gecar.reality.uncertainty import limits as limits_of
from gecar.reality.uncertainty.limits import limits
from gecar.world.effects import BY_ID

VISCOUS, DRY = "viscous_friction", "coulomb_friction"
OWN, OTHER = 0.3 * bumps(1, 4, 1.0), 0.3 * bumps(2, 4, 1.0)
HELD = 0.3 * bumps(3, 2, 1.0)


def limit_of(responses, held, errors_of_held=1.0):
    """Return the limit of viscous friction, where recordings set aside respond, and are off, in this way."""
    problem = linear_problem(linear({}, responses))
    aside = linear({}, {VISCOUS: held}, seed=5, count=2)
    aside = replace(aside, noise=errors_of_held * aside.noise)
    under = problem.under(problem.known)
    return limits(under, under.known, aside)[VISCOUS]


def test_an_effect_that_is_faint_has_a_larger_limit():
    strong, weak = (limit_of({VISCOUS: k * OWN}, k * HELD).size for k in (1.0, 0.5))
    assert weak > 1.3 * strong


def test_what_another_effect_makes_up_for_has_a_larger_limit():
    alone = limit_of({VISCOUS: OWN}, HELD).size
    beside = limit_of({VISCOUS: OWN, DRY: OTHER}, HELD).size
    imitated = limit_of({VISCOUS: OWN, DRY: OWN + 0.05 * OTHER}, HELD).size
    assert beside == pytest.approx(alone, rel=0.2)
    assert imitated > 1.5 * alone


def test_what_another_effect_does_alike_has_no_limit():
    assert limit_of({VISCOUS: OWN, DRY: OWN}, HELD) is None


def test_what_recordings_set_aside_show_faintly_has_a_larger_limit():
    clear, faint = (limit_of({VISCOUS: OWN}, HELD, off).size for off in (1.0, 12.0))
    assert faint > 1.5 * clear


def test_without_recordings_set_aside_only_those_fitted_count():
    problem = linear_problem(linear({}, {VISCOUS: OWN}))
    under, none = problem.under(problem.known), linear({}, {}, count=2)
    alone = limits(under, under.known, replace(none, count=0, noise=np.zeros(0)))[VISCOUS]
    assert alone.size <= limit_of({VISCOUS: OWN}, HELD).size


def test_what_recordings_set_aside_do_not_show_must_show_in_two_others():
    quarter = np.arange(len(OWN)) < len(OWN) // 4
    assert limit_of({VISCOUS: OWN}, 0.0 * HELD) is not None
    assert limit_of({VISCOUS: OWN * quarter}, 0.0 * HELD) is None


def test_what_one_recording_alone_may_show_must_show_in_two_of_its_thirds():
    def limit(thirds):
        one = len(OWN) // 4
        problem = linear_problem(linear({}, {VISCOUS: np.repeat(thirds, one // 3) * OWN[:one]}, count=1))
        under = problem.under(problem.known)
        return limits(under, under.known, linear({}, {VISCOUS: 0.0 * HELD}, seed=5, count=2))[VISCOUS]

    assert limit([1.0, 0.0, 1.0]) is not None
    assert limit([0.0, 1.0, 0.0]) is None


def test_what_small_things_make_up_for_has_a_larger_limit(monkeypatch):
    """A supply was refused, as motors that pull ahead made up for it until it was found."""
    usual = limit_of({VISCOUS: OWN}, HELD).size
    apart_mm = 10.0 * np.sqrt(np.mean(OWN**2)) * usual / BY_ID[VISCOUS].parameters[0].worthwhile

    def limit(way):
        def left(sizes, physics, *_, **__):
            return Size(mm_1m=abs(apart_mm - way * sizes.apart(EV3.physics, physics).mm_1m))

        monkeypatch.setattr(LinearSizes, "left", left)
        return limit_of({VISCOUS: OWN}, HELD).size

    assert limit(1.0) == pytest.approx(usual, rel=0.01)
    assert limit(-1.0) > 1.6 * usual


def test_an_effect_whose_law_may_be_off_has_a_larger_limit(monkeypatch):
    """Its interval is that much longer, and must exclude neutral all the same."""
    usual = limit_of({VISCOUS: 9.0 * OWN}, 9.0 * HELD).size
    monkeypatch.setattr(limits_of, "model_error", lambda coordinate, z: 1.0)
    off = limit_of({VISCOUS: 9.0 * OWN}, 9.0 * HELD).size
    assert off / BY_ID[VISCOUS].parameters[0].worthwhile == pytest.approx(1.15 * (1.96 + 1.645), rel=0.03)
    assert usual < 0.6 * off
