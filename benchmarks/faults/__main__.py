"""The command."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

from benchmarks import native

from . import __doc__ as about
from .commands import commands
from .strike import FAULTS, Trial


def main() -> int:
    p = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=about,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("--only", default="", help="commands (default: all)")
    p.add_argument("--faults", default=",".join(FAULTS))
    p.add_argument("--trials", type=int, default=40, help="of each fault and command (default: 40)")
    p.add_argument("--seed", type=int, default=0)
    options = p.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="faults_") as name:
        folder = Path(name)
        clock = native.compiled(Path(__file__).with_name("clock.c"), 2, folder / "clock.so", "-ldl")
        known = commands(folder)
        for chosen in options.only.split(",") if options.only else known:
            trial = Trial(known[chosen], folder / "trial", clock)
            usual = trial.usual()
            for fault in options.faults.split(","):
                chance, found = random.Random(f"{options.seed} {chosen} {fault}"), Counter[str]()
                for number in range(options.trials):
                    state, said = trial.struck(fault, usual, chance)
                    found["wrong" if said else state] += 1
                    if said:
                        print(f"  {chosen}, {fault}, trial {number}: {said}", flush=True)
                wrong += found["wrong"]
                shares = ", ".join(f"{found[kind]} {kind}" for kind in ("old", "new", "part", "wrong") if found[kind])
                print(f"{chosen:<10}{fault:<10}{options.trials:>5} tried: {shares}", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
