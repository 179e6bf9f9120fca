"""The walks of CONTRIBUTING.md, applied to a copy of the repository: they work and touch as many files as told.

A `python` block with a title is a new file. A `diff` block changes one, hunk by hunk (`@@`), where its lines stand.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "master", "gap", "study")
COPIED = ("core", "hydraulics_fmu", "mechanics", "fmus", "ssp", "gap", "tests")
"""What a walk may change, and what has compiled kernels that conftest drops; the others are only linked."""

HEADING = re.compile(r"^## (?P<title>.+): (?P<count>\d+) files$", re.MULTILINE)
NEW_FILE = re.compile(r'^```python title="(?P<path>.+?)"\n(?P<text>.*?)^```$', re.MULTILINE | re.DOTALL)
DIFF = re.compile(r"^```diff\n--- (?P<path>.+?)\n\+\+\+ (?P=path)\n(?P<hunks>.*?)^```$", re.MULTILINE | re.DOTALL)


def walk(title: str) -> tuple[str, int]:
    """The text of a walk and the number of files in its heading."""
    text = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = next(m for m in HEADING.finditer(text) if m["title"] == title)
    return text[found.end() :].split("\n## ")[0], int(found["count"])


def apply(text: str, root: Path) -> None:
    """Write the new files of a walk and make its changes."""
    for new in NEW_FILE.finditer(text):
        assert not (root / new["path"]).exists()
        (root / new["path"]).write_text(new["text"], encoding="utf-8")
    for diff in DIFF.finditer(text):
        changed = (root / diff["path"]).read_text(encoding="utf-8")
        for hunk in diff["hunks"].split("@@\n")[1:]:
            lines = hunk.splitlines(keepends=True)
            before, after = ("".join(line[1:] or "\n" for line in lines if line[0] in f" {sign}\n") for sign in "-+")
            assert changed.count(before) == 1, f"{diff['path']}: {changed.count(before)} places for\n{before}"
            changed = changed.replace(before, after)
        (root / diff["path"]).write_text(changed, encoding="utf-8")


def changed_files(root: Path) -> set[str]:
    """Files of the copy that the repository has not, or has otherwise."""
    made = {p.relative_to(root) for name in COPIED for p in (root / name).rglob("*") if p.is_file()}
    source = {p for p in made if "__pycache__" not in p.parts}
    return {
        str(p) for p in source
        if not (REPOSITORY / p).exists() or (root / p).read_bytes() != (REPOSITORY / p).read_bytes()
    }  # fmt: skip


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the repository, with links to the packages under the name that they are installed with."""
    root = tmp_path / "clone"
    (root / "deepsea_cosim").mkdir(parents=True)
    for name in COPIED:
        shutil.copytree(REPOSITORY / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in PACKAGES:
        target = (root if name in COPIED else REPOSITORY) / name
        (root / "deepsea_cosim" / name).symlink_to(target, target_is_directory=True)
    return root


def run(root: Path, *arguments: str, compiled: bool = False) -> str:
    """What Python prints with the packages of that folder; kernels run as plain Python unless the walk needs more."""
    environment = {**os.environ, "PYTHONPATH": str(root), "NUMBA_DISABLE_JIT": "0" if compiled else "1"}
    done = subprocess.run([sys.executable, *arguments], cwd=root, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


DIAGNOSE = """
import json, sys
from pathlib import Path
import numpy as np
from deepsea_cosim.gap.campaign.read import read
import deepsea_cosim.gap.diagnose as module
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.result.document import document
from tests.gap.oscillator import campaign, measure

if __name__ == "__main__":
    table = measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))
    said = []
    stop = StopToken(lambda: "refitting the base parameters" in said)
    path = campaign(Path(sys.argv[2]), Path(sys.argv[1]), [table])
    data = document(module.diagnose(read(path), say=said.append, processes=1, stop=stop))
    print(json.dumps({"file": module.__file__, "outliers": data["outliers"], "stages": list(data["timing"]["stages"])}))
"""


def test_a_stage(copy, toys, tmp_path):
    text, count = walk("A stage of the diagnosis")
    apply(text, copy)
    assert len(changed_files(copy)) == count
    (tmp_path / "campaign").mkdir()
    (copy / "walk.py").write_text(DIAGNOSE)
    told = json.loads(run(copy, "walk.py", str(toys), str(tmp_path / "campaign"), compiled=True))
    assert Path(told["file"]).is_relative_to(copy)
    assert told["outliers"]["o.x"] > 20, "with nothing fitted yet, friction leaves much"
    assert "readings far off" in told["stages"]


MOVE = """
import json, sys
import deepsea_cosim.mechanics.arm as module
from deepsea_cosim.mechanics.variables import ARM

arm = module.Arm(ARM.parameters(json.loads(sys.argv[1])))
for k in range(40):
    arm.step(k * 1e-3, 1e-3, 8000.0)
print(json.dumps({"file": module.__file__, "out": [x.hex() for x in arm.out.tolist()]}))
"""


def test_an_effect(copy):
    def moved(**values):
        told = json.loads(run(copy, "-c", MOVE, json.dumps(values)))
        assert Path(told["file"]).is_relative_to(copy)
        return told["out"]

    before = moved()
    text, count = walk("An effect of the arm")
    apply(text, copy)
    assert len(changed_files(copy)) == count
    assert moved() == before
    assert moved(**{"effect.tether_pull.force": 0.0}) == before
    assert moved(**{"effect.tether_pull.force": 50.0}) != before
    tests = ("tests/mechanics/test_effects.py", "tests/ssp/test_effects_catalogue.py")
    run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests, "-k", "not packed")
