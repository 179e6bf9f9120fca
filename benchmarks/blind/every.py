"""Makes a case for every row that no edition before the third had, to see which of them a diagnosis finds.

    python -m benchmarks.blind.every --seed 1 --out DIR --package build/deepsea_0km.ssp

Conditions, channels, shapes and sizes (3 to 12 noise floors, evenly on a logarithmic scale) are drawn from the seed and
the row's place; a sensor's error is the position's. Then `run` and `score` as for any cases; `--of FILE` prints a line
a row from what `score --csv` wrote.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from .case import Case, Wrong
from .draw import plan
from .effects import LEARNT, NEW, NEW_SENSORS, Effect
from .generate import write
from .plant import PlantError
from .ruler import Ruler

EDITION = 3
SMALL, LARGE = 3.0, 12.0
"""Sizes [noise], beyond a linear refit."""
TRIED = 240
"""Plans of cases among which one is looked for that has two runs, four channels and shows the row."""


def rows() -> tuple[Effect, ...]:
    """The rows, in the order of their cases."""
    return tuple(e for e in (*NEW, *LEARNT, *NEW_SENSORS) if e.drawn)


def case_of_row(seed: int, place: int) -> Case | None:
    """The case of the row at that place; None where it cannot be seen in any of the conditions tried."""
    effect = rows()[place]
    for index in range(1000 * place, 1000 * place + TRIED):
        case, rng = plan(seed, index, EDITION)
        if len(case.runs) != 2 or len(case.channels) < 4:
            continue
        wanted = float(np.exp(rng.uniform(np.log(SMALL), np.log(LARGE))))
        column = "x_h" if effect in NEW_SENSORS else None
        trial = Wrong(effect, effect.draw_sign(rng), effect.draw_shapes(rng), 0.0, column)
        try:
            scaled = Ruler(case).scaled(trial, wanted)
        except PlantError:
            scaled = None
        if scaled is not None and scaled.size_linear > 0.5 * wanted:
            scaled = replace(scaled, size=scaled.size_linear)
            return replace(case, index=place, kind="single", wrong=(scaled,), size_all=scaled.size)
    return None


def found(table: Path) -> str:
    """A line a row: its size, what was said, whether it was found, exactly or up to its group."""
    lines = []
    with table.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            hit = "found" if row["missed"] == "0" else "missed"
            exact = " by name" if row["true"].split("@")[0] in row["said"].replace("|", " ").split() else ""
            lines.append(f"{row['true']:<28}{float(row['size']):6.1f}  {hit + exact:<15} {row['said'] or '-'}")
    return "\n".join(lines)


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.every", description="A case for every new row.")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--out", type=Path, help="folder of the cases")
    p.add_argument("--package", type=Path, help="the package that the diagnosis compares with")
    p.add_argument("--of", type=Path, metavar="FILE", help="print a line a row from a table of `score --csv`")
    options = p.parse_args()
    if options.of:
        print(found(options.of))
        return
    if options.out is None or options.package is None:
        p.error("--out and --package are needed, or --of")
    options.out.mkdir(parents=True, exist_ok=True)
    for place, effect in enumerate(rows()):
        if (options.out / f"case_{place:04d}" / "campaign.toml").exists():
            continue
        case = case_of_row(options.seed, place)
        if case is None:
            print(f"{effect.id}: cannot be seen", flush=True)
            continue
        write(case, options.out, options.package.resolve(), budget=False)
        print(f"case_{place:04d}  {effect.id} ({case.wrong[0].size:.2g})", flush=True)


if __name__ == "__main__":
    main()
