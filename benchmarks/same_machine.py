"""Whether the hydraulics of two commits are the same, bit for bit, and how long a step of each takes.

    python -m benchmarks.same_machine --before COMMIT [--pairs 5]

The plain machine at three depths and every effect on its own, all its parameters that both commits know moved
from neutral, follow a rod that moves as told for some seconds; every output of every step counts that both have. Prints
what differs, and with --pairs the time of a step after over that before, of runs that take turns. Exit code 1 when
anything differs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).parents[1]
STEP, STOP = 1e-3, 4.0
"""Macro step and end of a run [s]."""
BLOCKS = 30
"""Runs of which the quickest is told."""
MOVED = 0.05
"""How far an effect's parameter is moved from its start value, as a share of the way to the end of its range."""
COMMAND = {"command.t_start": 0.3, "command.ramp_time": 1.2, "command.hold_time": 0.7, "command.target": 0.1}
PLAIN = {"plain, 0 km": 0.0, "plain, 3 km": 3000.0, "plain, 11 km": 11000.0}


def cases(known: Collection[str]) -> dict[str, dict[str, float]]:
    """Parameters that differ from their start values, by name of the case; of the effects' only known ones."""
    from deepsea_cosim.hydraulics_fmu.variables import EFFECTS

    made = {name: {**COMMAND, "depth": depth} for name, depth in PLAIN.items()}
    for v in (v for v in EFFECTS if v.name in known):
        effect = v.name.split(".")[1]
        end = v.max if v.max > v.start else v.min
        made.setdefault(effect, {**COMMAND, "depth": 3000.0})[v.name] = v.start + MOVED * (end - v.start)
    together = {name: value for name, value in made.items() if name not in PLAIN}
    for k in range(3):  # effects that meet: every third one
        made[f"together {k + 1}"] = {n: v for own in list(together.values())[k::3] for n, v in own.items()}
    return made


def outputs(changes: Mapping[str, float], names: Collection[str] = ()) -> np.ndarray:
    """The FMU's outputs of these names, or all, at every step (steps, outputs) while the rod moves to and fro."""
    from deepsea_cosim.hydraulics_fmu import stepping
    from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS

    row, _ = stepping.initial_row(HYDRAULICS.parameters(dict(changes)), 6632.0)
    values = np.zeros(len(HYDRAULICS))
    at = (values.ctypes.data, len(values), row.ctypes.data, len(row))
    made = np.empty((round(STOP / STEP), stepping.BEHIND - stepping.FIRST))
    for k in range(len(made)):
        t = k * STEP
        values[stepping.X_H], values[stepping.V_H] = 0.05 * (1.0 - math.cos(2.0 * t)), 0.1 * math.sin(2.0 * t)
        while (code := stepping.advance(*at, t, STEP)) not in (0, *stepping.FAULTS):
            pass  # a word to be said, once each, before the step
        if code != 0:
            raise SystemExit(f"{changes}: step at {t:g} s ended with code {code}")
        made[k] = values[stepping.FIRST : stepping.BEHIND]
    own = [v.name for v in HYDRAULICS.of("output")]
    return np.ascontiguousarray(made[:, [own.index(name) for name in names or own]])


def run(wanted: str, known: Collection[str]) -> dict[str, object]:
    """The effects' parameters, digests of all cases, or the least time of a plain step [s]."""
    if wanted == "names":
        from deepsea_cosim.hydraulics_fmu.variables import EFFECTS, HYDRAULICS

        return {v.name: v.start for v in (*EFFECTS, *HYDRAULICS.of("output"))}
    if wanted == "time":
        taken = []
        for _ in range(BLOCKS):  # the shortest is the one that nothing else has disturbed
            begin = time.perf_counter()
            outputs({**COMMAND, "depth": 3000.0})
            taken.append(time.perf_counter() - begin)
        return {"step": min(taken) / (STOP / STEP)}
    told = [name for name in known if not name.startswith("effect.")]
    return {n: hashlib.sha256(outputs(changes, told).tobytes()).hexdigest() for n, changes in cases(known).items()}


def compare(before: str, pairs: int) -> int:
    """Run both, print what differs; returns the exit code."""
    from .same_diagnoses import commits

    with tempfile.TemporaryDirectory() as text:
        scratch = Path(text)
        old, new = commits.before_and_now(REPOSITORY, before, scratch)

        def ask(code: commits.Code, wanted: str, known: Collection[str] = ()) -> dict[str, object]:
            command = [sys.executable, str(Path(__file__)), "--run", wanted, "--known", *known]
            compiled = {"NUMBA_CACHE_DIR": str(code.folder / "kernels")}  # none that an earlier source was made into
            environment = {**code.environment, **compiled}
            done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
            answer: dict[str, object] = json.loads(done.stdout)
            return answer

        known = sorted(set(ask(old, "names")) & set(ask(new, "names")))
        one, two = ask(old, "digests", known), ask(new, "digests", known)
        differing = [name for name in {**one, **two} if one.get(name) != two.get(name)]
        for name in differing:
            print(f"{name}: {'differs' if name in one and name in two else 'only in one of them'}")
        same = f"{len(one) - len(differing)} of {len(one)} cases identical"
        print(f"{same}: {old.name} and {new.name}")
        if pairs:
            ratios = [float(ask(new, "time")["step"]) / float(ask(old, "time")["step"]) for _ in range(pairs)]
            print(f"a plain step takes {commits.spread(ratios)}")
    return 1 if differing else 0


def main() -> int:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.same_machine", description=__doc__.splitlines()[0])
    p.add_argument("--before", metavar="COMMIT", help="the commit that is right; held against the working tree")
    p.add_argument("--pairs", type=int, default=0, help="runs of each that are timed in turns")
    p.add_argument("--run", choices=("names", "digests", "time"), help=argparse.SUPPRESS)
    p.add_argument("--known", nargs="*", default=(), help=argparse.SUPPRESS)
    options = p.parse_args()
    if options.run:
        print(json.dumps(run(options.run, options.known)))
        return 0
    if options.before is None:
        p.error("--before COMMIT is missing")
    return compare(options.before, options.pairs)


if __name__ == "__main__":
    sys.exit(main())
