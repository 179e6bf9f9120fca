"""The command cosim-master. Everything heavy is imported only when a run starts."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, NoReturn

from ..core.cli import OneLineParser
from ..core.errors import CosimError, Interrupted, SimulationError
from .algorithms import NAMES

EXAMPLES = """examples:
  cosim-master deepsea_11km.ssp
  cosim-master deepsea_11km.ssp --out runs/heavy --set arm.load_weight=1000
  cosim-master deepsea_11km.ssp --set depth=6000 --stop-time 10 --step 0.002
  cosim-master deepsea_11km.ssp --method jacobi --quiet

exit codes: 0 done, 1 the simulation had to stop (what was recorded is kept), 2 bad input, 130 interrupted
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-master",
        description="Run the system of an SSP package as a fixed-step co-simulation of its FMUs.",
        epilog=EXAMPLES,
    )
    p.add_argument("package", metavar="SCENARIO.ssp", type=Path, help="the SSP package")
    p.add_argument("--out", metavar="DIR", type=Path, help="result folder (default: results/<name of the package>)")
    p.add_argument("--step", metavar="S", type=float, help="macro step in seconds (default: the package's)")
    p.add_argument("--stop-time", metavar="S", type=float, help="end of the run in seconds (default: the package's)")
    p.add_argument(
        "--set",
        metavar="component.parameter=value",
        action="append",
        default=[],
        dest="changes",
        help="set a parameter or start value; without a component it is set wherever it exists; may be repeated",
    )
    p.add_argument(
        "--method", choices=NAMES, default=NAMES[0], help="coupling: %(choices)s (default: %(default)s)"
    )
    p.add_argument("--no-plot", action="store_true", help="do not draw overview.png")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    p.add_argument("--version", action="store_true", help="print the versions and exit")
    return p


class _Progress:
    """A progress bar that appears once a run takes longer than a second, on a terminal only."""

    def __init__(self, quiet: bool):
        self._quiet = quiet or not sys.stderr.isatty()
        self._begin = perf_counter()
        self._bar: Any = None

    def __call__(self, done: int, total: int) -> None:
        if self._quiet or (self._bar is None and (perf_counter() - self._begin < 1.0 or done == total)):
            return
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(total=total, unit="step", unit_scale=True, leave=False)
        self._bar.update(done - self._bar.n)
        if done == total:
            self._bar.close()


def _table(summary: dict[str, Any], result: Any) -> str:
    coupling = [
        f"  residual {bond['residual_energy_J']:.3g} J of {bond['exchanged_energy_J']:.4g} J exchanged "
        f"({100 * bond['relative']:.2g} %)  {bond['bond']}"
        for bond in summary["coupling"]
    ]
    fmus = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in summary["fmu_time_s"].items())
    lines = [
        f"{Path(summary['package']).stem}: {summary['stop_time_s'] - summary['start_time_s']:g} s in "
        f"{summary['steps']} steps of {summary['step_s']:g} s, {summary['method']}",
        f"  wall time {summary['wall_time_s']:.2f} s ({summary['real_time_factor']:.1f} x real time) after "
        f"{summary['setup_time_s']:.2f} s of set-up; {fmus}",
        *coupling,
        "",
        f"  {'signal':<28}{'unit':>7}{'start':>13}{'least':>13}{'greatest':>13}{'end':>13}",
    ]
    for name in dict.fromkeys(result.connected):
        values = "".join(f"{row[result.names.index(name)]:>13.6g}" for row in result.extremes)
        lines.append(f"  {name:<28}{result.units.get(name, ''):>7}{values}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "--version" in given:
        from .output import versions

        print("  ".join(f"{name} {version}" for name, version in versions().items()))
        return 0
    options = parser().parse_args(given)
    try:
        return _run(options)
    except Interrupted as error:
        print(f"cosim-master: {error}", file=sys.stderr)
        return 130
    except SimulationError as error:
        print(f"cosim-master: {error}", file=sys.stderr)
        return 1
    except CosimError as error:
        print(f"cosim-master: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:  # before the run took over
        print("cosim-master: interrupted", file=sys.stderr)
        return 130


def _run(options: argparse.Namespace) -> int:
    from contextlib import ExitStack

    from .plot import Plotter
    from .simulate import Options, parse_change, run

    changes = tuple(parse_change(text) for text in options.changes)
    folder = options.out or Path("results") / options.package.stem
    from ..core.errors import PackageError

    try:
        there = options.package.exists()
    except OSError as error:
        raise PackageError(f"{options.package}: {error.strerror}") from None
    if not there:
        raise PackageError(f"{options.package}: no such file")

    with ExitStack() as stack:
        plotter: list[Plotter] = []
        show = _Progress(options.quiet)

        def progress(done: int, total: int) -> None:
            if done == 0 and not options.no_plot:  # get ready while the simulation runs
                plotter.append(stack.enter_context(Plotter()))
            show(done, total)

        settings = Options(options.step, options.stop_time, options.method, changes)
        result = run(options.package, folder, settings, progress=progress)
        files = ["results.csv", "summary.json"]
        if plotter:
            title = f"{options.package.stem} ({options.method}, step {result.summary['step_s']:g} s)"
            problem = plotter[0].draw(folder / "overview.png", title, result)
            if problem:
                print(f"cosim-master: overview.png was not drawn: {problem}", file=sys.stderr)
            else:
                files.append("overview.png")
    if not options.quiet:
        for warning in result.summary["warnings"]:
            print(f"cosim-master: warning: {warning}", file=sys.stderr)
        print(_table(result.summary, result))
        print()
        for name in files:
            print(f"  {folder / name}")
    return 0


def command() -> NoReturn:
    """The console script. It ends the process at once: FMUs that are still loaded may crash while Python shuts down."""
    for name in ("stdout", "stderr"):  # closed by the caller: print into nothing
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        getattr(sys, name).reconfigure(errors="replace")
    try:
        code = main()
        sys.stdout.flush()
    except OSError:  # nobody reads what is printed
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    if setup := sys.modules.get(f"{__package__}.setup"):
        setup.forget_unpacked()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    command()
