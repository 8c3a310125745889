"""Whether a long run stays small: memory, checkpoint and history of a run of 2,000 generations.

python -m benchmarks.long_run --out runs/long
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from gecar.evolution.history import Generation
from gecar.report.table import piped
from gecar.results.config import configure
from gecar.results.run import finish, start

SAMPLES = 10
STATUS = Path("/proc/self/status")


def resident_mb() -> float:
    """Return the memory this process holds [MB]; Linux only."""
    line = next(each for each in STATUS.read_text(encoding="ascii").splitlines() if each.startswith("VmRSS"))
    return int(line.split()[1]) / 1024.0


def size_kb(path: Path) -> float:
    """Return a file's size [kB]; 0 before it is first written."""
    return path.stat().st_size / 1024.0 if path.exists() else 0.0


def main() -> None:
    """Run, and print a row for every tenth of the way."""
    parser = ArgumentParser(prog="python -m benchmarks.long_run", description=__doc__)
    parser.add_argument("--generations", type=int, default=2_000)
    parser.add_argument("--population", type=int, default=50)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    sizes = {"population": asked.population, "generations": asked.generations}
    started = start(configure({"preset": "better", "workers": 1, "search": sizes}), asked.out)
    rows = [["generation", "memory [MB]", "checkpoint [kB]", "history.csv [kB]"]]

    def sample(generation: Generation) -> None:
        if generation.generation % max(asked.generations // SAMPLES, 1) == 0:
            kept = [size_kb(asked.out / name) for name in ("checkpoint", "history.csv")]
            rows.append(
                [str(generation.generation), f"{resident_mb():.0f}", *(f"{size:.0f}" for size in kept)]
            )

    finish(started, sample)
    print(piped(rows))


if __name__ == "__main__":
    main()
