"""The walks of CONTRIBUTING.md, made as they are written there in a copy of the repository."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.same_diagnoses.commits import links

REPOSITORY = Path(__file__).parent.parent
FOLDERS = ("api", "benchmarks", "core", "fmus", "gap", "hydraulics_fmu", "master", "mechanics", "ssp", "study", "tests")

EDIT = re.compile(
    r"^`(?P<path>[\w./]+)`, (?P<where>new|at the end|below `(?P<below>[^`]+)`|above `(?P<above>[^`]+)`):\n\n"
    r"```\w+\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)

STAGE = """
import numpy as np
from deepsea_cosim.gap.pipeline.pipeline import PIPELINE
from deepsea_cosim.gap.pipeline.stage import run_pipeline
from deepsea_cosim.gap.pipeline.state import State
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.problem.problem import RunConditions
from tests.gap.formula import FormulaProblem

t = np.arange(50.0)
observations = gather([RawBlock(r, 0, "m.x", t, np.full(50, y), 0.5, None, True) for r, y in enumerate((1.0, -3.0))])
runs = tuple(RunConditions(name, 49.0, {}, {}, {}) for name in ("calm", "rough"))
problem = FormulaProblem(lambda point, step: np.zeros(100), observations, runs=runs)
state = State(problem, None, 1.0, nominal=np.zeros(100))
stages = [stage for stage in PIPELINE if "missed most" in stage.name]
assert len(stages) == 1
told = []
assert run_pipeline(stages, state, told.append).sections == {"worst_run": {"run": "rough", "rms": 6.0}}
assert told == [stages[0].name]
"""

EFFECT = """
import numpy as np
from deepsea_cosim.gap.campaign.read_catalogue import load
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.variables import ARM
from pathlib import Path

effect = load(Path("ssp/scenarios/deepsea/effects.toml")).effect("added_mass")
component, _, name = effect.main.address.partition(".")
assert component == "arm"
assert ARM[name].start == effect.main.neutral

def angle(scale):
    arm = Arm(ARM.parameters({name: scale}))
    for k in range(20):
        arm.step(k * 4e-3, 4e-3, 9000.0)
    return arm.theta

assert angle(2.0) < angle(1.0) - 1e-6
"""


@dataclass(frozen=True)
class Edit:
    """A piece of a file as the document shows it."""

    path: str
    where: str
    anchor: str | None
    text: str

    def apply(self, root: Path) -> None:
        """Make the change in a tree; the line that it stands beside has to be there once."""
        path = root / self.path
        if self.where == "new":
            assert not path.exists()
            path.write_text(self.text)
        elif self.where == "at the end":
            path.write_text(path.read_text() + self.text)
        else:
            lines = path.read_text().splitlines(keepends=True)
            [k] = [k for k, line in enumerate(lines) if self.anchor in line]
            lines.insert(k + self.where.startswith("below"), self.text)
            path.write_text("".join(lines))


def walk(title: str) -> list[Edit]:
    """The edits of a section of the document."""
    text = (REPOSITORY / "CONTRIBUTING.md").read_text()
    [section] = [part for part in re.split(r"^## ", text, flags=re.MULTILINE) if part.startswith(title)]
    assert section.count("\n```") == 2 * len(EDIT.findall(section))  # every block of code is an edit
    return [Edit(m["path"], m["where"], m["below"] or m["above"], m["text"]) for m in EDIT.finditer(section)]


@pytest.fixture
def scratch(tmp_path):
    """A copy of what the walks touch, and of what that needs."""
    ignored = shutil.ignore_patterns("__pycache__", "*.so", "records")
    for folder in FOLDERS:
        shutil.copytree(REPOSITORY / folder, tmp_path / "copy" / folder, ignore=ignored)
    shutil.copy(REPOSITORY / "pyproject.toml", tmp_path / "copy")
    return tmp_path / "copy"


def runs(scratch: Path, *command: str, compiled: bool = False) -> None:
    """Python with the code of the copy, kernels not compiled unless that is asked for."""
    code = scratch.parent / "path"
    if not code.exists():
        links(scratch, code)
    own = {"PYTHONPATH": os.pathsep.join([str(code), str(scratch)]), "NUMBA_DISABLE_JIT": str(int(not compiled))}
    environment = {**os.environ, **own}
    done = subprocess.run(
        [sys.executable, *command], cwd=scratch, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_stage_of_the_diagnosis(scratch):
    edits = walk("A stage of the diagnosis")
    for edit in edits:
        edit.apply(scratch)
    assert len({edit.path for edit in edits}) == 2
    runs(scratch, "-c", STAGE)


def test_an_effect(scratch):
    edits = walk("An effect of the machine")
    for edit in edits:
        edit.apply(scratch)
    assert len({edit.path for edit in edits}) == 3
    runs(scratch, "-c", EFFECT)
    files = ("tests/mechanics/test_effects.py", "tests/ssp/test_effects_catalogue.py")
    runs(scratch, "-m", "pytest", "-p", "no:cacheprovider", *files, "-k", "added_mass or absent or listed")


def test_a_coupling_algorithm(scratch):
    edits = walk("A coupling algorithm")
    for edit in edits:
        edit.apply(scratch)
    assert len({edit.path for edit in edits}) == 2
    files = ("test_backward_gauss_seidel.py", "test_order.py")
    tests = [f"tests/master/algorithms/{name}" for name in files]
    runs(scratch, "-m", "pytest", "-p", "no:cacheprovider", *tests, "-k", "backward", compiled=True)


def test_a_result_format(scratch):
    edits = walk("A format of result files")
    for edit in edits:
        edit.apply(scratch)
    assert len({edit.path for edit in edits}) == 2
    runs(scratch, "-m", "pytest", "-p", "no:cacheprovider", "tests/master/results/test_json_lines.py")


def test_a_feature_of_ssp(scratch):
    edits = walk("A feature of SSP")
    for edit in edits:
        edit.apply(scratch)
    assert len({edit.path for edit in edits}) == 4
    runs(scratch, "-m", "pytest", "-p", "no:cacheprovider", "tests/master/test_descriptions.py")
