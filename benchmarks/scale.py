"""What large packages cost: set-up, macro step and memory of 10, 100 and 1,000 FMUs with ten links each.

    python -m benchmarks.scale [--sizes 10,100,1000] [--steps N] [--method NAME] [--results NAME]

The FMUs are the native linear one (FMI 3.0), in a ring: each gives either neighbour five values, reals, whole numbers
and truth values (nothing says that these pass an FMU at once). Two of the reals are speed and force, so there is
a power bond between any two neighbours. Each size runs in a process of its own. The phases of its run are told in CPU
time, which other jobs on the machine hardly disturb. The second table has them a FMU: what does not stay level there
from line to line grows faster than the package. `peak` is the memory of the whole process, `more` what came after the
imports.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

from benchmarks import native

STEP = 1e-3

RIGHT = (("y1", "u1"), ("y2", "u2"), ("y5", "u5"), ("integer_out", "integer_in"), ("boolean_out", "boolean_in"))
LEFT = (("y3", "u3"), ("y4", "u4"), ("y6", "u6"), ("item_out", "item_in"), ("wide_out", "wide_in"))
"""What each FMU gives its neighbours."""

PHASES = ("read", "assemble", "load", "initialise", "step", "finish")


def package(folder: Path, count: int, steps: int) -> Path:
    """A ring of `count` damped oscillators."""
    from tests.packages import binding, bindings, component, connector, link, system, values
    from tests.packages import package as write

    fmu = native.linear(folder, 3, through=False, units={"y1": "m/s", "u1": "m/s", "y3": "N", "u3": "N"})
    source = f"resources/{fmu.name}"
    made = [connector(start, "output", None) for start, _ in RIGHT + LEFT]
    made += [connector(end, "input", None) for _, end in RIGHT + LEFT]
    parts, links = [], []
    for i in range(count):
        matrices = native.values(
            "", A=[[-0.1, 1.0], [-100.0 - i % 7, -0.2]], B=[[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.5]],
            C=[[1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.0, 0.5], [1.0, 1.0], [1.0, -1.0]], x0=[1.0 + i % 3, 0.0],
        )  # fmt: skip
        given = values({name.removeprefix("."): value for name, value in matrices.items()})
        parts.append(component(f"part{i}", source, *made, bindings=bindings(binding(given))))
        right = (i + 1) % count
        for giver, taker, ways in ((i, right, RIGHT), (right, i, LEFT)):
            # what passes an FMU at once would be an algebraic loop all around: there it is an output of the system
            shut = [(a, b) for a, b in ways if right or b.startswith("u")]
            links += [link(f"part{giver}.{a}", f"part{taker}.{b}") for a, b in shut]
            links += [link(f"part{giver}.{a}", a) for a, b in ways if (a, b) not in shut]
    shown = tuple(connector(a, "output", None) for a, b in RIGHT + LEFT if not b.startswith("u"))
    root = system("root", *parts, made=shown, links=tuple(links))
    return write(folder / f"ring{count}.ssp", root, {source: fmu}, stop=steps * STEP, step=STEP)


def timed(times: dict[str, float], phase: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose CPU time [s] is added to a phase."""

    @wraps(function)
    def timing(*arguments: Any, **named: Any) -> Any:
        begin = time.process_time()
        try:
            return function(*arguments, **named)
        finally:
            times[phase] = times.get(phase, 0.0) + time.process_time() - begin

    return timing


def measure(count: int, steps: int, method: str, results: str) -> dict[str, float]:
    """CPU time of each phase [s] of a run of so many FMUs, and memory [MB]."""
    from deepsea_cosim.master.options import Options
    from deepsea_cosim.master.simulation import run as start
    from deepsea_cosim.master.simulation.stepping import Loop
    from deepsea_cosim.master.system import assemble

    times: dict[str, float] = {}
    for place, name, phase in (
        (assemble, "read_package", "read"), (start, "plan", "planned"), (start, "load_instances", "load"),
        (start._Run, "start", "started"), (Loop, "run", "step"),
    ):  # fmt: skip
        setattr(place, name, timed(times, phase, getattr(place, name)))
    with tempfile.TemporaryDirectory() as scratch:
        asked = Options(method=method, results=results)
        # first what loads the compiled code
        start.run(package(Path(scratch) / "warm", 2, 10), Path(scratch) / "warm" / "out", asked)
        path = package(Path(scratch), count, steps)
        before, begin = _memory(), time.process_time()
        times.clear()
        start.run(path, Path(scratch) / "out", asked)
        whole = time.process_time() - begin
    return {
        "read": times["read"], "assemble": times["planned"] - times["read"], "load": times["load"],
        "initialise": times["started"] - times["load"], "step": times["step"],
        "finish": whole - times["planned"] - times["started"] - times["step"],
        "peak": _memory(), "more": _memory() - before,
    }  # fmt: skip


def _memory() -> float:
    """Peak of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def table(found: dict[int, dict[str, float]], steps: int, each: bool) -> str:
    """A line a size: phases in ms, a macro step in us, memory in MB; each: all of it divided by the number of FMUs."""
    lines = ["a FMU" if each else "in all"]
    lines.append("".join(f"{head:>13}" for head in ("FMUs", *(f"{p} [ms]" for p in PHASES if p != "step"),
                                                    "a step [us]", "more [MB]", "peak [MB]")))  # fmt: skip
    for count, one in found.items():
        by = count if each else 1
        row = [*(1e3 * one[p] / by for p in PHASES if p != "step"), 1e6 * one["step"] / steps / by, one["more"] / by]
        row += [] if each else [one["peak"]]
        lines.append(f"{count:>13}" + "".join(f"{v:>13.3g}" if v < 1000 else f"{v:>13.0f}" for v in row))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.scale", description="What large packages cost.")
    p.add_argument("--sizes", default="10,100,1000", help="numbers of FMUs (default: %(default)s)")
    p.add_argument("--steps", type=int, default=2000, help="macro steps (default: %(default)s)")
    p.add_argument("--method", default="gauss-seidel")
    p.add_argument("--results", default="", help="name of the result file (default: none)")
    p.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = p.parse_args(arguments)
    if native.compiler is None:
        p.error("needs a C compiler")
    if options.one:
        print(json.dumps(measure(options.one, options.steps, options.method, options.results)))
        return
    found = {}
    for count in map(int, options.sizes.split(",")):
        own = ["--one", str(count), "--steps", str(options.steps), "--method", options.method,
               "--results", options.results]  # fmt: skip
        made = subprocess.run([sys.executable, "-m", "benchmarks.scale", *own], check=True, stdout=subprocess.PIPE)
        found[count] = json.loads(made.stdout.splitlines()[-1])
    print(f"{options.method}, {options.steps} steps, {10 * max(found)} links at most")
    print(table(found, options.steps, each=False))
    print(table(found, options.steps, each=True))


if __name__ == "__main__":
    main()
