"""Whether two commits say the same of the same measurements; see README.md.

    python -m benchmarks.same_diagnoses --before COMMIT [--after COMMIT]
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from . import commits
from .campaigns import CAMPAIGNS, Small
from .commits import Code, CodeError, move
from .compare import differences
from .made import Made, build_toys

REPOSITORY = Path(__file__).parents[2]

AT_ONCE = 2
"""Campaigns that are diagnosed at the same time, each with one process that simulates: two cores are busy then."""

SOURCES = (
    "benchmarks/same_diagnoses/toy.py", "benchmarks/same_diagnoses/machine.py", "benchmarks/same_diagnoses/made.py",
    *(f"benchmarks/blind/{name}.py" for name in (
        "case", "compiled", "draw", "effect_forms", "effects", "forms", "generate", "lines", "machine", "measure",
        "plant", "readings", "records", "refit", "ruler", "solver", "supply", "system", "truth", "water",
    )),
    "tests/gap/oscillator.py", "tests/toys/__init__.py", "tests/toys/toy_oscillator.py",
)  # fmt: skip
"""What the measurements depend on, beside the deep-sea package; not the blind benchmark's scoring, which uses gap."""


@dataclass(frozen=True)
class Outcome:
    """A diagnosis: the folder of its files, its wall time [s], and what went wrong or an empty text."""

    folder: Path
    seconds: float
    fault: str = ""


def digest(package: Path) -> str:
    """Changes with whatever the measurements depend on."""
    made = hashlib.sha256(package.read_bytes())
    for name in SOURCES:
        made.update((REPOSITORY / name).read_bytes())
    return made.hexdigest()[:12]


def written(package: Path, cache: Path, wanted: Sequence[Small]) -> dict[str, Path]:
    """The folder of each wanted campaign, made where the cache does not have it."""
    folder = cache / "campaigns" / digest(package)
    folder.mkdir(parents=True, exist_ok=True)
    made = Made(folder / "toys", folder / "machine.ssp")
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        if not made.toys.is_dir():
            toys = Path(scratch) / "toys"
            toys.mkdir()
            build_toys(toys)
            move(toys, made.toys)
        if not made.machine.is_file():
            copy = Path(scratch) / "machine.ssp"
            copy.write_bytes(package.read_bytes())
            copy.replace(made.machine)
        for small in wanted:
            if not (folder / small.name).is_dir():
                new = Path(scratch) / small.name
                new.mkdir()
                small.write(new, made)
                move(new, folder / small.name)
    return {small.name: folder / small.name for small in wanted}


def diagnose(code: Code, campaign: Path, out: Path) -> Outcome:
    """Diagnose a campaign with that code, into `out` once it is done."""
    begin = time.perf_counter()
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent) as scratch:
        made = Path(scratch) / "made"
        made.mkdir()
        command = [sys.executable, "-m", "deepsea_cosim.gap.cli", "diagnose", str(campaign / "campaign.toml")]
        command += ["--out", str(made), "--processes", "1", "--no-report", "--quiet"]
        done = subprocess.run(command, env=code.environment, cwd=made, capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - begin
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            return Outcome(out, seconds, f"{code.name}: exit code {done.returncode}: {last}")
        move(made, out)
    return Outcome(out, seconds)


def side(
    workers: ThreadPoolExecutor, code: Code, folders: dict[str, Path], results: Path
) -> dict[str, Future[Outcome]]:
    """The diagnoses of all campaigns with that code, those that are in the results already among them."""
    made = {}
    for name, campaign in folders.items():
        out = results / name
        known = (out / "diagnosis.json").is_file()
        made[name] = workers.submit(Outcome, out, 0.0) if known else workers.submit(diagnose, code, campaign, out)
    return made


def verdict(before: Outcome, after: Outcome, names: dict[str, str], most: int) -> list[str]:
    """'identical', or lines that say what differs: the first `most` fields."""
    if before.fault or after.fault:
        return [*filter(None, (before.fault, after.fault))]
    found = differences(before.folder, after.folder, names)
    if not found:
        return ["identical"]
    lines = [f"{len(found)} fields differ, by {max(d.size for d in found):.1g} of their values at most"]
    lines += [f"    {d.field}: {d.before} -> {d.after}" for d in found[:most]]
    return lines


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="benchmarks.same_diagnoses", description="Whether two commits say the same of the same measurements."
    )
    p.add_argument("--before", metavar="COMMIT", help="the commit that is right")
    p.add_argument("--after", metavar="COMMIT", help="the commit that is held against it (default: the working tree)")
    p.add_argument("--only", metavar="NAME", nargs="+", help="only these campaigns")
    p.add_argument("--list", action="store_true", help="list the campaigns")
    p.add_argument(
        "--renamed", metavar="OLD=NEW", action="append", default=[],
        help="a field that has another name after; * is any key: causes/*/gap_after=causes/*/left; may be repeated",
    )  # fmt: skip
    p.add_argument("--show", metavar="N", type=int, default=5, help="differing fields of a campaign that are printed")
    build = Path(os.environ.get("DEEPSEA_COSIM_BUILD", REPOSITORY / "build"))
    p.add_argument("--package", type=Path, default=build / "deepsea_0km.ssp", help="the machine (default: %(default)s)")
    p.add_argument(
        "--cache", type=Path, default=Path(tempfile.gettempdir()) / f"same_diagnoses_{os.getuid()}",
        help="folder of campaigns, code and diagnoses of commits (default: %(default)s)",
    )  # fmt: skip
    return p


