"""The worlds of the concealed cases that can be tested here."""

import importlib.util

import pytest

from benchmarks.concealed.worlds import WORLDS

HERE = [
    pytest.param(
        world,
        marks=pytest.mark.skipif(
            world == "bullet" and importlib.util.find_spec("pybullet") is None,
            reason="PYBULLET IS MISSING: its world is not tested (pip install gecar[bench])",
        ),
    )
    for world in WORLDS
]
