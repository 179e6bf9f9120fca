"""Campaigns of the measured data: FMU, package, catalogue, run files and campaign.toml of each.

    python -m benchmarks.real.campaigns --data DATA_FOLDER --out FOLDER [NAME ...]

Then `cosim-gap diagnose FOLDER/NAME/campaign.toml --out ...`. Without names all of them are made whose data are there
(`benchmarks.real.fetch` gets what may be had).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from . import cascaded_tanks, mr_damper, piston_seal, servo_cylinder, servo_joint, silverbox
from .package import Measured, write

NAMES: dict[str, Callable[[Path], Measured]] = {
    module.__name__.rpartition(".")[2]: module.measured
    for module in (servo_cylinder, piston_seal, silverbox, cascaded_tanks, servo_joint, mr_damper)
}


def make(name: str, data: Path, out: Path) -> Path:
    """Make the campaign of that name in out/name; returns its campaign.toml."""
    return write(NAMES[name](data), out / name)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    p = argparse.ArgumentParser(prog="benchmarks.real.campaigns", description=__doc__.splitlines()[0])
    p.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}; without, all that have data")
    p.add_argument("--data", type=Path, required=True, help="folder with the measured data")
    p.add_argument("--out", type=Path, required=True, help="folder for the campaigns")
    options = p.parse_args(arguments)
    for name in options.names or NAMES:
        if name not in NAMES:
            p.error(f"no campaign '{name}'; there are {', '.join(NAMES)}")
    made = 0
    for name in options.names or NAMES:
        try:
            print(make(name, options.data, options.out))
            made += 1
        except FileNotFoundError as error:
            print(f"{name}: {error.filename}: no such file", file=sys.stderr)
            if options.names:
                return 2
    return 0 if made else 2


if __name__ == "__main__":
    sys.exit(main())
