"""A report in parts: makes and diagnoses the cases of a seed that a file of records lacks, each as soon as it is made.

    python -m benchmarks.blind.finish --seed 1 --cases 150 --records RECORDS.jsonl --answers ANSWERS.jsonl --out DIR
        --package build/deepsea_0km.ssp [--command COSIM-GAP] [--processes 2]

What is done or failed is in both files at once, so it can be stopped at any time and goes on where nothing but these
two is left. With --command another installation diagnoses, as that of the commit which a report is of. Nothing is shown
of what the cases are.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from . import records
from .generate import write_again, write_case
from .run import ALONE, TIMEOUT, default_command, diagnose


def one(
    seed: int, index: int, answer: dict[str, Any] | None, out: Path, package: Path, command: str, timeout: float
) -> tuple[dict[str, Any], str]:
    """Make and diagnose a case; its sealed answer, and what went wrong or ""."""
    if answer is None:
        answer = write_case(seed, index, out, package)
    else:
        write_again(answer, out, package)
    name = f"case_{index:04d}"
    _, _, fault = diagnose([command, *ALONE], out / name, out / "diagnoses" / name, timeout)
    return answer, fault


def main() -> None:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.finish", description="Makes and diagnoses what records lack.")
    p.add_argument("--seed", type=int, required=True)
    p.add_argument("--cases", type=int, required=True, help="number of cases in all")
    p.add_argument("--records", type=Path, required=True, help="file of records, gets each case as it is done")
    p.add_argument("--answers", type=Path, required=True, help="file of sealed answers, likewise")
    p.add_argument("--out", type=Path, required=True)
    p.add_argument("--package", type=Path, required=True, help="package that the diagnosis is to use")
    p.add_argument("--command", default=default_command(), help="the diagnosis (default: cosim-gap)")
    p.add_argument("--timeout", type=float, default=TIMEOUT, help="longest time for one diagnosis, s")
    p.add_argument("--processes", type=int, default=2, help="cases at the same time")
    options = p.parse_args()
    lines = options.answers.read_text("utf-8").splitlines() if options.answers.exists() else []
    answers = {made["case"]: made for made in map(json.loads, lines)}
    known = records.load(options.records) if options.records.exists() else []
    done = {r.answer["case"] for r in known}
    todo = [k for k in range(options.cases) if k not in done]
    print(f"{len(done)} of {options.cases} are done", flush=True)
    with ProcessPoolExecutor(options.processes) as pool:
        place = options.out, options.package, options.command, options.timeout
        futures = {pool.submit(one, options.seed, k, answers.get(k), *place): k for k in todo}
        for count, future in enumerate(as_completed(futures), 1):
            k, (answer, fault) = futures[future], future.result()
            if k not in answers:
                with options.answers.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(answer) + "\n")
            told = f"case_{k:04d}"
            made = records.one(options.out / "answers" / f"{told}.json", options.out / "diagnoses" / told)
            records.merge(options.records, [made])
            print(f"{time.strftime('%H:%M:%S')} {told} {fault or 'done'}, {len(todo) - count} left", flush=True)


if __name__ == "__main__":
    main()
