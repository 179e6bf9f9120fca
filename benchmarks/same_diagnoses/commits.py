"""The code of a commit, so that a process of its own runs it and not the installed code.

A folder for PYTHONPATH holds `deepsea_cosim/` with a link to each package folder, as the commit's own pyproject.toml
lists them. It has an `__init__.py`, so that an installed `deepsea_cosim` is not merged with it; and beside it stands a
`sitecustomize.py` that takes an editable installation's finder out of every process, workers included: that finder
would give modules which the commit does not have.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tarfile
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = "deepsea_cosim"

SITECUSTOMIZE = """import sys
OURS = "__editable___deepsea_cosim"
sys.meta_path[:] = [f for f in sys.meta_path if not getattr(f, "__module__", "").startswith(OURS)]
sys.path[:] = [p for p in sys.path if not p.startswith("__editable__.deepsea_cosim")]
"""

WHERE = """
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
ASK = "__import__('deepsea_cosim.gap').gap.__file__"
if __name__ == "__main__":
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as workers:
        print(eval(ASK), workers.submit(eval, ASK).result(), sep="\\n")
"""
"""Prints where a process and a worker of it find the diagnosis."""


class CodeError(RuntimeError):
    """A commit whose code cannot be run."""


@dataclass(frozen=True)
class Code:
    """The code of a commit, or of the working tree (commit None), in a folder for PYTHONPATH."""

    commit: str | None
    folder: Path

    @property
    def name(self) -> str:
        """For people."""
        return self.commit[:10] if self.commit else "working tree"

    @property
    def environment(self) -> dict[str, str]:
        """Environment of a process that runs it; sums of one thread do not depend on the machine's load."""
        own = {"PYTHONPATH": str(self.folder), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        return {**os.environ, **own}


def full_hash(repository: Path, commit: str) -> str:
    """The hash of a commit named in any way that git knows."""
    asked = ["git", "-C", str(repository), "rev-parse", "--verify", "--quiet", f"{commit}^{{commit}}"]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CodeError(f"{commit}: the repository {repository} has no such commit")
    return done.stdout.strip()


def links(source: Path, folder: Path) -> None:
    """Fill `folder` such that it gives the packages of the source tree when it is on PYTHONPATH."""
    places: dict[str, str] = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]["package-dir"]
    package = folder / ROOT
    package.mkdir(parents=True)
    (folder / "sitecustomize.py").write_text(SITECUSTOMIZE, encoding="utf-8")
    for name, place in places.items():
        if name == ROOT:
            for path in (source / place).glob("*.py"):
                (package / path.name).symlink_to(path.resolve())
        elif name.count(".") == 1 and name.startswith(f"{ROOT}."):
            (package / name.partition(".")[2]).symlink_to((source / place).resolve())
    if not (package / "__init__.py").exists():
        (package / "__init__.py").touch()


def sources_of(repository: Path, commit: str, cache: Path) -> Path:
    """The files of a commit, given by its full hash, in a folder that is kept in the cache."""
    target = cache / "code" / commit
    if not target.is_dir():
        target.parent.mkdir(parents=True, exist_ok=True)
        packed = subprocess.run(["git", "-C", str(repository), "archive", commit], capture_output=True, check=True)
        with TemporaryDirectory(dir=target.parent) as scratch:
            made = Path(scratch) / "made"
            with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
                archive.extractall(made, filter="data")
            move(made, target)
    return target


def move(made: Path, target: Path) -> None:
    """Put a folder in its place, unless another process was quicker."""
    try:
        made.rename(target)
    except OSError:
        if not target.is_dir():
            raise


def prepared(source: Path, commit: str | None, scratch: Path) -> Code:
    """A source tree with its folder for PYTHONPATH, which is made in `scratch`."""
    code = Code(commit, scratch / (commit or "working-tree"))
    links(source, code.folder)
    check(code)
    return code


def before_and_now(repository: Path, before: str, scratch: Path) -> tuple[Code, Code]:
    """The code of a commit and that of the working tree."""
    full = full_hash(repository, before)
    old = prepared(sources_of(repository, full, scratch), full, scratch / "before")
    return old, prepared(repository, None, scratch / "after")


def spread(ratios: Iterable[float]) -> str:
    """Ratios of times for people: the middle one, the least and the greatest."""
    ordered = sorted(ratios)
    return f"{ordered[len(ordered) // 2]:.3f} of the time ({ordered[0]:.3f} to {ordered[-1]:.3f})"


def check(code: Code) -> None:
    """Raise `CodeError` unless a process and its workers find this code and no other."""
    with TemporaryDirectory() as scratch:
        script = Path(scratch) / "where.py"
        script.write_text(WHERE, encoding="utf-8")
        command = [sys.executable, str(script)]
        done = subprocess.run(command, env=code.environment, capture_output=True, text=True, check=False)
    expected = str(code.folder / ROOT / "gap" / "__init__.py")
    if done.returncode != 0 or done.stdout.split("\n")[:2] != [expected] * 2:
        raise CodeError(f"{code.name}: {expected} is not what runs, but {done.stdout or done.stderr}")
