"""The checkpoint: an evolution's state as plain bytes, with a checksum, and nothing that could be executed.

A line ``gecar checkpoint 4 <sha256 of all that follows>``, a line of JSON with whole numbers and the arrays' rows,
and the arrays one after the other, little-endian, in the order of `_layout`; the lineage is packed by zlib.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from gecar.errors import InputError, expected
from gecar.evolution.history import HISTORY
from gecar.evolution.lineage import MAX_BYTES
from gecar.evolution.phenotypes import DIGEST_BYTES
from gecar.evolution.state import State
from gecar.search.fitness import score_type

_MAGIC = b"gecar checkpoint "
_VERSION = b"4"


def pack(state: State, configuration: str) -> bytes:
    """Return a state as bytes.

    Parameters
    ----------
    state
        Between two generations.
    configuration
        What identifies the run's configuration.
    """
    kind = state.scores.dtype
    sizes = len(state.best_genome), *(kind[name].shape[0] for name in ("arrival_s", "drawn_s", "costs"))
    arrays = {name: getattr(state, name) for name in _layout(*sizes)}
    arrays["lineage"] = np.frombuffer(zlib.compress(state.lineage.tobytes(), level=1), np.uint8)
    header = {
        "configuration": configuration,
        "seed": state.seed,
        "best_generation": state.best_generation,
        "sizes": sizes,
        "rows": {name: len(array) for name, array in arrays.items()},
    }
    body = b"".join([json.dumps(header).encode(), b"\n", *(array.tobytes() for array in arrays.values())])
    return b"%s%s %s\n%s" % (_MAGIC, _VERSION, _checksum(body), body)


def unpack(raw: bytes, configuration: str, where: Path) -> State:
    """Read a state back.

    Parameters
    ----------
    raw
        What `pack` returned.
    configuration
        The configuration it must be from.
    where
        Its file, for errors.

    Raises
    ------
    InputError
        If it is no checkpoint, of another version, cut short, changed, or from another configuration.
    """
    line, _, body = raw.partition(b"\n")
    if not line.startswith(_MAGIC):
        raise expected(where, "something else", "a gecar checkpoint")
    version, _, checksum = line.removeprefix(_MAGIC).partition(b" ")
    if version != _VERSION:
        shown = repr(version[:20].decode("ascii", "replace"))
        raise expected(where, f"a checkpoint of version {shown}", f"version {_VERSION.decode()}")
    if _checksum(body) != checksum:
        raise expected(where, "a checkpoint cut short or changed (its checksum differs)", "a whole one")
    try:
        return _read(body, configuration, where)
    except (ValueError, KeyError, TypeError, OverflowError, MemoryError, zlib.error) as error:
        if isinstance(error, InputError):
            raise
        raise expected(where, f"a header that does not fit ({error})", "a whole checkpoint") from None


def _read(body: bytes, configuration: str, where: Path) -> State:
    """Read what the checksum vouches for; now only a forged header can be wrong."""
    line, _, rest = body.partition(b"\n")
    header = json.loads(line)
    if header["configuration"] != configuration:
        raise expected(
            where,
            "a checkpoint from another configuration",
            "one that belongs to the config.toml in the same folder",
        )
    arrays, used = {}, 0
    for name, kind in _layout(*header["sizes"]).items():
        size = header["rows"][name] * kind.itemsize
        flat = np.frombuffer(rest[used : used + size], kind.base)
        arrays[name] = flat.reshape(header["rows"][name], *kind.shape).copy()
        used += size
    # Bounded: a few forged bytes could unpack to more than there is memory.
    unpacked = zlib.decompressobj().decompress(arrays["lineage"].tobytes(), MAX_BYTES)
    arrays["lineage"] = np.frombuffer(unpacked, np.uint8)
    return State(seed=header["seed"], best_generation=header["best_generation"], **arrays)


def _layout(codons: int, n_arrivals: int, n_times: int, n_costs: int = 0) -> dict[str, np.dtype[Any]]:
    """Return what a row of each array is, in the order they are written."""
    score = score_type(n_arrivals, n_times, n_costs)
    return {
        "genomes": np.dtype(("u1", (codons,))),
        "scores": score,
        "best_genome": np.dtype("u1"),
        "best_score": score,
        "contenders": np.dtype(("u1", (codons,))),
        "contender_scores": score,
        "contender_generations": np.dtype("<i8"),
        "history": HISTORY,
        "digests": np.dtype(("u1", (DIGEST_BYTES,))),
        "cached": score,
        "lineage": np.dtype("u1"),
    }


def _checksum(body: bytes) -> bytes:
    return hashlib.sha256(body).hexdigest().encode()
