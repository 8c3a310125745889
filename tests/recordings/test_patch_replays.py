"""Patches that a robot never enters are not replayed, and change no residual."""

import numpy as np
import pytest
from support.concealing import EV3, recorded

from gecar.reality.fitting.initial_values import patches
from gecar.reality.replay import replayer as module
from gecar.reality.replay.replayer import replayer_of


@pytest.fixture
def played(monkeypatch):
    """How many robots each call of the compiled replay simulates."""
    counts, original = [], module.replay_rows

    def counting(inputs, physics, *others):
        counts.append(len(physics))
        return original(inputs, physics, *others)

    monkeypatch.setattr(module, "replay_rows", counting)
    return counts


def test_robots_with_patches_all_over_the_floor_part_as_each_does_alone(played):
    recording, rng = recorded(EV3, 3), np.random.default_rng(0)
    near = patches([recording], 100)
    everywhere = [{**patch, "radius_m": rng.uniform(0.02, 0.3), "coefficient": 0.1} for patch in near]
    everywhere += [{**patch, "x_m": patch["x_m"] + 0.5} for patch in near]
    slow = EV3.with_effects({"viscous_friction": {"coefficient_nms": 0.003}})
    robots = [robot.with_effects({"slippery_patch": each}) for each in everywhere for robot in (EV3, slow)]
    physics = np.concatenate([robot.physics for robot in robots])
    replayer = replayer_of(recording, memory_s=1.0)
    alone = np.concatenate([replayer.errors(physics[k : k + 1]) for k in range(len(physics))])
    played.clear()
    together = replayer.errors(physics)
    assert sum(played) < 0.6 * len(physics)
    np.testing.assert_array_equal(together, alone)
    bare = replayer.errors(EV3.physics)[0]
    entered = [not np.array_equal(errors, bare, equal_nan=True) for errors in together[::2]]
    assert 0.1 < np.mean(entered) < 0.9
