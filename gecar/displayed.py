"""What notebooks show as words and pictures; `gecar.notebook` says how, and is loaded when something is shown."""

from __future__ import annotations

from importlib import import_module


class Displayed:
    """Something that a notebook shows by itself."""

    def _repr_html_(self) -> str:
        return str(import_module("gecar.notebook").html(self))
