"""The command cosim-gap. Everything heavy is imported only when it is needed."""

from __future__ import annotations

import argparse
import atexit
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ..core.cli import OneLineParser, add_processes, add_version, decimal, end_with, exit_code, folder, seconds
from ..core.console import add_output, conclude, on_the_way

EXAMPLES = """examples:
  cosim-gap new build/deepsea_11km.ssp data/*.csv --out campaign        # a campaign from files of your own
  cosim-gap check campaign/campaign.toml                                # what looks wrong in it, drawn
  cosim-gap effects build/deepsea_11km.ssp
  cosim-gap simulate template.toml --out campaign
  cosim-gap diagnose campaign/campaign.toml --out diagnosis
  cosim-gap diagnose campaign/campaign.toml --out diagnosis --resume    # after a stop, or with accept = [...]

exit codes: 0 done, 1 the simulation had to stop (check: something looks wrong), 2 bad input,
130 interrupted (143 by SIGTERM, 129 by SIGHUP)
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OneLineParser(
        prog="cosim-gap",
        description="Why does the machine not move like its model? Diagnosis, effects, synthetic campaigns.",
        epilog=EXAMPLES,
    )
    add_version(p)
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_onboarding(commands)
    schema = commands.add_parser("schema", help="write JSON schemas of campaign.toml and effects.toml, for editors")
    schema.add_argument("--out", metavar="DIR", type=folder, default=Path(), help="folder of the files (default: this)")
    add_output(schema)
    effects = commands.add_parser("effects", help="list the catalogue of effects of a package")
    effects.add_argument("package", metavar="SCENARIO.ssp", type=Path, help="a package with an effects.toml")
    effects.add_argument(
        "--rows", action="store_true",
        help="print an effects.toml instead, of the effects that the FMUs declare (docs/first-diagnosis.md)",
    )  # fmt: skip
    add_output(effects, quiet=False)
    simulate = commands.add_parser("simulate", help="make a synthetic campaign with effects switched on")
    simulate.add_argument("template", metavar="TEMPLATE.toml", type=Path, help="a campaign without data, and a [truth]")
    simulate.add_argument("--out", metavar="DIR", type=folder, required=True, help="folder for the campaign")
    add_output(simulate)
    diagnose = commands.add_parser("diagnose", help="say where the gap lies, what causes it, how far it shrinks")
    diagnose.add_argument("campaign", metavar="CAMPAIGN", type=Path, help="campaign.toml, or a .zip of `pack`")
    diagnose.add_argument(
        "--out", metavar="DIR", type=folder, required=True,
        help="folder for diagnosis.json, report.html and calibrated.ssv",
    )  # fmt: skip
    add_processes(diagnose)
    diagnose.add_argument(
        "--time-limit", metavar="SECONDS", type=seconds,
        help="judge what has been found after about this time, as the first Ctrl-C does (default: look everywhere)",
    )  # fmt: skip
    diagnose.add_argument(
        "--resume", metavar="DIR", type=folder, nargs="?", const=True,
        help="go on from an earlier diagnosis of the campaign, in that folder (default: that of --out); what `accept` "
             "takes as known is so answered quickly",
    )  # fmt: skip
    diagnose.add_argument("--no-report", action="store_true", help="no report.html")
    add_output(diagnose)
    return p


def _add_onboarding(commands: argparse._SubParsersAction[OneLineParser]) -> None:
    new = commands.add_parser("new", help="write a campaign from a package and run files")
    new.add_argument("package", metavar="PACKAGE", type=Path, help="the model: an .ssp, or an .fmu alone")
    new.add_argument("data", metavar="FILE", type=Path, nargs="+", help="a file for each run: CSV, .mat, TDMS, ...")
    new.add_argument("--out", metavar="DIR", type=folder, required=True, help="folder for campaign.toml")
    new.add_argument("--rate", metavar="HZ", type=_rate, help="samples a second of files that have no times")
    new.add_argument(
        "--tolerance", metavar="SHARE", type=_share,
        help="how well the model's parameters are known, as a share of their values: they are refitted within it",
    )  # fmt: skip
    new.add_argument("--ask", action="store_true", help="ask on the terminal for what could not be guessed")
    new.add_argument("--force", action="store_true", help="replace what is there, once the new file is complete")
    add_output(new)
    check = commands.add_parser("check", help="draw a campaign against the model and tell what looks wrong")
    check.add_argument("campaign", metavar="CAMPAIGN", type=Path, help="campaign.toml, or a .zip of `pack`")
    check.add_argument("--out", metavar="DIR", type=folder, help="folder for check.png (default: that of CAMPAIGN)")
    add_output(check, quiet=False)
    pack = commands.add_parser("pack", help="put a campaign with all that it needs into one file")
    pack.add_argument("campaign", metavar="CAMPAIGN.toml", type=Path, help="channels, runs and their files")
    pack.add_argument("--out", metavar="FILE.zip", type=Path, required=True, help="the file")
    pack.add_argument("--force", action="store_true", help="replace a file that is there")
    add_output(pack)


def _rate(text: str) -> float:
    value = decimal(text)
    if not 0.0 < value <= 1e9:
        raise argparse.ArgumentTypeError(f"{text}: samples a second lie between 0 and 1e9")
    return value


def _share(text: str) -> float:
    value = decimal(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"{text}: a share lies between 0 and 1")
    return value


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(arguments)
    commands = {
        "new": _new, "check": _check, "pack": _pack, "schema": _schema, "effects": _effects, "simulate": _simulate,
        "diagnose": _diagnose,
    }  # fmt: skip
    return exit_code("cosim-gap", lambda: commands[options.command](options), as_json=options.json)


def _new(options: argparse.Namespace) -> int:
    from .onboarding.new import new_command

    return new_command(options)


def _check(options: argparse.Namespace) -> int:
    from .onboarding.check import check_command

    return check_command(options)


def _pack(options: argparse.Namespace) -> int:
    from .onboarding.pack import pack_command

    return pack_command(options)


def _schema(options: argparse.Namespace) -> int:
    from ..core.json_schema import reference, write_schema
    from .campaign.keys import SCHEMAS

    made = {name: write_schema(options.out, name, schema) for name, schema in SCHEMAS.items()}
    conclude(
        options, lambda: {"files": list(made.values())},
        lambda: (f"  {path}: editors take it from the first line {reference(name)}" for name, path in made.items()),
    )  # fmt: skip
    return 0


def _effects(options: argparse.Namespace) -> int:
    if options.rows:
        from .onboarding.declared_effects import table_of

        rows = table_of(options.package)
        conclude(options, lambda: {"effects.toml": rows}, lambda: [rows.removesuffix("\n")])
        return 0
    from .effects_table import content, table

    conclude(options, lambda: content(options.package), lambda: table(options.package))
    return 0


def _simulate(options: argparse.Namespace) -> int:
    from .synthetic import make

    made = make(options.template, options.out, on_the_way(options))
    conclude(options, lambda: {"campaign": made}, tuple)
    return 0


def _diagnose(options: argparse.Namespace) -> int:
    from .terminal import diagnose_command

    return diagnose_command(options)


def command() -> NoReturn:
    """The console script."""
    end_with(main, _last)


def _last() -> None:
    atexit._run_exitfuncs()  # or the pool's semaphores are told to be lost


if __name__ == "__main__":
    command()
