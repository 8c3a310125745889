"""What is compiled beforehand is what discoveries call."""

from __future__ import annotations

import numpy as np
import pytest
from support.concealing import EV3, recorded

from gecar.compiled import LANES
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.replay import kernel
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.residuals import compilation
from gecar.reality.residuals.of_recording import residuals_of

DISPATCHERS = (kernel._replay_one, kernel._replay_lanes, kernel._replay_lanes_with_terms, readings_along)


def test_other_recordings_need_nothing_else_compiled() -> None:
    compilation.compile_here(*compilation.KERNELS)
    before = [list(each.signatures) for each in DISPATCHERS]
    assert all(before)
    run = recorded(EV3, 0)
    replayed = residuals_of(run, estimate_noise([run], EV3.physics, 1.0), 1.0, None)
    replayed.motion_errors(np.repeat(EV3.physics, LANES))
    replayed.motion_errors(np.repeat(EV3.with_terms([compilation.LAW]).physics, LANES))
    assert [list(each.signatures) for each in DISPATCHERS] == before


def test_where_all_is_compiled_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(compilation, "is_cold", lambda what: False)
    with compilation.compiled_replays(laws=True, tell=said.append):
        assert not said
