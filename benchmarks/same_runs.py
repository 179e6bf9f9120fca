"""Whether the master of two commits simulates the same, bit for bit, and how long a macro step of each takes.

    python -m benchmarks.same_runs --before COMMIT [BUILD_FOLDER] [--pairs 5]

Every package of the folder (else those that `cosim-fmus build` makes), and the two linear machines of `splits`, run
with every coupling method; each is also checked, told about (`--info`), repeated with half the step, and run twice in
a session. Results count to the last bit, summaries (with all warnings) and what --check and --info print to twelve
digits, but for times. With --pairs, the time after over that before of a bare macro step of two native FMUs and of one
of the machine, in runs that take turns. Exit code 1 when anything differs.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib
import io
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[1]
METHODS = ("gauss-seidel", "jacobi", "extrapolation", "nepce", "interface-jacobian", "fixed-point")
STOP = 2.5
"""End of a run of a shipped package [s]: the machine begins to move at 2 s."""
TIMED = {"native": 200_000, "machine": 11_000}
"""Macro steps of the runs that are timed."""
VARYING = re.compile(r'"(setup_time_s|wall_time_s|real_time_factor|versions|machine|package)"|wall time|set-up')
"""Lines of summaries and of what is printed that two runs of the same code do not have in common."""
YOUNG = ("units", "types", "connections", "answers", "parameters", "advice")
"""Entries of summaries that have come to stay after this program had: older commits have none."""
NUMBER = re.compile(r"-?\d+\.\d+(e[-+]\d+)?")
DIGITS = 12
"""Of numbers in summaries: energies are added up in pieces that hang on the machine's speed."""


def door(*names: str) -> Any:
    """The first of these that there is, as `module:name` in the master's package."""
    for name in names:
        module, _, own = name.partition(":")
        with contextlib.suppress(ModuleNotFoundError):
            return getattr(importlib.import_module(f"deepsea_cosim.master.{module}"), own)
    raise SystemExit(f"this code has none of {', '.join(names)}")


def printed(*arguments: str) -> str:
    """What the command prints, with its exit code."""
    main = door("cli:main")
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main([*arguments])
        except SystemExit as end:
            code = end.code
    return f"{out.getvalue()}{err.getvalue()}{code}"


def digest(*parts: str | bytes) -> str:
    """One number for all of it."""
    made = hashlib.sha256()
    for part in parts:
        made.update(part if isinstance(part, bytes) else part.encode())
    return made.hexdigest()


def constant(text: str) -> str:
    """The lines that do not vary, and no times of FMUs."""
    text = re.sub(r'"fmu_time_s": \{[^}]*\}', "", text)
    text = NUMBER.sub(lambda found: f"{float(found[0]):.{DIGITS}g}", text)
    return "\n".join(line for line in text.splitlines() if not VARYING.search(line))


def once(package: Path, folder: Path, *options: str) -> str:
    """A run by the command."""
    said = printed(str(package), "--out", str(folder), "--no-plot", "--quiet", *options)
    files = [folder / "results.csv", folder / "summary.json"]
    rows, summary = (path.read_bytes() if path.exists() else b"" for path in files)
    return digest(constant(said), rows, constant(_common(summary)))


def _common(summary: bytes) -> str:
    """A summary without what only one of two commits may tell."""
    told = json.loads(summary) if summary else {}
    for record in (told, told.get("step_check") or {}):
        for key in YOUNG:
            record.pop(key, None)
    return json.dumps(told, indent=1)


def twice_in_session(package: Path) -> str:
    """Two runs of one session, which record all outputs that are single numbers."""
    session = door("simulation.session:Session", "session:Session")
    with session(package) as opened:
        signals = [s for s in opened.system.outputs.values() if s.size == 1 and s.family != "text"]
        names = [f"{s.component}.{s.name}" for s in signals]
        made = [opened.run(names, 0.5, step)[1].tobytes() for step in (2e-3, 1e-3)]
        return digest(*made, json.dumps(opened.values(), default=str))


