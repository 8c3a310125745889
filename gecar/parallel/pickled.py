"""Objects as they travel to workers: pickled once, known by their hash, and unpickled once by each worker."""

from __future__ import annotations

import hashlib
import pickle
import threading
from typing import Any, NamedTuple

_MOST_KEPT = 4
_unpickled = threading.local()


class Pickled(NamedTuple):
    """A pickled object, and the hash it is known by."""

    name: str
    content: bytes


def pickled(thing: Any) -> Pickled:
    """Pickle an object; the result only ever goes to workers of the same run, never to a file."""
    content = pickle.dumps(thing)
    return Pickled(hashlib.sha256(content).hexdigest(), content)


def unpickled(packed: Pickled) -> Any:
    """Return the object; each thread of each worker makes it once, so that no two threads share one."""
    known: dict[str, Any] = _unpickled.__dict__
    if packed.name not in known:
        while len(known) >= _MOST_KEPT:
            del known[next(iter(known))]
        known[packed.name] = pickle.loads(packed.content)  # noqa: S301  pickled by this run itself
    return known[packed.name]
