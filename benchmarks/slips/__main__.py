"""Slips of whoever measures, in the pool test without its effect: does `cosim-gap check` tell each, in helpful words?

    python -m benchmarks.slips build/deepsea_0km.ssp [--only WORD]

Prints what was said of those that were not told, or of sound files that were; exit code 1 where there are any.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import tomllib
from pathlib import Path

import numpy as np
from deepsea_cosim.gap.cli import main as cosim_gap
from deepsea_cosim.gap.synthetic import make

from .slips import HEAD, SLIPS, Slip, Table

EXAMPLE = Path(__file__).parents[2] / "examples" / "pool_test" / "template.toml"
EFFECT = '"hydraulics.effect.line_minor_losses.K" = 120.0\n'


def measured(package: Path, folder: Path) -> Path:
    """The campaign of a machine that has no effect; in its folder the files to be spoilt."""
    text = EXAMPLE.read_text(encoding="utf-8").replace(EFFECT, "")
    system = tomllib.loads(text)["system"]
    template = folder / "template.toml"
    template.write_text(text.replace(system, package.resolve().as_posix()), encoding="utf-8")
    return make(template, folder / "measured")


def spoilt(slip: Slip, measured: Path, folder: Path) -> Path:
    """The campaign with that slip in it."""
    folder.mkdir()
    for run, change in slip.changes.items():
        table: Table = np.loadtxt(measured.parent / f"{run}.csv", delimiter=",", skiprows=1)
        rows = (",".join("" if np.isnan(x) else f"{x:.9g}" for x in row) for row in change(table))
        text = slip.text("\n".join([HEAD, *rows, ""]))
        (folder / f"{run}.csv").write_text(text, encoding="utf-8", newline="")
    first, second = slip.keys
    text = measured.read_text(encoding="utf-8")
    if first.endswith(".csv"):  # two files in each other's place
        text = text.replace(first, "\0").replace(second, first).replace("\0", second)
    else:
        text = text.replace(first, second, 1) if first else text
    campaign = folder / "campaign.toml"
    campaign.write_text(text, encoding="utf-8")
    return campaign


def said(campaign: Path) -> tuple[int, str]:
    """Exit code of the check, and what it says."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = cosim_gap(["check", str(campaign), "--out", str(campaign.parent)])
    return code, " ".join((out.getvalue() + error.getvalue()).split())


def main() -> int:
    """Command line."""
    p = argparse.ArgumentParser(prog="python -m benchmarks.slips", description=__doc__,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("package", type=Path, help="deepsea_0km.ssp")
    p.add_argument("--only", default="", help="slips whose name has this word")
    options = p.parse_args()
    missed, tried = 0, [slip for slip in SLIPS if options.only in slip.name]
    with tempfile.TemporaryDirectory(prefix="slips_") as name:
        sound = measured(options.package, Path(name))
        for k, slip in enumerate(tried):
            code, text = said(spoilt(slip, sound, Path(name) / str(k)))
            right = code == 0 if not slip.told else code != 0 and any(words in text for words in slip.told)
            missed += not right
            state = "WRONG" if not right else "told" if slip.told else "taken"
            print(f"{state}: {slip.name}{'' if right else f': {text}'}", flush=True)
    print(f"{len(tried)} slips and sound files, {missed} wrong")
    return int(missed > 0)


if __name__ == "__main__":
    raise SystemExit(main())
