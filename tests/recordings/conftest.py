"""A drive on the floor, and how logs of it are brought in."""

from functools import partial

import pytest
from support.foreign_logs import import_texts
from support.synthetic import drive


@pytest.fixture(scope="module")
def run():
    return drive(3)


@pytest.fixture
def bring_in(tmp_path):
    return partial(import_texts, tmp_path)
