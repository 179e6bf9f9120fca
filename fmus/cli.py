"""The command cosim-fmus: build the FMUs and scenarios, check an FMU."""

from __future__ import annotations

import argparse
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

from ..core.cli import OneLineParser
from ..core.errors import CosimError

EXAMPLES = """examples:
  cosim-fmus build --out build
  cosim-fmus check build/DeepseaArm.fmu
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-fmus",
        description="Build the project's FMUs and pack the scenarios; check FMUs.",
        epilog=EXAMPLES,
    )
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    build = commands.add_parser("build", help="build both FMUs and pack every scenario as an .ssp")
    build.add_argument("--out", metavar="DIR", type=Path, default=Path("build"), help="folder (default: build)")
    build.add_argument("--quiet", action="store_true", help="print nothing but errors")
    check = commands.add_parser("check", help="validate FMUs, load, initialise and step them")
    check.add_argument("fmu", metavar="FILE.fmu", type=Path, nargs="+")
    return p


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code: 0 done, 1 a check found problems, 2 bad input."""
    options = parser().parse_args(arguments)
    try:
        return _build(options) if options.command == "build" else _check(options)
    except CosimError as error:
        print(f"cosim-fmus: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("cosim-fmus: interrupted", file=sys.stderr)
        return 130


def _build(options: argparse.Namespace) -> int:
    from .build import build

    build(options.out, (lambda text: None) if options.quiet else lambda text: print(f"  {text}", flush=True))
    return 0


def _check(options: argparse.Namespace) -> int:
    from .check import exercise, problems

    worst = 0
    for fmu in options.fmu:
        try:
            found = problems(fmu)
        except zipfile.BadZipFile:
            found = ["not a zip archive or damaged"]
        if not found:
            try:
                exercise(fmu)
            except Exception as error:
                found = [f"does not run: {error}"]
        for problem in found:
            print(f"{fmu}: {problem}")
        if not found:
            print(f"{fmu}: no problems found")
        worst = worst or int(bool(found))
    return worst


if __name__ == "__main__":
    sys.exit(main())
