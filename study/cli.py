"""The command cosim-study. Everything heavy is imported only when it is needed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ..core.cli import OneLineParser, add_processes, add_version, decimal, exit_code, file, folder, natural, seconds
from ..core.console import add_output
from ..master.algorithms import DEFAULT, NAMES

EXAMPLES = """examples:
  cosim-study paper --out results/paper
  cosim-study sweep build/deepsea_11km.ssp --vary depth=0:11000:500 --vary line.diameter=0.0035,0.004,0.005 \\
      --metric 'extension=reaches(arm.x_h, 0.2, 0.001, 2)' --metric 'max(hydraulics.P1)' --out results/depth
  cosim-study envelope build/deepsea_11km.ssp --at 11000
  cosim-study sweep plant.ssp --vary body.m=1:5 --vary spring.k=100:400 --sample sobol:256

exit codes: 0 done (failed cases are listed), 1 the simulation had to stop or every case failed, 2 bad input,
130 interrupted, 143 by SIGTERM, 129 by SIGHUP (what a sweep or an envelope has done is kept)
"""

PAPER_EXAMPLES = """examples:
  cosim-study paper
  cosim-study paper --package build/deepsea_11km.ssp --out runs/paper --processes 4
"""

ENVELOPE_EXAMPLES = """examples:
  cosim-study envelope build/deepsea_11km.ssp
  cosim-study envelope build/deepsea_11km.ssp --at 9000 --set arm.load_weight=1000
  cosim-study envelope plant.ssp --options changes.toml --out runs/plant
"""

SWEEP_EXAMPLES = """examples:
  cosim-study sweep deepsea_11km.ssp --vary depth=0:11000:500 --metric 'late=reaches(arm.x_h, 0.2, 0.001, 2)'
  cosim-study sweep plant.ssp --vary body.m=1:5 --vary spring.k=100:400 --sample lhs:200 --case-time 60

"""

METRICS = """metrics, each label=function(connector, numbers) or without the label:
  initial  final  min  max  mean  rms  range  integral     of the signal
  at(x, t)                                                 value at t [s]
  reaches(x, target, within, after)                        time from `after` until x is within `within` of `target`
  settles(x, target, within, after, until)                 time from `after` until x has come to stay there
  above(x, level)                                          time above the level [s]
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-study",
        description="The paper's study as code; many runs of a package: sweeps, samples, and what they say.",
        epilog=EXAMPLES,
    )
    add_version(p)
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    w = commands.add_parser("paper", help="recompute everything that the source paper shows", epilog=PAPER_EXAMPLES)
    w.add_argument("--out", type=folder, metavar="DIR", default=Path("results/paper"), help="default: results/paper")
    w.add_argument("--package", type=Path, metavar="deepsea_11km.ssp", help="a built scenario (default: build one)")
    add_processes(w, dask=False)
    add_output(w)
    s = commands.add_parser(
        "sweep", help="run a package over a grid or a sample of its parameters", epilog=SWEEP_EXAMPLES + METRICS
    )  # fmt: skip
    s.add_argument("package", metavar="SCENARIO.ssp", type=file, help="any SSP package")
    s.add_argument("--vary", metavar="NAME=SPEC", action="append", default=[],
                   help="1,2,3 or start:stop:step, or low:high with --sample; units may stand behind: 3:6:1mm; "
                   "may be repeated")  # fmt: skip
    s.add_argument("--sample", metavar="KIND:N",
                   help="sobol:N, lhs:N or saltelli:N (for Sobol indices) instead of a grid")  # fmt: skip
    s.add_argument("--metric", metavar="EXPR", action="append", default=[],
                   help="what is measured of a run; default: final, min and max of every connected output")  # fmt: skip
    s.add_argument("--set", metavar="NAME=VALUE", action="append", default=[], help="a parameter for all cases")
    s.add_argument("--stimuli", type=Path, metavar="FILE.csv",
                   help="series for the system's inputs in all cases: time, and a column an input")  # fmt: skip
    s.add_argument("--step", type=decimal, metavar="S", help="macro step [s] (default: the package's)")
    s.add_argument("--stop-time", type=decimal, metavar="S", help="end of the runs [s] (default: the package's)")
    s.add_argument("--method", choices=NAMES, help=f"coupling: %(choices)s (default: the package's, else {DEFAULT})")
    s.add_argument("--out", type=folder, metavar="DIR", help="folder for the results (default: results/sweep_NAME)")
    add_processes(s)
    s.add_argument("--seed", type=natural, default=0, help="of the sample (default 0)")
    s.add_argument("--case-time", type=seconds, metavar="S",
                   help="longest wall time of a case [s], not with --dask; what takes longer has failed")  # fmt: skip
    s.add_argument("--retry-failed", action="store_true", help="run cases that failed earlier once more")
    s.add_argument("--units", metavar="LIST", help="what the text and the pictures show, as of cosim-master; files "
                   "keep the FMUs' units")  # fmt: skip
    s.add_argument("--no-plots", action="store_true", help="no pictures")
    add_output(s)
    e = commands.add_parser(
        "envelope", help="how far each design goes, and the cheapest change that goes further", epilog=ENVELOPE_EXAMPLES
    )
    e.add_argument("package", metavar="SCENARIO.ssp", type=file, help="a built scenario, or any with --options")
    e.add_argument("--options", type=Path, metavar="FILE.toml", help="requirements, choices and their costs (default: "
                   "the deep-sea machine's: depth without delay over lines, oil and valve)")  # fmt: skip
    e.add_argument(
        "--at", type=decimal, metavar="X", help="where the cheapest change has to hold (default: the far end)"
    )
    e.add_argument("--set", metavar="NAME=VALUE", action="append", default=[], help="a parameter for all runs")
    e.add_argument("--out", type=folder, metavar="DIR", help="folder for the results (default: results/envelope_NAME)")
    add_processes(e)
    e.add_argument("--no-plots", action="store_true", help="no picture")
    add_output(e)
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    kept = "; what is done is kept, the same command goes on" if options.command == "sweep" else ""
    return exit_code("cosim-study", lambda: _work(options), f"interrupted{kept}", options.json)


def _work(options: argparse.Namespace) -> int:
    if options.command == "paper":
        from .paper.terminal import paper_command as command
    elif options.command == "envelope":
        from .envelope.terminal import envelope_command as command
    else:
        from .sweep.terminal import sweep_command as command
    return command(options)


if __name__ == "__main__":
    sys.exit(main())
