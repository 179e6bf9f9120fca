"""Runs the diagnosis over all cases of a folder, one subprocess a case; goes on where an earlier run has stopped.

    python -m benchmarks.blind.run DIR --limit-minutes 60

Writes DIR/diagnoses/case_0000/diagnosis.json and so on. A case that fails leaves failed.txt and is tried again next
time.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path


def default_command() -> str:
    """cosim-gap of this Python's environment."""
    beside = Path(sys.executable).parent / "cosim-gap"
    return str(beside) if beside.exists() else "cosim-gap"


ALONE = ("--processes", "1", "--no-report", "--quiet")
"""Options of a diagnosis beside others."""

TIMEOUT = 1800.0
"""Longest time for one case, unless another one is asked for [s]."""


def cases_in(folder: Path, count: int | None = None) -> list[Path]:
    """The folders of the cases, or of the first so many."""
    return sorted(path.parent for path in folder.glob("case_*/campaign.toml"))[:count]


def diagnose(command: list[str], case: Path, out: Path, timeout: float) -> tuple[str, float, str]:
    """Diagnose one case; returns its name, the wall time (s) and what went wrong, or an empty text."""
    out.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    fault = ""
    try:
        done = subprocess.run(
            [*command[:1], "diagnose", str(case / "campaign.toml"), "--out", str(out), *command[1:]],
            capture_output=True, text=True, timeout=timeout, check=False,
        )  # fmt: skip
        lines = (done.stderr or done.stdout).strip().splitlines()
        if done.returncode != 0 or not (out / "diagnosis.json").exists():
            fault = f"exit code {done.returncode}: {lines[-1] if lines else 'no message'}"
    except subprocess.TimeoutExpired:
        fault = f"not done after {timeout:g} s"
    except OSError as error:
        fault = str(error)
    mark = out / "failed.txt"
    if fault:
        mark.write_text(fault + "\n", encoding="utf-8")
    else:
        mark.unlink(missing_ok=True)
    return case.name, time.perf_counter() - begin, fault


def main() -> int:
    """Command line; exit code 1 when a case has failed."""
    p = argparse.ArgumentParser(prog="benchmarks.blind.run", description="Diagnoses all cases of a folder.")
    p.add_argument("folder", type=Path)
    p.add_argument("--out", type=Path, help="folder for the diagnoses (default: FOLDER/diagnoses)")
    p.add_argument("--command", default=default_command(), help="the diagnosis (default: cosim-gap)")
    p.add_argument("--limit-minutes", type=float, default=float("inf"), help="start no case after this time")
    p.add_argument("--timeout", type=float, default=TIMEOUT, help="longest time for one case, s")
    p.add_argument("--processes", type=int, default=1, help="cases at the same time")
    p.add_argument("--cases", type=int, help="only the first so many cases")
    p.add_argument("--option", action="append", default=[], help="further option of the diagnosis, may be repeated")
    options = p.parse_args()
    out = options.out or options.folder / "diagnoses"
    cases = cases_in(options.folder, options.cases)
    if not cases:
        p.error(f"{options.folder}: holds no cases")
    todo = [case for case in cases if not (out / case.name / "diagnosis.json").exists()]
    print(f"{len(cases)} cases, {len(cases) - len(todo)} diagnosed already", flush=True)
    command = [options.command, *options.option]
    begin, done, failed = time.perf_counter(), 0, 0
    queue = list(todo)
    with ThreadPoolExecutor(options.processes) as pool:
        running: set[Future[tuple[str, float, str]]] = set()
        while queue or running:
            late = time.perf_counter() - begin > 60.0 * options.limit_minutes
            while queue and not late and len(running) < options.processes:
                case = queue.pop(0)
                running.add(pool.submit(diagnose, command, case, out / case.name, options.timeout))
            if not running:
                break
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                name, seconds, fault = future.result()
                done += 1
                failed += bool(fault)
                left = (time.perf_counter() - begin) / done * (len(todo) - done)
                text = f"FAILED, {fault}" if fault else "done"
                print(f"{name}  {seconds:6.1f} s  {text}   [{done}/{len(todo)}, {left / 60:.1f} min left]", flush=True)
    if done < len(todo):
        print(f"stopped after {options.limit_minutes:g} min, {len(todo) - done} cases are left", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
