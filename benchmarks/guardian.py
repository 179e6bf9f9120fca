"""What the guardian of a run costs: at the start of the command, and in a step.

    python -m benchmarks.guardian PACKAGE.ssp [--pairs N]

Runs of the command by turns with and without it, each in a process of its own: whole time of one short run, and the
wall time of the steps of a whole one. Medians of the differences.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def run(package: Path, folder: Path, guardian: bool, *more: str) -> tuple[float, float]:
    """(time of the command, of its steps) [s]"""
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package), "--out", str(folder)]
    environment = {**os.environ, "DEEPSEA_COSIM_GUARDIAN": str(int(guardian))}
    begin = time.perf_counter()
    subprocess.run([*command, "--no-plot", "--quiet", *more], check=True, env=environment)
    return time.perf_counter() - begin, json.loads((folder / "summary.json").read_text())["wall_time_s"]


def main() -> None:
    p = argparse.ArgumentParser(prog="python -m benchmarks.guardian", description=__doc__,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("package", type=Path)
    p.add_argument("--pairs", type=int, default=15)
    options = p.parse_args()
    starts, steps = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for _ in range(options.pairs):
            short = {g: run(options.package, folder / "a", g, "--stop-time", "0.01")[0] for g in (True, False)}
            whole = {g: run(options.package, folder / "b", g)[1] for g in (True, False)}
            starts.append(short[True] - short[False])
            steps.append(whole[True] / whole[False])
    print(f"start: {1e3 * statistics.median(starts):+.1f} ms (of {options.pairs} pairs)")
    print(f"steps: {statistics.median(steps):.3f} times the time without")


if __name__ == "__main__":
    main()
