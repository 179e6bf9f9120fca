"""The command cosim-fmus: build the FMUs and scenarios, check an FMU."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..core.cli import OneLineParser, add_version, exit_code, folder
from ..core.console import add_output, conclude, on_the_way

EXAMPLES = """examples:
  cosim-fmus build --out build
  cosim-fmus build --out build --portable
  cosim-fmus container build/deepsea_11km.ssp --out build
  cosim-fmus machine examples/machine.toml --out build
  cosim-fmus arm examples/boom_and_stick/arm.xml --out build
  cosim-fmus forms --out .                                   # ready effects, to import in an FMU script of yours
  cosim-fmus check build/DeepseaArm.fmu
  cosim-fmus cross-check build/DeepseaArm.fmu build/DeepseaHydraulics.fmu

exit codes: 0 done, 1 a check found something wrong, 2 bad input, 130 interrupted (143 by SIGTERM, 129 by SIGHUP)
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-fmus",
        description="Build the project's FMUs and pack the scenarios; check FMUs.",
        epilog=EXAMPLES,
    )
    add_version(p)
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    build = commands.add_parser("build", help="build the FMUs and pack every scenario as an .ssp")
    build.add_argument("--out", metavar="DIR", type=folder, default=Path("build"), help="folder (default: build)")
    _ways(build)
    add_output(build)
    own = commands.add_parser("machine", help="make scenarios of your own machine from its data sheet")
    own.add_argument("sheet", metavar="MACHINE.toml", type=Path, help="bore, rod, stroke, valve, pump, lines, oil, arm")
    own.add_argument("--out", metavar="DIR", type=folder, default=Path("build"), help="folder (default: build)")
    add_output(own)
    schema = commands.add_parser("schema", help="write a JSON schema of machine.toml, for editors")
    schema.add_argument("--out", metavar="DIR", type=folder, default=Path(), help="folder of the file (default: this)")
    add_output(schema)
    arm = commands.add_parser("arm", help="make an FMU of your own arm from an MJCF model")
    arm.add_argument(
        "model", metavar="ARM.xml", type=Path,
        help="its tendons are the cylinders that move it; PACKAGE:ARM.xml is one in a Python package",
    )  # fmt: skip
    arm.add_argument(
        "--cylinders", metavar="TABLE.toml", type=Path,
        help="which tendons are cylinders, or where some are put; what is held or left out (default: all tendons)",
    )  # fmt: skip
    arm.add_argument("--out", metavar="DIR", type=folder, default=Path("build"), help="folder (default: build)")
    arm.add_argument("--name", default="", help="of the FMU (default: the file's)")
    arm.add_argument("--pose", metavar="KEY", default="", help="keyframe in which it starts (default: the first pose)")
    water = arm.add_mutually_exclusive_group()
    water.add_argument("--water", metavar="TABLE.toml", type=Path, help="which geoms are in the water (default: all)")
    water.add_argument("--dry", action="store_true", help="none are")
    _ways(arm)
    add_output(arm)
    one = commands.add_parser("container", help="build one FMU of a scenario: hydraulics and arm coupled")
    one.add_argument("package", metavar="SCENARIO.ssp", type=Path, help="a built scenario")
    one.add_argument("--out", metavar="DIR", type=folder, default=Path("build"), help="folder (default: build)")
    _ways(one)
    add_output(one)
    forms = commands.add_parser("forms", help="put effect_forms.py beside an FMU script of yours: ready effects")
    forms.add_argument("--out", metavar="DIR", type=folder, default=Path(), help="folder of the script (default: this)")
    add_output(forms)
    cross = commands.add_parser("cross-check", help="run the FMUs through several importers and compare")
    cross.add_argument("fmu", metavar="FILE.fmu", type=Path, nargs="+", help="FMUs of this project")
    cross.add_argument("--out", metavar="DIR", type=folder, default=Path("cross-check"), help="default: cross-check")
    add_output(cross)
    check = commands.add_parser("check", help="validate FMUs, load, initialise and step them")
    check.add_argument("fmu", metavar="FILE.fmu", type=Path, nargs="+", help="any FMUs")
    add_output(check)
    return p


def _ways(p: argparse.ArgumentParser) -> None:
    p.add_argument(
        "--portable", action="store_true",
        help="for importers that are not Python too: the FMU remembers this interpreter",
    )  # fmt: skip
    p.add_argument("--standalone", action="store_true", help="for machines without Python: the FMU carries one")
    p.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="FMI version (default: 2)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code: 0 done, 1 a check found problems, 2 bad input."""
    options = parser().parse_args(arguments)
    commands = {
        "build": _build, "machine": _machine, "arm": _arm, "container": _container, "check": _check,
        "cross-check": _cross_check, "forms": _forms, "schema": _schema,
    }  # fmt: skip
    return exit_code("cosim-fmus", lambda: commands[options.command](options), as_json=options.json)


def _build(options: argparse.Namespace) -> int:
    from .build import Way, build

    made = build(options.out, on_the_way(options), Way(options.portable, options.standalone, options.fmi))
    conclude(options, lambda: {"files": made}, tuple)
    return 0


def _machine(options: argparse.Namespace) -> int:
    from .own_machine import build_machine

    made = build_machine(options.sheet, options.out, on_the_way(options))
    conclude(options, lambda: {"files": made}, tuple)
    return 0


def _arm(options: argparse.Namespace) -> int:
    from .build import Way
    from .build_arm import build_arm

    way = Way(options.portable, options.standalone, options.fmi)
    made = build_arm(
        options.model, options.out, options.water, options.dry, options.name, options.pose, on_the_way(options), way,
        options.cylinders,
    )  # fmt: skip
    conclude(options, lambda: {"files": [made]}, tuple)
    return 0


def _forms(options: argparse.Namespace) -> int:
    from .effect_forms_file import write

    made = write(options.out)
    remark = f"  {made}: import it in the script and build the FMU with it as a project file"
    conclude(options, lambda: {"files": [made]}, lambda: [remark])
    return 0


def _schema(options: argparse.Namespace) -> int:
    from ..core.json_schema import reference, write_schema
    from .machine_schema import NAME, machine_schema

    made = write_schema(options.out, NAME, machine_schema())
    remark = f"  {made}: editors take it from the first line {reference(NAME)}"
    conclude(options, lambda: {"files": [made]}, lambda: [remark])
    return 0


def _container(options: argparse.Namespace) -> int:
    from .build import Way
    from .container import container

    way = Way(options.portable, options.standalone, options.fmi)
    made = container(options.package, options.out, on_the_way(options), way)
    conclude(options, lambda: {"files": [made]}, lambda: [str(made)])
    return 0


def _check(options: argparse.Namespace) -> int:
    from .check import faults

    found = {fmu: faults(fmu) for fmu in options.fmu}

    def lines() -> Iterator[str]:
        for fmu, problems in found.items():
            yield from (f"{fmu}: {problem}" for problem in problems or ["no problems found"])

    conclude(options, lambda: {"problems": found}, lines)
    return int(any(found.values()))


def _cross_check(options: argparse.Namespace) -> int:
    from ..core.files import write_together
    from .cross_check import cross_check, summary, table

    found = cross_check(options.fmu, options.out)
    text = table(found)
    write_together(options.out, {"cross-check.md": text + "\n"})
    conclude(
        options, lambda: {"folder": options.out, "fmus": summary(found)},
        lambda: [text, "", f"files in {options.out}"],
    )  # fmt: skip
    return 0 if all(o.absent or o.agrees for outcomes in found.values() for o in outcomes.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
