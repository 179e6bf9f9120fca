"""The house rules that code can hold: import direction, packaging, size of modules."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest
from deepsea_cosim.gap.diagnose import NEEDED_LATE

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "master", "gap", "study", "api")

DOOR = "api"
"""The folder that is `deepsea_cosim` itself: what users import."""

ALLOWED = {
    "core": set(),
    "hydraulics_fmu": {"core"},
    "mechanics": {"core"},
    "fmus": {"core", "hydraulics_fmu", "mechanics", "ssp"},
    "ssp": {"core"},
    "master": {"core", "ssp"},
    "gap": {"core", "ssp", "master"},
    "study": {"core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "master"},
    "api": {"core", "fmus", "ssp", "master", "gap", "study"},
}
"""What each package may import of ours. `master`, `ssp` and `gap` never import physics."""

GAP = REPOSITORY / "gap"
ROOMS = (
    "settings", "measurements", "campaign", "problem", "estimation", "checks", "selection", "search", "analysis",
    "pipeline", "result", "report", "onboarding",
)  # fmt: skip
"""Of the diagnosis: each imports only those before it. What stands beside them (the commands, `diagnose`) may import
all."""

MASTER = REPOSITORY / "master"
ROOMS_OF_THE_MASTER = (
    "options", "engine", "slaves", "isolation", "system", "coupling", "results", "algorithms", "accuracy", "simulation",
    "page", "comparison", "replay", "parallel",
)  # fmt: skip

MAX_LINES, MAX_LINES_OF_A_FUNCTION = 400, 60
TABLES = {"SCHEMA", "TIME_UNITS"}
"""Numbers that nobody tunes: a format's version, units of time."""


def imported_packages(path: Path, package: str) -> set[str]:
    """Our packages that a module imports, relative or absolute."""
    parts = path.relative_to(REPOSITORY).parts
    depth = len(parts) - 1 if parts[0] != DOOR else 0  # packages between the distribution's and the module
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level > depth:
            found.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("deepsea_cosim."):
            found.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            found |= {a.name.split(".")[1] for a in node.names if a.name.startswith("deepsea_cosim.")}
    own = {p.stem for p in (REPOSITORY / DOOR).glob("*.py")} if parts[0] == DOOR else {package}
    return found - own - {""}


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_one_way(package):
    wrong = {}
    for path in (REPOSITORY / package).rglob("*.py"):
        if extra := imported_packages(path, package) - ALLOWED[package]:
            wrong[str(path.relative_to(REPOSITORY))] = extra
    assert not wrong


def test_every_folder_with_code_is_in_the_distribution():
    setuptools = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]
    listed, places = setuptools["packages"], {folder: name for name, folder in setuptools["package-dir"].items()}
    elsewhere = {"benchmarks", "tests", "build", "dist"}
    for init in REPOSITORY.rglob("__init__.py"):
        parts = init.parent.relative_to(REPOSITORY).parts
        if parts[0] not in elsewhere and not parts[0].startswith("."):
            assert places["/".join(parts)] in listed
    assert set(PACKAGES) == {setuptools["package-dir"][name].split("/")[0] for name in listed}


def test_modules_stay_small():
    long = {
        str(path.relative_to(REPOSITORY)): count
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
        if (count := len(path.read_text().splitlines())) > 600
    }
    assert not long


def modules_of(folder):
    """Syntax of each module of a package by its path there."""
    return {str(path.relative_to(folder)): ast.parse(path.read_text()) for path in sorted(folder.rglob("*.py"))}


def gap_modules():
    """Syntax of each module of gap/ by its path there."""
    return modules_of(GAP)


def imported_modules(path, tree, modules):
    """Paths of the modules of a package that the one at that path imports, at its top or in a function."""
    folder = path.split("/")[:-1]
    found = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or not 0 < node.level <= len(folder) + 1:
            continue
        base = folder[: len(folder) + 1 - node.level] + (node.module.split(".") if node.module else [])
        for alias in node.names:
            own, package = "/".join([*base, alias.name]) + ".py", "/".join([*base, "__init__.py"])
            candidates = (own, "/".join(base) + ".py", package)
            found |= {next((name for name in candidates if name in modules), path)}
    return found - {path}


def room(path):
    """The folder or the module at the top of a package that a path belongs to."""
    return path.split("/")[0].removesuffix(".py")


@pytest.mark.parametrize(("folder", "rooms"), [(GAP, ROOMS), (MASTER, ROOMS_OF_THE_MASTER)], ids=["gap", "master"])
def test_rooms_import_one_way(folder, rooms):
    modules = modules_of(folder)
    order = {name: k for k, name in enumerate(rooms)}
    beside = len(ROOMS)
    wrong = [
        f"{path} imports {other}"
        for path, tree in modules.items()
        if room(path) in order
        for other in imported_modules(path, tree, modules)
        if order.get(room(other), beside) > order[room(path)]
    ]
    assert not wrong
    assert {room(path) for path in modules if "/" in path} <= set(rooms)


def test_settings_import_nothing_of_the_diagnosis():
    modules = gap_modules()
    own = [(path, tree) for path, tree in modules.items() if room(path) == "settings"]
    imported = {other for path, tree in own for other in imported_modules(path, tree, modules)}
    assert {room(path) for path in imported} <= {"settings"}


def test_no_module_imports_itself_by_others():
    modules = gap_modules()
    waiting = {path: imported_modules(path, tree, modules) - {"__init__.py"} for path, tree in modules.items()}
    while free := [path for path, others in waiting.items() if not others & set(waiting)]:
        for path in free:
            del waiting[path]
    assert not waiting, "each of these imports another of them"


def test_functions_of_the_diagnosis_stay_short():
    long = {
        f"{path}: {node.name}": count
        for path, tree in gap_modules().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and (count := node.end_lineno - node.lineno + 1) > MAX_LINES_OF_A_FUNCTION
    }
    assert not long


def test_modules_of_the_diagnosis_stay_short():
    texts = {path: (GAP / path).read_text() for path in gap_modules()}
    long = {path: count for path, text in texts.items() if (count := len(text.splitlines())) > MAX_LINES}
    assert not long


def is_number(node):
    """Whether an expression is a number, or a tuple, list, set or dict with one in it."""
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) or is_number(node.right)
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return any(map(is_number, node.elts))
    if isinstance(node, ast.Dict):
        return any(map(is_number, node.values))
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def test_numbers_of_the_diagnosis_stand_in_its_settings():
    wrong = []
    for path, tree in gap_modules().items():
        for node in tree.body if room(path) != "settings" else ():
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            names = {n.id for t in targets if t is not None for n in ast.walk(t) if isinstance(n, ast.Name)}
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and is_number(node.value):
                wrong += [f"{path}: {name}" for name in sorted(names - TABLES)]
    assert not wrong


def test_what_a_stopped_diagnosis_imports_late_is_imported_ahead():
    """Or it waits for that."""
    late = set()
    for path, tree in gap_modules().items():
        functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and room(path) == "analysis"]
        for node in (inner for function in functions for inner in ast.walk(function)):
            if isinstance(node, ast.Import):
                late |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                late.add(node.module)
    assert late == set(NEEDED_LATE)
