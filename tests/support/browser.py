"""A headless Chromium that opens pages; tests that need one are skipped, and say so, where there is none."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt-get install chromium")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
         "--disable-background-networking", "--disable-component-update", "--hide-scrollbars"]  # fmt: skip


def opened(
    page: Path, tmp_path: Path, *words: str, after: str = "", budget: int = 600, size: str = "1280,1060"
) -> str:
    """Open a page in Chromium; return what it printed."""
    command = [str(CHROMIUM), *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={size}"]
    command += [f"--virtual-time-budget={budget}", *words, page.as_uri() + after]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


# Pressed one after the other on an open page; what it shows then stands in its title.
PRESSES = """<script>
const said = [], note = () => said.push(document.body.dataset.time + document.body.dataset.playing[0]);
for (const [key, shift] of %s) {
  document.body.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey: shift, bubbles: true }));
  note();
}
document.title = said.join(" ");
</script></body>"""
