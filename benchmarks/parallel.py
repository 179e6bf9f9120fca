"""What `--parallel` gains: two FMUs that take a millisecond of the processor's time for a step, and two fast ones.

    python -m benchmarks.parallel [--pairs N] [--steps N] [--pin]

Each package is run one FMU after the other and side by side, in turns; told are the median and the least wall time
of a macro step, the ratios of both, and whether the results are the same, bit for bit. The least times are those of
runs that nothing else has disturbed. It needs two cores that nothing else uses.
--pin gives each thread and process a core of its own, where much else runs and the system would move them about.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from itertools import count
from pathlib import Path

from deepsea_cosim.master.engine import step_threads
from deepsea_cosim.master.isolation.isolated import IsolatedInstance
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

STEP = 1e-3


def circle(folder: Path, fmu: Path, steps: int, **values: float) -> Path:
    """Two FMUs that give each other y1."""
    from tests.packages import binding, bindings, component, connector, link, package, system
    from tests.packages import values as parameters

    source = f"resources/{fmu.name}"
    both = connector("u1", "input"), connector("y1", "output")
    own = bindings(binding(parameters(values))) if values else ""
    parts = [component(name, source, *both, bindings=own) for name in "ab"]
    root = system("root", *parts, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    return package(folder / "circle.ssp", root, {source: fmu}, stop=steps * STEP, step=STEP)


def row(folder: Path, fmu: Path, steps: int, **values: float) -> Path:
    """One FMU that drives two, which do not depend on each other, and these a fourth; only the two can be slow."""
    from tests.packages import binding, bindings, component, connector, link, package, system
    from tests.packages import values as parameters

    source = f"resources/{fmu.name}"
    ports = connector("u1", "input"), connector("u2", "input"), connector("y1", "output")
    quick = {k: v for k, v in values.items() if k != "trouble"}
    parts = [
        component(name, source, *ports, bindings=bindings(binding(parameters(values if name in "bc" else quick))))
        for name in "abcd"
    ]
    links = ("a.y1", "b.u1"), ("a.y1", "c.u1"), ("b.y1", "d.u1"), ("c.y1", "d.u2")
    root = system("root", *parts, links=tuple(link(*ends) for ends in links))
    return package(folder / "row.ssp", root, {source: fmu}, stop=steps * STEP, step=STEP)


def python_fmu(folder: Path) -> Path:
    """The slow FMU in Python, built by pythonfmu."""
    folder.mkdir(parents=True, exist_ok=True)
    script = Path(__file__).parent / "fmus" / "slow.py"
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return folder / "Slow.fmu"


def compare(name: str, package: Path, method: str, pairs: int, steps: int) -> None:
    """Print what side by side takes against one after the other."""
    found: dict[bool, list[float]] = {True: [], False: []}
    results = set()
    for _ in range(pairs):
        for parallel in (False, True):
            folder = package.parent / f"{method}-{parallel}"
            summary = run(package, folder, Options(method=method, parallel=parallel)).summary
            found[parallel].append(summary["wall_time_s"] / steps)
            results.add((folder / "results.csv").read_bytes())
    ratio = statistics.median(one / two for one, two in zip(found[False], found[True], strict=True))
    median, least = ([1e6 * of(found[p]) for p in (False, True)] for of in (statistics.median, min))
    same = "the same bit for bit" if len(results) == 1 else "NOT the same"
    print(
        f"{name:<46}{method:<14} median {median[0]:>7.1f} us, {median[1]:>7.1f} us, {ratio:.2f} times as fast; least "
        f"{least[0]:>7.1f} us, {least[1]:>7.1f} us, {least[0] / least[1]:.2f} times; {same}", flush=True
    )  # fmt: skip


def pin() -> None:
    """This process on the first core, threads and processes of FMUs on the next ones."""
    own = sorted(os.sched_getaffinity(0))
    load = IsolatedInstance.load

    class Thread(step_threads.Thread):  # type: ignore[misc]
        def run(self) -> None:
            os.sched_setaffinity(0, {own[next(numbers) % len(own)] if len(own) > 2 else own[-1]})
            super().run()

    numbers = count(1)

    def loaded(self: IsolatedInstance, *arguments: object) -> None:
        load(self, *arguments)  # type: ignore[arg-type]
        assert self._process is not None
        os.sched_setaffinity(self._process.pid, {own[next(numbers) % len(own)]})

    step_threads.Thread, step_threads.cores, IsolatedInstance.load = Thread, lambda: len(own), loaded  # type: ignore
    os.sched_setaffinity(0, {own[0]})


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.parallel", description="What --parallel gains.")
    p.add_argument("--pairs", type=int, default=15)
    p.add_argument("--steps", type=int, default=200)
    p.add_argument("--pin", action="store_true", help="each thread and process on a core of its own")
    options = p.parse_args()
    if options.pin:
        pin()
    if native.compiler is None:
        p.error("needs a C compiler")
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        fmu = native.linear(folder / "native", 2, through=False, plain=False)
        state = {"A[1,1]": -1.0, "B[1,1]": 1.0, "B[1,2]": 0.5, "C[1,1]": 1.0, "x0[1]": 1.0}
        slow = {**state, "trouble": 21.0, "when": 0.0}
        n, many = options.steps, 40 * options.steps
        for name, package, methods, steps in (
            ("two native FMUs of 1 ms", circle(folder / "slow", fmu, n, **slow), ("jacobi", "extrapolation"), n),
            ("two of four, that do not depend on each other", row(folder / "row", fmu, n, **slow),
             ("gauss-seidel", "nepce"), n),
            ("two Python FMUs of 1 ms", circle(folder / "python", python_fmu(folder / "own"), n), ("jacobi",), n),
            ("two native FMUs of 1 us", circle(folder / "fast", fmu, many, **state), ("jacobi",), many),
        ):  # fmt: skip
            for method in methods:
                compare(name, package, method, options.pairs, steps)


if __name__ == "__main__":
    main()