def main() -> int:
    """Command line; exit code 1 when a diagnosis differs or failed, 2 for bad input."""
    p = parser()
    options = p.parse_args()
    if options.list:
        print("\n".join(f"{small.name:<18}{small.text}" for small in CAMPAIGNS))
        return 0
    if options.before is None:
        p.error("--before COMMIT is missing")
    unknown = set(options.only or ()) - {small.name for small in CAMPAIGNS}
    if unknown:
        p.error(f"--only {' '.join(sorted(unknown))}: no such campaign; --list names them")
    if not options.package.is_file():
        p.error(f"--package {options.package}: no such file; `cosim-fmus build --out build` makes it")
    wanted = [small for small in CAMPAIGNS if not options.only or small.name in options.only]
    names = dict(entry.partition("=")[::2] for entry in options.renamed)
    try:
        return compare(options, wanted, names)
    except CodeError as error:
        print(f"same_diagnoses: {error}", file=sys.stderr)
        return 2


def compare(options: argparse.Namespace, wanted: Sequence[Small], names: dict[str, str]) -> int:
    """Diagnose with both commits, print what differs; returns the exit code."""
    cache: Path = options.cache.resolve()
    cache.mkdir(parents=True, exist_ok=True)
    for pair in names.items():
        print("renamed: {} -> {}".format(*pair))
    folders = written(options.package, cache, wanted)
    state = next(iter(folders.values())).parent.name
    with tempfile.TemporaryDirectory(dir=cache) as text, ThreadPoolExecutor(AT_ONCE) as workers:
        scratch = Path(text)
        both: list[tuple[Code, dict[str, Future[Outcome]]]] = []
        for place, commit in (("before", options.before), ("after", options.after)):
            full = None if commit is None else commits.full_hash(REPOSITORY, commit)
            source = REPOSITORY if full is None else commits.sources_of(REPOSITORY, full, cache)
            code = commits.prepared(source, full, scratch / place)
            kept = full is not None and full not in [c.commit for c, _ in both]  # twice the same: diagnosed anew
            results = cache / "results" / state / str(full) if kept else scratch / "results"
            both.append((code, side(workers, code, folders, results)))
        (old, before), (new, after) = both
        same = True
        try:
            for name in folders:
                one, two = before[name].result(), after[name].result()
                lines = verdict(one, two, names, options.show)
                same = same and lines == ["identical"]
                print(f"{name:<18}{one.seconds:6.1f} s {two.seconds:6.1f} s  " + "\n".join(lines), flush=True)
        finally:  # what waits does not begin after Ctrl-C
            workers.shutdown(cancel_futures=True)
    print(f"{'the same' if same else 'NOT the same'}: {old.name} and {new.name}, {len(folders)} campaigns")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
