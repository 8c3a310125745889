"""Measure, once per case, how loud the concealed physics is, where and when."""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.detectability import Visibility, visibility
from benchmarks.concealed.judging import BIN_S, group_shares
from benchmarks.concealed.recording import Conditions


def sight(out: Path, name: str) -> dict[str, Any]:
    """Measure one case from its sealed pairs of worlds.

    Parameters
    ----------
    out
        Holds ``sealed/``.
    name
        Of the case.

    Returns
    -------
    dict[str, Any]
        ``d_prime``: per concealed effect (with the others present), or of the physics outside the catalogue;
        ``d_prime_run``: of everything concealed, with whole runs instead of 2 s windows; ``groups``: share of the
        energy per group of channels; ``timeline`` (runs, bins): energy per 0.2 s.
    """
    sealed = out / "sealed" / name
    label = json.loads((sealed / "label.json").read_text(encoding="utf-8"))
    if label["kind"] == "none":
        return {"d_prime": {}, "d_prime_run": 0.0, "groups": {}, "timeline": []}
    with np.load(sealed / "truth.npz") as archive:
        worlds = {key: archive[key] for key in archive.files}
    conditions = conditions_of(label)
    whole = visibility(worlds, "on", "off", conditions)
    return {
        "d_prime": _d_primes(label, worlds, conditions, whole),
        "d_prime_run": visibility(worlds, "on", "off", conditions, 12.0).d_prime,
        "groups": group_shares(whole.by_channel()),
        "timeline": _timeline(whole, round(BIN_S * conditions.log_hz)),
    }


def sight_all(out: Path, names: list[str], cache: Path, workers: int) -> dict[str, dict[str, Any]]:
    """Measure many cases, keeping what has been measured.

    Parameters
    ----------
    out, names
        As :func:`sight` takes them.
    cache
        A JSON file to keep the measurements in.
    workers
        Processes.

    Returns
    -------
    dict[str, dict[str, Any]]
        By case.
    """
    known = json.loads(cache.read_text(encoding="utf-8")) if cache.exists() else {}
    missing = [name for name in names if name not in known]
    with ProcessPoolExecutor(workers) as pool:
        known |= dict(zip(missing, pool.map(sight, [out] * len(missing), missing), strict=True))
    if missing:
        cache.write_text(json.dumps(known) + "\n", encoding="utf-8")
    return {name: known[name] for name in names}


def conditions_of(label: Mapping[str, Any]) -> Conditions:
    """Read the recording conditions back from a label."""
    stored: Any = {
        key: tuple(value) if isinstance(value, list) else value for key, value in label["conditions"].items()
    }
    return Conditions(**stored)


def _d_primes(
    label: Mapping[str, Any], worlds: Mapping[str, Any], conditions: Conditions, whole: Visibility
) -> dict[str, float]:
    ids = [effect["id"] for effect in label["effects"]]
    ids += [label["outside"]["id"]] if label["outside"] else []
    if len(ids) == 1:
        return {ids[0]: whole.d_prime}
    return {effect: visibility(worlds, "on", f"without_{effect}", conditions).d_prime for effect in ids}


def _timeline(whole: Visibility, rows: int) -> list[list[float]]:
    energy = whole.energy.sum(axis=2)
    bins = energy.shape[1] // rows
    summed = energy[:, : bins * rows].reshape(len(energy), bins, rows).sum(axis=2)
    return [[round(float(value), 2) for value in row] for row in summed]
