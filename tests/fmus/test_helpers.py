"""Processes that help to build FMUs: what fails in them is a line, and they end with the build."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Event

import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.fmus.helpers import run_python, side_by_side

IMPORT = "from deepsea_cosim.fmus.helpers import run_python"


def test_the_last_line_of_what_fails_is_told():
    with pytest.raises(PackageError, match=r"^it cannot be built: ValueError: no$"):
        run_python(["-c", "raise ValueError('no')"], dict(os.environ), "it cannot be built")
    with pytest.raises(PackageError, match=r"the process ended with code -9$"):
        run_python(["-c", "import os; os.kill(os.getpid(), 9)"], dict(os.environ), "it cannot be built")


def sleep(seconds):
    run_python(["-c", f"import time; time.sleep({seconds})"], dict(os.environ), "it cannot sleep")
    return seconds


def test_results_come_in_the_order_of_what_they_are_of():
    assert list(side_by_side(sleep, [0.3, 0.0, 0.1])) == [0.3, 0.0, 0.1]


def test_others_end_when_one_fails():
    begun = Event()

    def work(seconds):
        if seconds:
            begun.set()
            return sleep(seconds)
        begun.wait()
        raise PackageError("no")

    begin = time.monotonic()
    with pytest.raises(PackageError, match="no"):
        list(side_by_side(work, [0, 100]))
    assert time.monotonic() - begin < 50.0
    assert list(side_by_side(sleep, [0.0])) == [0.0], "the next build is another one"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux ends processes with their parent")
def test_they_end_with_a_killed_build(tmp_path):
    file = tmp_path / "pid"
    helper = f"import os, time; print(os.getpid(), file=open({str(file)!r}, 'w'), flush=True); time.sleep(100)"
    script = f"import os; {IMPORT}; run_python(['-c', {helper!r}], dict(os.environ), 'no')"
    build = subprocess.Popen([sys.executable, "-c", script])
    by = time.monotonic() + 60.0
    while not (file.exists() and file.read_text().endswith("\n")):
        assert time.monotonic() < by
        time.sleep(0.05)
    helper = int(file.read_text())
    build.send_signal(signal.SIGKILL)
    build.wait()
    while Path(f"/proc/{helper}").exists():
        assert time.monotonic() < by
        time.sleep(0.05)


def test_what_they_put_into_temporary_folders_goes_with_them(tmp_path, monkeypatch):
    """Also what a library makes there and does not remove, as where it was killed."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    told = tmp_path / "told"
    made = f"import tempfile; open({str(told)!r}, 'w').write(tempfile.mkdtemp())"
    run_python(["-c", made], dict(os.environ), "it cannot make a folder")
    own, *inside = Path(told.read_text()).relative_to(tmp_path).parts
    assert own.startswith("deepsea-cosim-helper-"), "which the next command removes if this one is killed"
    assert inside
    assert not (tmp_path / own).exists()
