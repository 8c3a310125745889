"""Stands in for a tool that is examined: names the same for every case, and says what lies beside the case."""

from __future__ import annotations

import json
import sys
from pathlib import Path

case, out = (Path(word) for word in sys.argv[1:3])
print(*sorted(path.name for path in case.parent.iterdir()))
verdict = {"verdict": "missing", "effects": [{"id": "backlash", "or": ["dead_band"], "parameters": {}}]}
if case.name == "a":
    verdict = {"verdict": "nothing", "effects": []}
(out / "verdict.json").write_text(json.dumps(verdict), encoding="utf-8")
