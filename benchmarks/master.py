"""Speed of the master: microseconds per macro step of two native FMUs, beside FMPy's `simulate_ssp`.

    python -m benchmarks.master [--steps N] [--repeats N] [--long STEPS [--results NAME]]

The FMUs are a mass and a spring compiled from benchmarks/fmus/linear.c. The masters run the same package turn by
turn, so whatever else the machine does hits all. ecos and libcosim are run too where ecospy and tbb, and libcosimpy are
installed. --long runs so many steps streamed to a file (CSV, or what the name says) and prints the memory that is
needed, for a tenth of them and for all; nothing else is measured then.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

STEP = 1e-3


def package(folder: Path, count: int) -> Path:
    """Mass and spring, `count` steps."""
    from tests.packages import binding, bindings, component, connector, link, system, values
    from tests.packages import package as write

    parts = {
        "spring": {"A": [[0]], "B": [[-100.0]], "C": [[1]], "x0": [-100.0]},
        "mass": {"A": [[0, 1], [0, 0]], "B": [[0], [1]], "C": [[1, 0], [0, 1]], "x0": [1, 0]},
    }
    sets = {a: v for name, m in parts.items() for a, v in native.values(name, **m).items()}
    elements = [
        component(name, "resources/Linear2.fmu", connector("u1", "input"), connector("y1", "output"),
                  connector("y2", "output"))
        for name in parts
    ]  # fmt: skip
    root = system("root", *elements, links=(link("spring.y1", "mass.u1"), link("mass.y2", "spring.u1")),
                  bindings=bindings(binding(values(sets))))  # fmt: skip
    fmu = native.linear(folder, 2, through=False, plain=True)
    return write(folder / "native.ssp", root, {"resources/Linear2.fmu": fmu}, stop=count * STEP, step=STEP)


def ours(path: Path, folder: Path, **options: object) -> float:
    """Seconds in the steps of our master."""
    return float(run(path, folder, Options(**options)).summary["wall_time_s"])  # type: ignore[arg-type]


def fmpy(path: Path, stop: float) -> float:
    """Seconds of FMPy's master, which records all outputs in memory; a run of one step is taken off as set-up."""
    from fmpy.ssp.simulation import simulate_ssp

    def seconds(until: float) -> float:
        begin = time.perf_counter()
        simulate_ssp(str(path), stop_time=until, step_size=STEP)
        return time.perf_counter() - begin

    return seconds(stop) - seconds(STEP)


def ecos(path: Path, count: int) -> float | None:
    """Seconds of ecos, which records nothing, or None where it is not installed."""
    from deepsea_cosim.fmus.cross_check import ecos as found

    ecospy = found()
    if ecospy is None:
        return None
    with ecospy.EcosSimulation(STEP, ssp_path=str(path)) as simulation:
        simulation.init()
        begin = time.perf_counter()
        simulation.step(count)
        return time.perf_counter() - begin


def libcosim(path: Path, count: int) -> float | None:
    """Seconds of libcosim, which records nothing, from its first step on; None where it is not installed."""
    try:
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    except ImportError:
        return None
    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(ssp_path=str(path), step_size=round(1e9 * STEP))
    execution.step()  # which initialises
    begin = time.perf_counter()
    execution.step(step_count=count)
    return time.perf_counter() - begin


def measure(name: str, count: int, repeats: int, runs: dict[str, Callable[[], float | None]]) -> None:
    """Run all of them turn by turn and print microseconds per step."""
    found: dict[str, list[float]] = {key: [] for key in runs}
    for _ in range(repeats):
        for key, function in runs.items():
            seconds = function()
            if seconds is not None:
                found[key].append(1e6 * seconds / count)
    print(f"{name}, {count} steps, median of {repeats} [us per macro step]")
    base = statistics.median(found["FMPy simulate_ssp"])
    for key, times in found.items():
        if times:
            middle = statistics.median(times)
            print(f"  {key:<44}{middle:>9.3f}   {base / middle:>7.1f} x FMPy")


