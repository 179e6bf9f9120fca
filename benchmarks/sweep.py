"""How much faster a sweep is with two processes than with one.

    python benchmarks/sweep.py build [--cases 200]

The same cases of the machine at 11 km in turn with one and two processes, each in a folder of its own; start-up of the
processes included.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path


def seconds(package: Path, count: int, processes: int) -> float:
    """Wall time of the sweep."""
    from deepsea_cosim.study.sweep.axes import Axis
    from deepsea_cosim.study.sweep.cases import sample
    from deepsea_cosim.study.sweep.metrics import parse_metric
    from deepsea_cosim.study.sweep.run import Settings, sweep

    axes = [Axis("depth", (), 0.0, 11000.0), Axis("arm.load_weight", (), 500.0, 1000.0)]
    settings = Settings((parse_metric("reaches(arm.x_h, 0.2, 0.001, 2)"), parse_metric("max(hydraulics.P1)")))
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        found = sweep(package, sample(axes, "sobol", count), settings, Path(folder), processes=processes)
        taken = time.perf_counter() - begin
    failed = [entry["failed"] for entry in found if "failed" in entry]
    if failed:
        raise SystemExit(f"{len(failed)} cases failed: {failed[0]}")
    return taken


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build", type=Path, help="folder with the scenarios")
    p.add_argument("--cases", type=int, default=200)
    options = p.parse_args()
    package = options.build / "deepsea_11km.ssp"
    one, two = (seconds(package, options.cases, n) for n in (1, 2))
    print(f"{options.cases} cases: {one:.1f} s with one process, {two:.1f} s with two: {one / two:.2f} times as fast")


if __name__ == "__main__":
    main()
