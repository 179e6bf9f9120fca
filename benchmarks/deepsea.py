"""How long a user waits for the 11 km scenario: whole commands, timed from outside.

    python benchmarks/deepsea.py BUILD_FOLDER [RUNS]

Prints, for empty caches and for later runs, the time from the start of the command to its first step and its end, and
what the loop itself takes. The folder holds the packages made by `cosim-fmus build`.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter


def timed(package: Path, cache: Path, *options: str) -> dict[str, float]:
    """Seconds of one command: total, first step, loop."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package), "--quiet", "--out", folder, *options]
        environment = {**os.environ, "DEEPSEA_COSIM_CACHE": str(cache)}
        begin = perf_counter()
        subprocess.run(command, check=True, env=environment)
        total = perf_counter() - begin
        # a run of one step ends with its first step, less the end of the process, which is left in
        begin = perf_counter()
        subprocess.run([*command, "--no-plot", "--stop-time", "0.001"], check=True, env=environment)
        first = perf_counter() - begin
        summary = json.loads((Path(folder) / "summary.json").read_text())
    return {"total": total, "first step": first, "set-up": summary["setup_time_s"]}


def loop(package: Path, cache: Path) -> float:
    """Wall time of the 22000 steps [s]."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package), "--quiet", "--no-plot"]
        environment = {**os.environ, "DEEPSEA_COSIM_CACHE": str(cache)}
        subprocess.run([*command, "--out", folder], check=True, env=environment)
        return json.loads((Path(folder) / "summary.json").read_text())["wall_time_s"]


def main() -> None:
    """Print the table."""
    package = Path(sys.argv[1]) / "deepsea_11km.ssp"
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    with tempfile.TemporaryDirectory() as cold:
        begin = perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(package), "--quiet", "--no-plot"]
            command += ["--out", folder, "--stop-time", "0.001"]
            subprocess.run(command, check=True, env={**os.environ, "DEEPSEA_COSIM_CACHE": cold})
        print(f"first step with empty caches        {perf_counter() - begin:6.2f} s   (asked: 4 s)")
        cache = Path(cold)
        warm = [timed(package, cache) for _ in range(runs)]
        bare = [timed(package, cache, "--no-plot")["total"] for _ in range(runs)]
        loops = [loop(package, cache) for _ in range(runs)]
    median = statistics.median
    print(f"first step, later runs              {median(r['first step'] for r in warm):6.2f} s   (asked: 1.5 s)")
    print(f"whole command with plot             {median(r['total'] for r in warm):6.2f} s")
    print(f"whole command without plot          {median(bare):6.2f} s   (asked: 2 s, aim 1 s)")
    print(f"22000 steps, recorded and written   {median(loops):6.2f} s   = {median(loops) / 22000 * 1e6:.1f} us a step")
    print(f"medians of {runs} runs")


if __name__ == "__main__":
    main()
