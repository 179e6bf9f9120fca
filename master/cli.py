"""The command cosim-master. Everything heavy is imported only when a run starts."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from ..core import ending
from ..core.cli import OneLineParser, add_version, decimal, end_with, exit_code, file, folder, positive, seconds
from ..core.console import add_output, conclude, in_line
from ..core.errors import CosimError
from ..core.guardian import guarded
from .algorithms import DEFAULT, NAMES

if TYPE_CHECKING:
    from ..core.display_units import DisplayUnits
    from .options import Options
    from .simulation.result import Result

EXAMPLES = """examples:
  cosim-master deepsea_11km.ssp
  cosim-master deepsea_11km.ssp --out runs/heavy --set arm.load_weight=1000
  cosim-master deepsea_11km.ssp --set depth=6000 --stop-time 10 --step 0.002
  cosim-master deepsea_11km.ssp --method nepce --record 'arm.*' --record-every 10 --results arm.parquet
  cosim-master plant.ssp --variant Winter --stimuli commands.csv
  cosim-master plant.ssp --stop-time 10 --out a --save-state
  cosim-master plant.ssp --stop-time 20 --out b --resume a
  cosim-master plant.ssp --check
  cosim-master plant.ssp --info --parameters
  cosim-master pump.fmu --stop-time 10 --step 0.001 --stimuli commands.csv
  cosim-master plant.ssp --html

commands (where no file has that name; each has a --help of its own):
  cosim-master open results/plant                       the run as an interactive page, in the browser
  cosim-master compare results/plant runs/heavy         where and by how much two runs differ
  cosim-master replay results/plant                     the machine in motion

