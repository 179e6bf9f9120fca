"""The command."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from . import __doc__ as about
from .suite import Tally, run, table
from .targets import TARGETS


def main() -> int:
    p = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=about,
                                formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--mutants", type=int, default=500, metavar="N", help="of every target (default: 500)")
    p.add_argument("--hours", type=float, help="go on with further seeds for so long")
    p.add_argument("--only", default=",".join(TARGETS), help="targets (default: %(default)s)")
    p.add_argument("--out", type=Path, default=Path("build/fuzz"), help="for mutants that fail (default: %(default)s)")
    options = p.parse_args()
    begin, seed, total = time.monotonic(), options.seed, dict[str, Tally]()
    while True:
        for name in options.only.split(","):
            found = run(name, seed, options.mutants, options.out)
            total[name] = total[name] + found if name in total else found
            print(f"seed {seed}, {name}: {found}", file=sys.stderr, flush=True)
        seed += 1
        if options.hours is None or time.monotonic() - begin > 3600.0 * options.hours:
            break
    print(table(total))
    return int(any(t.failed for t in total.values()))


if __name__ == "__main__":
    sys.exit(main())
