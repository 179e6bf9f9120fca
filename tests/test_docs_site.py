"""The documentation as a site: it builds, and no link of it leads nowhere."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parent.parent


def test_it_builds_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    )
    assert done.returncode == 0, done.stderr
    commands = (tmp_path / "commands.html").read_text(encoding="utf-8")
    assert "cosim-gap diagnose" in commands
    reference = (tmp_path / "reference.html").read_text(encoding="utf-8")
    for name in ("simulate", "sweep", "diagnose", "build_fmus", "Session", "SteppedRun", "CosimEnv"):
        assert f"{name}</span>" in reference or f">{name}<" in reference, name