def cases(packages: list[Path], scratch: Path) -> Iterator[tuple[str, Callable[[], str]]]:
    """Name of a case, and what makes its digest."""
    for package in packages:
        name, out = package.stem, scratch / package.stem
        end = () if name.startswith("split") else ("--stop-time", str(STOP))
        yield f"{name}, check", lambda package=package: digest(printed(str(package), "--check"))
        yield f"{name}, info", lambda package=package: digest(printed(str(package), "--info"))
        yield f"{name}, session", lambda package=package: twice_in_session(package)
        yield (
            f"{name}, half the step",
            lambda package=package, out=out, end=end: once(package, out, "--check-step", *end),
        )
        for method in METHODS:
            yield (
                f"{name}, {method}",
                lambda package=package, out=out, end=end, method=method: once(
                    package, out, "--method", method, *end
                ),
            )  # fmt: skip


def timed(package: Path, scratch: Path) -> float:
    """The least time of a macro step [s]: of runs of one process, the one that nothing else has disturbed."""
    run = door("simulation.run:run", "simulate:run")
    options = door("options:Options")(results="")
    taken = [run(package, scratch / "timed", options).summary for _ in range(5)]
    return float(min(t["wall_time_s"] / t["steps"] for t in taken))


def made_packages(folder: Path, build: Path | None) -> list[Path]:
    """All packages that are run, in one folder."""
    from benchmarks import splits

    found = sorted(build.glob("*.ssp")) if build is not None else []
    if build is None:
        subprocess.run([sys.executable, "-m", "deepsea_cosim.fmus.cli", "build", "--out", str(folder / "build")],
                       check=True, stdout=subprocess.DEVNULL)  # fmt: skip
        found = sorted((folder / "build").glob("*.ssp"))
    for number, split in enumerate((splits.quarter_car(), splits.two_masses())):
        own = folder / f"split{number}"
        own.mkdir()
        found.append(splits.packed(split, own).rename(own / f"split{number}.ssp"))
    return found


def compare(before: str, build: Path | None, pairs: int) -> int:
    """Run both, print what differs; returns the exit code."""
    from benchmarks import master

    from .same_diagnoses import commits

    with tempfile.TemporaryDirectory() as text:
        scratch = Path(text)
        old, new = commits.before_and_now(REPOSITORY, before, scratch)
        packages = made_packages(scratch, build)

        def ask(code: commits.Code, wanted: str, *paths: Path) -> Any:
            command = [sys.executable, str(Path(__file__)), "--run", wanted, *map(str, paths)]
            done = subprocess.run(command, env=code.environment, stdout=subprocess.PIPE, text=True, check=True)
            return json.loads(done.stdout)

        one, two = ask(old, "digests", *packages), ask(new, "digests", *packages)
        differing = [name for name in {**one, **two} if one.get(name) != two.get(name)]
        for name in differing:
            print(f"{name}: differs")
        print(f"{len(one) - len(differing)} of {len(one)} cases identical: {old.name} and {new.name}")
        if pairs:
            machine = next(p for p in packages if p.stem == "deepsea_3km")
            for name, package in (("native", master.package(scratch, TIMED["native"])), ("machine", machine)):
                ratios = [ask(new, "time", package) / ask(old, "time", package) for _ in range(pairs)]
                print(f"{name}: a macro step takes {commits.spread(ratios)}")
    return 1 if differing else 0


def run_here(wanted: str, paths: list[Path]) -> object:
    """What a process of one of the two commits is asked for."""
    with tempfile.TemporaryDirectory() as text, contextlib.chdir(text):  # so that no message has a path that differs
        if wanted == "time":
            return timed(paths[0], Path("out"))
        begin, told = time.monotonic(), {}
        for name, make in cases(paths, Path("out")):
            told[name] = make()
            print(f"{time.monotonic() - begin:5.0f} s {name}", file=sys.stderr, flush=True)
        return told


def main() -> int:
    """Command line."""
    p = argparse.ArgumentParser(prog="benchmarks.same_runs", description=__doc__.splitlines()[0])
    p.add_argument("build", type=Path, nargs="*", help="folder with packages of `cosim-fmus build`")
    p.add_argument("--before", metavar="COMMIT", help="the commit that is right; held against the working tree")
    p.add_argument("--pairs", type=int, default=0, help="runs of each that are timed in turns")
    p.add_argument("--run", choices=("digests", "time"), help=argparse.SUPPRESS)
    options = p.parse_args()
    if options.run:
        print(json.dumps(run_here(options.run, options.build)))
        return 0
    if options.before is None:
        p.error("--before COMMIT is missing")
    return compare(options.before, options.build[0] if options.build else None, options.pairs)


if __name__ == "__main__":
    sys.exit(main())
