"""What each part of the search is good for: the cases of a folder diagnosed without it, and scored.

    python -m benchmarks.blind.ablation DIR [--cases 12] [--only relatives,curves] [--processes 2]

A part is a name for stages of the pipeline, which are left out; nothing else changes. Diagnoses stand in
DIR/without/PART, those of the whole in DIR/diagnoses, so what `benchmarks.blind.run` has made is not made again, and
this goes on where it was stopped. For development cases: on those of a report it says nothing that may be acted on.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .records import Record, load
from .run import ALONE, TIMEOUT, cases_in, default_command, diagnose
from .scoring.outcome import outcomes
from .scoring.table import score

ROOT = Path(__file__).parents[2]

WHOLE = "whole"
PARTS = {
    WHOLE: (),
    "swings": ("what swings",),
    "relatives": ("trying similar effects in place of those found",),
    "forms": ("trying other forms of the effects found", "trying other forms of the effects found, again"),
    "curves": ("trying free curves for the effects found",),
    "rounds": ("comparing sets around the best", "comparing sets from elsewhere", "comparing sets once more"),
    "shorter_steps": ("effects that need shorter steps",),
}
"""Names of stages by part."""

COLUMNS = ("without", "cases", "recall", "precision", "exact", "left [noise]", "seconds")


def left_out(pipeline: Sequence[Any], names: Sequence[str]) -> tuple[Any, ...]:
    """The stages without those of these names, each of which has to be there."""
    if missing := sorted(set(names) - {stage.name for stage in pipeline}):
        raise ValueError(f"no stage is called {', '.join(missing)}")
    return tuple(stage for stage in pipeline if stage.name not in names)


def one(part: str, arguments: list[str]) -> int:
    """A diagnosis without a part, in this process."""
    module = import_module("deepsea_cosim.gap.diagnose")
    module.PIPELINE = left_out(module.PIPELINE, PARTS[part])  # type: ignore[attr-defined]
    return int(import_module("deepsea_cosim.gap.cli").main(arguments))


def command(folder: Path, part: str) -> str:
    """A program that is called like `cosim-gap` and leaves the part out."""
    if part == WHOLE:
        return default_command()
    path = folder / "without" / part / "cosim-gap"
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [
        f"#!{sys.executable}", "import sys", f"sys.path.insert(0, {str(ROOT)!r})", "if __name__ == '__main__':",
        "    from benchmarks.blind.ablation import one", f"    sys.exit(one({part!r}, sys.argv[1:]))",
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def place(folder: Path, part: str) -> Path:
    """Where the diagnoses without a part stand."""
    return folder / "diagnoses" if part == WHOLE else folder / "without" / part


def row(part: str, cases: Sequence[Record]) -> tuple[str, ...]:
    """A line of the table, of those cases."""
    found = outcomes(cases)
    result = score(found)
    left = [o.said.left for o in found if o.said.left == o.said.left]
    exact = sum(o.exact for o in found)

    def ratio(key: str) -> str:
        return f"{result[key]['hits']} of {result[key]['of']}"

    seconds = result["finished_s"]
    return (
        part, str(len(cases)), ratio("recall"), ratio("precision"), f"{exact} of {len(cases)}",
        f"{np.mean(left):.2f}" if left else "-", f"{seconds[0]:.0f}" if seconds else "-",
    )  # fmt: skip


def table(folder: Path, parts: Sequence[str]) -> list[tuple[str, ...]]:
    """A line a part, over the cases that are diagnosed with each of them."""
    made = {part: {r.name: r for r in load(folder, place(folder, part))} for part in parts}
    common = sorted(set.intersection(*(set(records) for records in made.values())))
    return [COLUMNS, *(row(part, [made[part][name] for name in common]) for part in parts)] if common else []


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.ablation", description="Diagnoses without parts of the search.")
    p.add_argument("folder", type=Path, help="folder of the cases, with their answers")
    p.add_argument("--cases", type=int, help="only the first so many")
    p.add_argument("--only", default=",".join(PARTS), help="parts to leave out, by commas (default: each in turn)")
    p.add_argument("--processes", type=int, default=2, help="cases at the same time")
    p.add_argument("--timeout", type=float, default=TIMEOUT, help="longest time for one diagnosis, s")
    options = p.parse_args()
    parts = list(dict.fromkeys([WHOLE, *options.only.split(",")]))
    if unknown := sorted(set(parts) - set(PARTS)):
        p.error(f"--only: no part '{unknown[0]}'; there are {', '.join(PARTS)}")
    cases = cases_in(options.folder, options.cases)
    todo = [
        (part, case) for case in cases for part in parts
        if not (place(options.folder, part) / case.name / "diagnosis.json").exists()
    ]  # fmt: skip
    programs = {part: command(options.folder, part) for part in parts}

    def work(job: tuple[str, Path]) -> str:
        part, case = job
        out = place(options.folder, part) / case.name
        _, seconds, fault = diagnose([programs[part], *ALONE], case, out, options.timeout)
        return f"{case.name} without {part}: {fault or f'{seconds:.0f} s'}"

    with ThreadPoolExecutor(options.processes) as pool:
        for k, text in enumerate(pool.map(work, todo), 1):
            print(f"{text}   [{k}/{len(todo)}]", flush=True)
    for line in table(options.folder, parts):
        print(" | ".join(line))


if __name__ == "__main__":
    main()
