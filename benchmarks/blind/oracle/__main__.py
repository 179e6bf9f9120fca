"""Fits the true set of effects with the library, from the truth, beside what each diagnosis said.

    python -m benchmarks.blind.oracle DIR [--diagnoses FOLDER] [--processes 1] [--cases NAME ...]

Writes oracle.json beside each diagnosis: what both leave, alike fitted. `score` makes of it the search gap and the
drawers of the wrong cases. Goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from .fits import judge


def write(case: Path, answer: Path, told: Path) -> str:
    """Ask about one case and write oracle.json; returns a line about it."""
    begin = time.perf_counter()
    sealed, diagnosis = (json.loads(p.read_text("utf-8")) for p in (answer, told / "diagnosis.json"))
    found = judge(case, sealed, diagnosis)
    found["wall_s"] = time.perf_counter() - begin
    (told / "oracle.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if "true" not in found:
        return f"{case.name}  the catalogue lacks its effect"
    true, said = found["true"], found["said"]
    both = "  ".join(f"{' + '.join(f['effects']) or 'none'} {f['left']:.2f}" for f in (true, said))
    return f"{case.name}  left by the true set and by what was said: {both}  ({found['wall_s']:.0f} s)"


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.oracle", description="Fits the true sets with the library.")
    p.add_argument("folder", type=Path)
    p.add_argument("--diagnoses", type=Path, help="folder of the diagnoses (default: FOLDER/diagnoses)")
    p.add_argument("--processes", type=int, default=1, help="cases at the same time")
    p.add_argument("--cases", nargs="+", metavar="CASE", help="only these")
    options = p.parse_args()
    diagnoses = options.diagnoses or options.folder / "diagnoses"
    there = [path.parent for path in sorted(diagnoses.glob("case_*/diagnosis.json"))]
    wanted = [t for t in there if options.cases is None or t.name in options.cases]
    if not wanted:
        p.error(f"{diagnoses}: holds no diagnoses")
    todo = [t for t in wanted if not (t / "oracle.json").exists()]
    print(f"{len(wanted)} diagnoses, {len(wanted) - len(todo)} asked about already", flush=True)
    jobs = [(options.folder / t.name, options.folder / "answers" / f"{t.name}.json", t) for t in todo]
    if options.processes == 1:
        for job in jobs:
            print(write(*job), flush=True)
        return
    with ProcessPoolExecutor(options.processes) as pool:
        for future in as_completed([pool.submit(write, *job) for job in jobs]):
            print(future.result(), flush=True)


if __name__ == "__main__":
    main()
