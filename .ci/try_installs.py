"""Installs the wheel and the source distribution into bare environments of every Python that the project is for, as far
as it is on this machine, and runs a scenario with each: python .ci/try_installs.py [3.12 ...]"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PYTHONS = ("3.11", "3.12", "3.13")


def run(*command: str | Path, cwd: Path | None = None) -> str:
    """What a command prints; a command that fails ends the script with all that it said."""
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        shown = " ".join(map(str, command))
        raise SystemExit(f"{shown}\nexit code {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def candidates(version: str) -> Iterator[str]:
    """Interpreters of a version: on the path, or kept by pyenv."""
    if found := shutil.which(f"python{version}"):
        yield found
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    yield from map(str, sorted(pyenv.glob(f"versions/{version}.*/bin/python"), reverse=True))


def interpreter(version: str) -> str | None:
    """One of them that starts; None where there is none."""
    for path in candidates(version):
        said = subprocess.run([path, "-c", "import sys, venv; print(*sys.version_info[:2], sep='.')"],
                              capture_output=True, text=True, check=False)  # fmt: skip
        if said.returncode == 0 and said.stdout.strip() == version:
            return path
    return None


def distributions(scratch: Path) -> list[Path]:
    """The source distribution, and the wheel that is built from it alone."""
    tools = scratch / "tools"
    run(sys.executable, "-m", "venv", tools)
    run(tools / "bin" / "python", "-m", "pip", "install", "-q", "build")
    run(tools / "bin" / "python", "-m", "build", "--outdir", scratch / "dist", ROOT)
    return sorted((scratch / "dist").iterdir(), key=lambda path: path.suffix != ".whl")


def attempt(python: str, version: str, files: list[Path], scratch: Path) -> None:
    """Install the wheel with what it needs, build and run; then the source distribution in its place."""
    place = scratch / version
    run(python, "-m", "venv", place / "venv")
    scripts = place / "venv" / "bin"
    for file in files:
        again = ["--force-reinstall", "--no-deps"] if file != files[0] else []
        run(scripts / "python", "-m", "pip", "install", "-q", *again, file)
        if not again:
            run(scripts / "cosim-fmus", "build", "--out", "build", "--quiet", cwd=place)
        for command in ("cosim-master", "cosim-fmus", "cosim-gap", "cosim-study"):
            run(scripts / command, "--help", cwd=place)
        run(scripts / "python", "-c", "from deepsea_cosim import simulate", cwd=place)
        told = run(scripts / "cosim-master", "build/deepsea_0km.ssp", "--stop-time", "0.5", "--json", cwd=place)
        summary = json.loads(told)["summary"]
        if (summary["status"], summary["steps"], summary["warnings"]) != ("ok", 500, []):
            raise SystemExit(f"Python {version}, {file.name}: the run is not as it should be: {told[:4000]}")
        print(f"Python {version}, {file.name}: installed, FMUs built, run", flush=True)


def main(versions: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        files = distributions(scratch)
        for version in versions:
            if (python := interpreter(version)) is None:
                print(f"Python {version}: is not on this machine")
            else:
                attempt(python, version, files, scratch)


if __name__ == "__main__":
    main(sys.argv[1:] or list(PYTHONS))
