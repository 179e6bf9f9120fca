"""The command `python -m deepsea_cosim.study.calibrate --global`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ...core.files import make_folder
from ...hydraulics_fmu.variables import HYDRAULICS
from .buildable import shipped
from .machine import Machine
from .report import Row, depending, markdown, write
from .search import WITHIN, as_calibration, calibrations, distinct


def global_command(options: argparse.Namespace) -> int:
    """Search, judge what differs, write and print the set; returns the exit code."""
    folder: Path = options.out
    make_folder(folder)
    package = options.package or _built(folder)
    with Machine(package, folder) as machine, _bar(options.quiet) as bar:

        def tell(what: str) -> None:
            bar.set_description(what, refresh=False)
            bar.update(machine.simulated - bar.n)

        ours = as_calibration(machine, shipped(float(HYDRAULICS.parameters({})["valve.lam_crit"])))
        found = calibrations(machine, options.samples, options.fits, options.seed, tell)
        found.sort(key=lambda c: c.linkage.lam_crit)
        taken = distinct(found, [found[0], found[-1]] if len(found) > 1 else found, options.most)
        taken.sort(key=lambda c: c.linkage.lam_crit)
        named = [("shipped", ours), *((str(k + 1), c) for k, c in enumerate(taken))]
        rows = []
        for name, c in named:
            tell(f"claims of {name} of {len(taken)}")
            rows.append(Row(name, c, machine.claims(c.linkage)))
        settings = {"within": WITHIN, "samples": options.samples, "fits": options.fits, "seed": options.seed,
                    "found": len(found)}  # fmt: skip
    write(folder, rows, settings)
    if not options.quiet:
        _print(rows, len(found))
        print(f"\n{folder}: calibrations.csv, calibrations.json")
    return 0


def _built(folder: Path) -> Path:
    from ...fmus.build import build

    build(folder / "package")
    return folder / "package" / "deepsea_11km.ssp"


def _bar(quiet: bool) -> Any:
    from tqdm import tqdm

    return tqdm(unit="run", disable=quiet or None, file=sys.stderr)  # None: not into a file


def _print(rows: list[Row], count: int) -> None:
    print(f"{count} calibrations have all four times within {WITHIN:g} %; the shipped and {len(rows) - 1} that differ:")
    print()
    print(markdown(rows))
    lam = [r.calibration.linkage.lam_crit for r in rows[1:]]
    held = [sum(r.claims.values()) for r in rows if r.claims is not None]
    if lam and held:
        print(f"\nlam_crit from {min(lam):.0f} to {max(lam):.0f}; {min(held)} to {max(held)} claims hold")
    print("\nclaims that hold with some of them and not with others:")
    for claim, names in depending(rows).items():
        print(f"  {claim}: with {', '.join(names)}")
