"""The kept corpus of `make fuzz`, run again: every input is read, or refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz.corpus import kept
from fuzz.targets import TARGETS

from gecar.errors import InputError


@pytest.mark.parametrize("target", TARGETS)
def test_every_kept_input_is_read_or_refused_in_one_line(target: str, tmp_path: Path) -> None:
    assert kept(target)
    for path in kept(target):
        try:
            TARGETS[target](path.read_bytes(), tmp_path)
        except InputError as error:
            assert "\n" not in str(error), path.name  # noqa: PT017  refusing is as good as reading
        except Exception as error:
            raise AssertionError(f"{path.name}: {error!r}") from error
