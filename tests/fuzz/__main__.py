"""The campaign: ``make fuzz ARGS="--inputs 250000 --target grammar"``.

Atheris (libFuzzer) makes inputs guided by what they reach in the readers. A reader may refuse an input by an
`InputError` of one line, within two seconds and a gigabyte; anything else is a finding, and its input is kept.
"""

from __future__ import annotations

import argparse
import io
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from contextlib import redirect_stderr, suppress
from pathlib import Path

import atheris

ROOT = Path(__file__).parents[2]
# The compiler would meet the watching code: modules with kernels are left alone.
KERNELS = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "gecar").rglob("*.py")
    if "from gecar.compiled import" in path.read_text(encoding="utf-8")
]
with redirect_stderr(io.StringIO()), atheris.instrument_imports(include=["gecar", "PIL"], exclude=KERNELS):
    from gecar.errors import InputError

    from .corpus import FOLDER, GECAR, keep_smallest, kept
    from .targets import TARGETS, WORDS

COUNTS = Path(__file__).parent / "counts.json"
WORK = Path("runs/fuzz")
LONGEST_S = 2.0
MOST_MEMORY = 1024**3
LONGEST_INPUT = 4096


class Watched:
    """A target that keeps what it should not have met; libFuzzer calls it."""

    def __init__(self, target: str, work: Path, folder: Path) -> None:
        self.target, self.work, self.folder = target, work, folder
        self.inputs = 0

    def __call__(self, raw: bytes) -> None:
        """Run one input."""
        self.inputs += 1
        if self.inputs % 100 == 0:
            (self.work / "inputs").write_text(str(self.inputs))
        began = time.process_time()
        fault = self.fault(raw)
        took = time.process_time() - began
        if not fault and took > LONGEST_S:
            fault = f"slow-{took:.0f}s"
        if fault:
            self.keep(raw, fault)

    def fault(self, raw: bytes) -> str:
        """Return the name of what went wrong; empty if nothing did."""
        try:
            TARGETS[self.target](raw, self.folder)
        except InputError as error:
            return "two-lines" if "\n" in str(error) else ""
        except Exception as error:  # noqa: BLE001  whatever it is, it is a finding
            frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(GECAR)]
            place = (
                f"{Path(frames[-1].filename).stem}-{frames[-1].name.strip('<>')}" if frames else "property"
            )
            return f"{type(error).__name__}-{place}"
        return ""

    def keep(self, raw: bytes, fault: str) -> None:
        """Keep an input, the smallest of its fault."""
        path = FOLDER / self.target / f"found-{fault}.fuzz"
        if not path.exists():
            print(f"\nFOUND {self.target}: {fault}", file=sys.stderr, flush=True)
        if not path.exists() or len(raw) < path.stat().st_size:
            path.write_bytes(raw)


def fuzz(target: str, inputs: int, seconds: int) -> None:
    """Run inputs through a target; does not return."""
    work = WORK / target
    words = ("".join(f"\\x{byte:02x}" for byte in word.encode()) for word in WORDS[target].split(" "))
    (work / "words.dict").write_text("".join(f'"{word}"\n' for word in words if word))
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
    watched = Watched(target, work, folder)
    for path in kept(target):  # compiles what is to be compiled, before the clock runs
        with suppress(Exception):
            TARGETS[target](path.read_bytes(), folder)
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MOST_MEMORY, now + MOST_MEMORY))
    limits = [f"-runs={inputs}", f"-max_total_time={seconds}", f"-max_len={LONGEST_INPUT}", "-timeout=30"]
    places = [
        f"-dict={work / 'words.dict'}",
        f"-artifact_prefix={work}/died-",
        str(work / "new"),
        str(FOLDER / target),
    ]
    atheris.Setup([sys.argv[0], *limits, "-verbosity=0", "-print_final_stats=0", *places], watched)
    atheris.Fuzz()


def campaign(target: str, inputs: int, seconds: int) -> bool:
    """Fuzz a target in a process of its own, keep what it came upon; return whether nothing was wrong."""
    work = WORK / target
    shutil.rmtree(work, ignore_errors=True)
    (work / "new").mkdir(parents=True)
    (FOLDER / target).mkdir(parents=True, exist_ok=True)
    words = ["--target", target, "--inputs", str(inputs), "--seconds", str(seconds), "--child"]
    with suppress(KeyboardInterrupt):
        subprocess.run([sys.executable, "-m", "tests.fuzz", *words], check=False)
    for path in work.glob("died-*"):
        shutil.copy(path, FOLDER / target / f"found-{path.name}.fuzz")
    ran = int((work / "inputs").read_text()) if (work / "inputs").exists() else 0
    counts = json.loads(COUNTS.read_text()) if COUNTS.exists() else {}
    counts[target] = counts.get(target, 0) + ran
    COUNTS.write_text(json.dumps(counts, indent=2, sort_keys=True) + "\n")
    files, size = keep_smallest(target, (work / "new").iterdir())
    wrong = [path.name for path in kept(target) if Watched(target, work, work).fault(path.read_bytes())]
    print(
        f"{target}: {ran} inputs now, {counts[target]} in all; kept {files} of {size} bytes; wrong: {wrong or 'none'}"
    )
    return not wrong


def main() -> int:
    """Fuzz the targets asked for, one after the other."""
    parser = argparse.ArgumentParser(prog="make fuzz")
    parser.add_argument("--target", choices=TARGETS, action="append", help="which reader (all)")
    parser.add_argument("--inputs", type=int, default=10_000, help="how many for each target")
    parser.add_argument("--seconds", type=int, default=0, help="how long for each target at most")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        fuzz(given.target[0], given.inputs, given.seconds)
    clean = [campaign(target, given.inputs, given.seconds) for target in given.target or TARGETS]
    return 0 if all(clean) else 1


if __name__ == "__main__":
    sys.exit(main())
