"""The notebooks of docs/notebooks run from their first cell to their last, and are kept without what they print."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
NOTEBOOKS = sorted((REPOSITORY / "docs" / "notebooks").glob("*.ipynb"))


LONG = ("diagnose", "sweep")
"""Half a minute of computing; what they call is tested elsewhere."""


@pytest.mark.parametrize(
    "path", [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] if p.stem in LONG else []) for p in NOTEBOOKS]
)
def test_it_runs(built, tmp_path, path):
    nbformat = pytest.importorskip("nbformat")
    client = pytest.importorskip("nbclient").NotebookClient
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.get("outputs") for cell in notebook.cells), "clear the outputs before you commit"
    (tmp_path / "build").symlink_to(built, target_is_directory=True)
    (tmp_path / "examples").symlink_to(REPOSITORY / "examples", target_is_directory=True)
    os.environ.setdefault("IPYTHONDIR", str(tmp_path / "ipython"))
    client(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [out for cell in notebook.cells for out in cell.get("outputs", ())]
    assert any("image/png" in out.get("data", {}) for out in shown)  # something is drawn
