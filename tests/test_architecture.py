"""The house rules that code can hold: import direction, packaging, size of modules."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "master", "gap", "study")

ALLOWED = {
    "core": set(),
    "hydraulics_fmu": {"core"},
    "mechanics": {"core"},
    "fmus": {"core", "hydraulics_fmu", "mechanics", "ssp"},
    "ssp": {"core"},
    "master": {"core", "ssp"},
    "gap": {"core", "ssp", "master"},
    "study": {"core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "master"},
}
"""What each package may import of ours. `master`, `ssp` and `gap` never import physics."""


def imported_packages(path: Path, package: str) -> set[str]:
    """Our packages that a module imports, relative or absolute."""
    depth = len(path.relative_to(REPOSITORY).parts) - 1  # folders between the repository and the module
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level > depth:
            found.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("deepsea_cosim."):
            found.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            found |= {a.name.split(".")[1] for a in node.names if a.name.startswith("deepsea_cosim.")}
    return found - {package}


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_one_way(package):
    wrong = {}
    for path in (REPOSITORY / package).rglob("*.py"):
        if extra := imported_packages(path, package) - ALLOWED[package]:
            wrong[str(path.relative_to(REPOSITORY))] = extra
    assert not wrong


def test_every_folder_with_code_is_in_the_distribution():
    listed = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    elsewhere = {"tests", "build", "dist"}
    for init in REPOSITORY.rglob("__init__.py"):
        parts = init.parent.relative_to(REPOSITORY).parts
        if parts[0] not in elsewhere and not parts[0].startswith("."):
            assert "deepsea_cosim." + ".".join(parts) in listed
    assert set(PACKAGES) == {name.split(".")[1] for name in listed}


def test_modules_stay_small():
    long = {
        str(path.relative_to(REPOSITORY)): count
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
        if (count := len(path.read_text().splitlines())) > 600
    }
    assert not long
