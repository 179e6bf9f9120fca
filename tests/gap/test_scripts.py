"""Scripts of users that start processes: what is told where they begin to work whenever they are loaded."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ..toys import package
from .oscillator import campaign, measure

REPOSITORY = Path(__file__).parent.parent.parent

RUNS = """
from deepsea_cosim.master.parallel.pool import Job, Pool
with Pool(Path({spring!r}), processes=2) as pool:
    print(len(pool.run([Job(("o.x",), 1.0, 0.1)] * 3)), "runs")
"""
SWEEP = """
from deepsea_cosim.study.sweep.metrics import parse_metric
from deepsea_cosim.study.sweep.run import Settings, sweep
found = sweep(Path({spring!r}), [{{"o.k": 40.0}}, {{"o.k": 80.0}}], Settings((parse_metric("final(o.x)"),)),
              Path({out!r}), processes=2)
print(len(found), "runs")
"""
DIAGNOSIS = """
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.problem.stop import StopToken
diagnose(read(Path({campaign!r})), processes=2)
"""
COMMAND = """
from deepsea_cosim.gap.cli import main
raise SystemExit(main(["diagnose", {campaign!r}, "--out", {out!r}, "--quiet", "--processes", "2"]))
"""


@pytest.fixture(scope="module")
def places(toys, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scripts")
    path = campaign(folder, toys, [measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))])
    spring = package(folder / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=1.0)
    return {"spring": str(spring), "campaign": str(path)}


def ran(script, *arguments, **options):
    """What a script printed: a finished process."""
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    return subprocess.run(
        [sys.executable, *([script] if script else []), *arguments], capture_output=True, text=True, timeout=300,
        env=environment, check=False, **options,
    )  # fmt: skip


def written(path, text, guarded):
    head = "from pathlib import Path\n"
    body = "".join(f"    {line}\n" for line in text.strip().splitlines())
    path.write_text(f'{head}if __name__ == "__main__":\n{body}' if guarded else head + text)
    return str(path)


@pytest.mark.parametrize("text", [RUNS, SWEEP, DIAGNOSIS, COMMAND], ids=["runs", "sweep", "diagnosis", "command"])
def test_a_script_without_a_guard_is_told_what_it_lacks(places, tmp_path, text):
    text = text.format(**places, out=str(tmp_path / "out"))
    script = written(tmp_path / "mine.py", text, guarded=False)
    done = ran(script)
    assert done.returncode != 0
    last = done.stderr.strip().splitlines()[-1]
    assert script in last
    assert 'if __name__ == "__main__":' in last
    assert done.stderr.count("Traceback") == (text.count("main(") == 0)  # that of the script itself, where it has one


@pytest.mark.parametrize("text", [RUNS, SWEEP], ids=["runs", "sweep"])
def test_a_script_with_a_guard_runs(places, tmp_path, text):
    script = written(tmp_path / "mine.py", text.format(**places, out=str(tmp_path / "out")), guarded=True)
    done = ran(script)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[0] == ("3" if text == RUNS else "2")


def test_a_script_that_is_no_file(places, tmp_path):
    text = Path(written(tmp_path / "mine.py", RUNS.format(**places), guarded=True)).read_text()
    done = ran("", "-", input=text, cwd=tmp_path)
    assert done.returncode != 0
    assert "write it to a file" in done.stderr.strip().splitlines()[-1]
    assert done.stderr.count("Traceback") == 1