exit codes: 0 done, 1 the simulation had to stop (what was recorded is kept), 2 bad input (or --check found errors),
130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP
"""

COMMANDS = {"open": ".page.command", "compare": ".comparison.command", "replay": ".replay_cli"}
"""First words that are no package (a folder of such a name is ./open): the modules whose `main` they call."""


def _module_of(word: str) -> Any:
    return import_module(COMMANDS[word], __package__)


def _substeps(text: str) -> tuple[str, int]:
    component, equals, ratio = text.rpartition("=")
    if not equals or not component or not ratio.isdigit() or int(ratio) < 1:
        raise argparse.ArgumentTypeError(f"'{text}': expected component=N, e.g. --substeps arm=4")
    return component, int(ratio)


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-master",
        description="Run the system of an SSP package as a fixed-step co-simulation of its FMUs.",
        epilog=EXAMPLES,
    )
    p.add_argument(
        "package", metavar="SCENARIO.ssp", type=file,
        help="the SSP package; a folder like one, a system structure (.ssd), an FMU on its own (.fmu) and an "
        "OspSystemStructure.xml do, too",
    )  # fmt: skip
    p.add_argument("--variant", metavar="NAME", help="another system structure description of the package")
    p.add_argument("--check", action="store_true", help="look for all that is wrong with the package; do not run")
    p.add_argument("--info", action="store_true", help="print the system as a tree; do not run")
    _add_run(p.add_argument_group("the run"))
    _add_results(p.add_argument_group("results"))
    add_output(p)
    add_version(p, lambda: {word: _module_of(word).parser() for word in COMMANDS})
    return p


def _add_run(run: argparse._ArgumentGroup) -> None:
    run.add_argument("--step", metavar="S", type=decimal, help="macro step in seconds (default: the package's)")
    run.add_argument("--stop-time", metavar="S", type=decimal, help="end in seconds (default: the package's)")
    run.add_argument(
        "--set",
        metavar="component.parameter=value",
        action="append",
        default=[],
        dest="changes",
        help="set a parameter or start value; without a component it is set wherever it exists; may be repeated",
    )
    run.add_argument(
        "--parameters", metavar="FILE.ssv", action="append", default=[], type=Path, nargs="?",
        help="a parameter set on top of the package's, e.g. calibrated.ssv of a diagnosis; may be repeated; without a "
        "file, with --info: list the parameters in force",
    )  # fmt: skip
    run.add_argument(
        "--stimuli", metavar="FILE.csv", type=Path, help="series for the system's inputs: time, and a column an input"
    )
    run.add_argument("--method", choices=NAMES, help=f"coupling: %(choices)s (default: the package's, else {DEFAULT})")
    run.add_argument(
        "--substeps", metavar="component=N", action="append", default=[], type=_substeps,
        help="let a component take N steps of its own in a macro step; may be repeated",
    )  # fmt: skip
    run.add_argument(
        "--check-step", action="store_true", help="run again with half the step and estimate the error of every signal"
    )
    run.add_argument(
        "--isolate", action="store_true", help="run each FMU in a process of its own, so that one may crash or hang"
    )
    run.add_argument(
        "--sandbox", action="store_true",
        help="as --isolate, and an FMU may write into its own folders only and use no network (Linux with Landlock)",
    )  # fmt: skip
    run.add_argument(
        "--step-timeout", metavar="S", type=seconds, help="longest time for a step of an FMU, with --isolate"
    )
    run.add_argument(
        "--parallel", action="store_true",
        help="let FMUs that do not depend on each other within a step take it side by side; the results are the same",
    )  # fmt: skip
    run.add_argument(
        "--save-state", action="store_true",
        help="leave the state at the end, or where Ctrl-C came, in the result folder, for --resume",
    )  # fmt: skip
    run.add_argument(
        "--save-state-every", metavar="S", type=seconds, help="and so whenever S seconds have been simulated"
    )
    run.add_argument(
        "--resume", metavar="DIR", type=Path,
        help="go on from the state in the result folder of another run of the same, up to --stop-time",
    )  # fmt: skip
    run.add_argument("--realtime", action="store_true", help="do not run faster than the clock")


def _add_results(results: argparse._ArgumentGroup) -> None:
    results.add_argument("--out", metavar="DIR", type=folder, help="result folder (default: results/<package>)")
    results.add_argument(
        "--results", metavar="FILE", default="results.csv",
        help="name of the result file in it: .csv, .parquet or .h5 (default: %(default)s)",
    )  # fmt: skip
    results.add_argument(
        "--record", metavar="PATTERN", action="append", default=[],
        help="keep only columns that match, e.g. --record 'arm.*'; may be repeated",
    )  # fmt: skip
    results.add_argument(
        "--record-parameters", metavar="PATTERN", action="append", default=[],
        help="add columns with the parameters in force that match; may be repeated",
    )  # fmt: skip
    results.add_argument("--record-every", metavar="N", type=positive, default=1, help="keep every N-th point only")
    results.add_argument(
        "--plot", metavar="PATTERN", action="append", default=[], help="what overview.png shows (default: a choice)"
    )
    results.add_argument(
        "--log", metavar="FILE", default="", help="name of a file in it for what the FMUs say, e.g. fmu.log"
    )
    results.add_argument(
        "--log-level", choices=("error", "warning", "info", "debug"),
        help="what is written there; debug switches the FMUs' debug logging on (default: info)",
    )  # fmt: skip
    results.add_argument(
        "--log-category", metavar="NAME", action="append", default=[],
        help="write notes of that category of the FMUs only, and switch it on; may be repeated",
    )  # fmt: skip
    results.add_argument(
        "--units", metavar="LIST",
        help="what tables and plots show: metric, si, us, or units like mm,bar,L/min,deg (default: what your "
        "units.toml says, else metric); files keep the FMUs' units",
    )  # fmt: skip
    results.add_argument("--no-plot", action="store_true", help="do not draw overview.png")
    results.add_argument(
        "--html", action="store_true",
        help="write results.html too: the run as an interactive page, in one file that needs no network",
    )  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in COMMANDS:
        return int(_module_of(arguments[0]).main(arguments[1:]))
    options = parser().parse_args(arguments)
    return exit_code("cosim-master", lambda: _run(options), as_json=options.json)


def _look(options: argparse.Namespace, settings: Options, display: DisplayUnits) -> int:
    """--check and --info."""
    from .simulation.check import check
    from .system.parameters import parameter_table, parameters_in_force
    from .system.tree import tree

    report = check(options.package, settings)
    lacking = report.network is None or report.incomplete
    if options.json:
        from .as_json import look_content

        conclude(options, lambda: look_content(report, options.info, None in options.parameters), tuple)
        return 2 if report.errors and (options.check or lacking) else 0
    if options.info and report.network is not None:
        print(tree(report.network, report.system))
        if None in options.parameters and report.system is not None:
            in_force = parameters_in_force(report.system, report.values)
            print(f"\nparameters\n{parameter_table(report.system, in_force, display)}")
    if options.check or lacking:
        for line in report.lines():
            if options.quiet and not line.startswith("error"):
                continue
            print(in_line(line), file=sys.stderr if line.startswith("error") else sys.stdout)
        if not options.quiet and options.check:
            counts = ", ".join(
                f"{len(texts)} {kind}{'s' * (len(texts) != 1)}"
                for texts, kind in ((report.errors, "error"), (report.warnings, "warning"))
            )
            print(f"{options.package}: {counts if report.errors or report.warnings else 'nothing wrong'}")
    return 2 if report.errors and (options.check or lacking) else 0


def _run(options: argparse.Namespace) -> int:
    from ..core.display_units import display_units
    from ..core.errors import PackageError, SimulationError, UsageError
    from ..core.files import name_of_results

    try:
        exists = options.package.exists()
    except OSError as error:
        raise PackageError(f"{options.package}: {error.strerror}") from None
    if not exists:
        raise PackageError(f"{options.package}: no such file{_hint(options.package)}")
    if remedy := _no_package(options.package):
        raise PackageError(f"{options.package}: {remedy}")
    if None in options.parameters and not options.info:
        raise UsageError("--parameters: give a file, or --info to list the parameters in force")
    if options.html and not options.results:
        raise UsageError("--html shows a result file: give --results a name")
    settings, display = _settings(options), display_units(options.units)
    if options.check or options.info:
        return _look(options, settings, display)
    folder = options.out or Path("results") / name_of_results(options.package)
    try:
        result, files = _simulate(options, settings, folder, display)
    except SimulationError:
        from .simulation.run_folder import FAILED

        is_new = (folder / options.results).exists() and not (folder / FAILED).exists()
        if options.html and is_new:  # what was recorded shows why it had to stop
            _page(folder, display)
        raise
    if options.html:
        files += _page(folder, display, result)
    _conclude(options, result, files, display)
    return {"failed": 1, "interrupted": ending.code()}.get(result.summary.get("step_check", {}).get("status"), 0)


def _hint(package: Path) -> str:
    """What may have been meant by a package that is not there."""
    from ..core.errors import did_you_mean

    if package.name == "run" and len(package.parts) == 1:
        return "; a package is run without that word: cosim-master PACKAGE.ssp"
    if package.with_name(f"{package.name}.ssp").is_file():
        return f"; did you mean '{package}.ssp'?"
    try:
        beside = [path.name for path in package.parent.iterdir() if path.suffix in (".ssp", ".fmu", ".ssd")]
    except OSError:
        return ""
    return did_you_mean(package.name, beside)


def _no_package(package: Path) -> str:
    """What to say of the results of a run in the place of a package; "" where it is none."""
    if package.is_dir() and (package / "manifest.json").is_file() and not any(package.glob("*.ssd")):
        return f"is a result folder; cosim-master open {package} shows it"
    if package.is_file() and package.suffix.lower() in (".csv", ".parquet", ".h5"):
        return f"is a result file; cosim-master open {package} shows it"
    return ""


def _conclude(options: argparse.Namespace, result: Result, files: list[str], display: DisplayUnits) -> None:
    """Print what came of the run."""
    from .as_json import run_content
    from .terminal import report

    def lines() -> Iterator[str]:
        for warning in result.summary["warnings"]:
            print(f"cosim-master: warning: {in_line(warning)}", file=sys.stderr)
        yield report(result, display)
        yield f"\n{result.folder}: {', '.join(files)}"
        if options.results:
            yield f"{options.results} is in the FMUs' units, which summary.json has"
            yield f"cosim-master open {result.folder}   shows it in a browser"

    conclude(options, lambda: run_content(result, files, display), lines)


def _settings(options: argparse.Namespace) -> Options:
    """What is asked of the run."""
    from .options import Options, parse_change

    return Options(
        step=options.step,
        stop_time=options.stop_time,
        method=options.method,
        changes=tuple(parse_change(text) for text in options.changes),
        parameters=tuple(filter(None, options.parameters)),
        variant=options.variant,
        stimuli=options.stimuli,
        record=tuple(options.record),
        plot=() if options.no_plot else tuple(options.plot),
        record_every=options.record_every,
        results=options.results,
        log=options.log,
        log_level=options.log_level,
        log_categories=tuple(options.log_category),
        substeps=tuple(options.substeps),
        realtime=options.realtime,
        isolate=options.isolate,
        sandbox=options.sandbox,
        parallel=options.parallel,
        step_timeout=options.step_timeout,
        check_step=options.check_step,
        save_state=options.save_state,
        save_state_every=options.save_state_every,
        resume=options.resume,
        record_parameters=tuple(options.record_parameters),
    )


def _simulate(
    options: argparse.Namespace, settings: Options, folder: Path, display: DisplayUnits
) -> tuple[Result, list[str]]:
    """The result of the run, and the names of the files that it has left in the folder."""
    from contextlib import ExitStack

    from ..core.errors import OutputError
    from .simulation.plot import Plotter
    from .simulation.run import run
    from .simulation.run_folder import held_again
    from .terminal import Estimate, Progress

    with ExitStack() as stack:
        plotter: list[Plotter] = []
        show = Progress(options.quiet or options.json)
        record = folder / options.results if options.results else None
        tell = (lambda text: None) if options.quiet else _note
        estimate = Estimate(tell, record)

        def progress(done: int, total: int) -> None:
            if done == 0 and not options.no_plot:  # get ready while the simulation runs
                plotter.append(stack.enter_context(Plotter()))
            show(done, total)
            estimate(done, total)

        loaded = Estimate(tell, text="{} FMUs will be loaded in about {}")
        result = run(options.package, folder, settings, progress=progress, on_hang=_on_hang, say=_note, loaded=loaded)
        states = [saved["file"]] if (saved := result.summary.get("saved_state")) else []
        files = [*filter(None, (options.results, options.log)), "summary.json", "manifest.json", *states]
        if plotter:
            title = f"{options.package.stem} ({result.summary['method']}, step {result.summary['step_s']:g} s)"
            try:
                with held_again(folder, result.summary):
                    problem = plotter[0].draw(folder / "overview.png", title, result, display, options.plot)
            except OutputError as error:
                problem = str(error)
            if problem:
                print(f"cosim-master: overview.png was not drawn: {problem}", file=sys.stderr)
            else:
                files.append("overview.png")
    return result, files


def _note(text: str) -> None:
    print(f"cosim-master: {text}", file=sys.stderr)


def _page(folder: Path, display: DisplayUnits, result: Result | None = None) -> list[str]:
    """The name of the page, once it is written; what keeps it from that is told, for the run itself is done.

    result: of the run whose page it is to be, where it has one.
    """
    from .page.write import write_page
    from .simulation.run_folder import held_again

    try:
        with held_again(folder, result.summary) if result is not None else nullcontext():
            return [write_page(folder, display).name]
    except CosimError as error:
        print(f"cosim-master: results.html was not written: {error}", file=sys.stderr)
        return []


def _on_hang(error: CosimError) -> NoReturn:
    """The run was asked to end, and an FMU does not come back to let it; or one ends this process."""
    from ..core.errors import Interrupted
    from ..core.guardian import tell

    by_user = isinstance(error, Interrupted)
    print(f"cosim-master: {'interrupted: ' if by_user else ''}{error}", file=sys.stderr, flush=True)
    ending.put_away()
    tell.finished()
    os._exit(ending.code() if by_user else 1)


def _unasked(what: str, results: list[str], time: float | None) -> str:
    """The line about a run that ended without a word; its summary is written, where there is none."""
    from .simulation.run_folder import last_time, write_summary

    folder, file = Path(results[0]), results[1]
    kept = ""
    if results[0] and folder.is_dir() and not (folder / "summary.json").exists():
        written = last_time(folder / file) if file.endswith(".csv") else None
        kept = f"; what was recorded up to t = {written:g} s is kept" if written is not None else ""
        with suppress(CosimError):
            write_summary(folder, {"status": "failed", "error": what, "stop_time_s": time, "warnings": []})
    hint = "; --isolate says which" if "component" not in what else "; --isolate keeps the others from it"
    return f"{what}{kept}{hint}"


def command() -> NoReturn:
    """The console script."""
    end_with(lambda: guarded("cosim-master", main, _unasked))


if __name__ == "__main__":
    command()