def python_fmus(repeats: int) -> None:
    """What the master adds to two FMUs written in Python."""
    root = Path(__file__).parent.parent / "tests" / "toys"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for script in ("toy_mass.py", "toy_spring.py"):
            command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(root / script), "-d", str(folder)]
            subprocess.run(command, check=True, capture_output=True, cwd=folder)
        from tests.toys import package as toys

        fmus = {"spring": folder / "Spring.fmu", "mass": folder / "Mass.fmu"}
        links = ("spring.F -> mass.F", "mass.x -> spring.x", "mass.v -> spring.v")
        count = 20_000
        path = toys(folder / "toys.ssp", fmus, links, {"spring.k": 100.0}, stop=count * STEP, step=STEP)
        times, alone = [], []
        for _ in range(repeats):
            times.append(1e6 * ours(path, folder / "out", results="") / count)
            alone.append(1e6 * _own_calls(path) / count)
    whole, own = statistics.median(times), statistics.median(alone)
    print(
        f"two pythonfmu FMUs: {whole:.2f} us per macro step; their own doStep, get and set called from C take "
        f"{own:.2f} us: {whole - own:+.2f} us"
    )


def _own_calls(path: Path) -> float:
    """Seconds of the FMUs' own calls in a bare loop: the program without exchange, record and checks."""
    from contextlib import ExitStack

    import numpy as np
    from deepsea_cosim.master.coupling.initialisation import Initialiser
    from deepsea_cosim.master.engine.runner import Runner
    from deepsea_cosim.master.options import Options
    from deepsea_cosim.master.system.assemble import assemble
    from deepsea_cosim.master.system.findings import Findings
    from deepsea_cosim.master.system.instances import load_instances

    with ExitStack() as stack:
        made = assemble(path, Options(), stack, Findings())
        assert made is not None
        load_instances(made.instances, stack, lambda *_: None)
        stop = made.network.structure.stop_time or 1.0
        Initialiser(made.system)(made.values, 0.0, stop)
        program = made.system.writer.program()
        for instance in made.instances.values():
            program.advance([instance])
        runner = Runner(program)
        runner.timed = False
        count = round(stop / STEP)
        rows = np.zeros((count, 0))
        begin = time.perf_counter()
        runner.run(rows, 0.0, STEP, 0, count, count, stop)
        return time.perf_counter() - begin


def long_run(count: int, results: str) -> None:
    """Memory of runs streamed to a file, each in a process of its own."""
    for steps in (count // 10, count):
        code = (
            "from benchmarks.master import package, ours; import resource, tempfile, pathlib, time\n"
            f"with tempfile.TemporaryDirectory() as d:\n d = pathlib.Path(d); p = package(d, {steps})\n"
            " b = time.perf_counter()\n"
            f" ours(p, d / 'out', record=('mass.y1',), results={results!r}); s = time.perf_counter() - b\n"
            f" size = (d / 'out' / {results!r}).stat().st_size\n"
            f"print({steps}, 'steps:', round(s, 1), 's,', round(time.process_time(), 1), 's of CPU,', "
            f"round(size / 1e6), 'MB of {results}, peak memory', "
            "resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, 'MB')"
        )
        subprocess.run([sys.executable, "-c", code], check=True)


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.master", description="Measures the speed of cosim-master.")
    p.add_argument("--steps", type=int, default=100_000)
    p.add_argument("--repeats", type=int, default=5)
    p.add_argument("--long", type=int, metavar="STEPS", help="only run so many steps and print the memory")
    p.add_argument("--results", default="results.csv", help="name of the file of the long run (default: %(default)s)")
    options = p.parse_args()
    if native.compiler is None:
        p.error("needs a C compiler")
    if options.long:
        long_run(options.long, options.results)
        return
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        count = options.steps
        path = package(folder, count)
        few = package(folder / "few", count // 20)
        ours(path, folder / "out", results="")  # compiled code is loaded
        runs: dict[str, Callable[[], float | None]] = {
            "cosim-master, no file": lambda: ours(path, folder / "out", results=""),
            "cosim-master, all 6 variables to CSV": lambda: ours(path, folder / "out"),
            "cosim-master, jacobi, no file": lambda: ours(path, folder / "out", results="", method="jacobi"),
            "FMPy simulate_ssp": lambda: 20.0 * fmpy(few, count // 20 * STEP),
            "ecos": lambda: ecos(path, count),
            "libcosim": lambda: libcosim(path, count),
        }
        measure("two native FMUs", count, options.repeats, runs)
        python_fmus(options.repeats)
    print(f"peak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024} MB")


if __name__ == "__main__":
    main()
