"""Folders for a while: gone with their process, and where that was killed, with the next command that starts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from deepsea_cosim.core.scratch import PREFIX, make_scratch, remove_all, scratch, sweep

pytest.importorskip("fcntl")

HOLDS = """
import sys, time
from deepsea_cosim.core.scratch import make_scratch
print(make_scratch("test"), flush=True)
time.sleep(60)
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def holder(temporary) -> tuple[subprocess.Popen, Path]:
    """A process that holds a folder."""
    environment = {**os.environ, "TMPDIR": str(temporary)}
    process = subprocess.Popen([sys.executable, "-c", HOLDS], stdout=subprocess.PIPE, text=True, env=environment)
    return process, Path(process.stdout.readline().strip())


def older(folder: Path) -> None:
    os.utime(folder, (time.time() - 60.0,) * 2)


def test_a_folder_lasts_as_long_as_its_block(temporary):
    with scratch("a") as folder:
        (folder / "file").touch()
        assert folder.parent == temporary
        assert folder.name.startswith(f"{PREFIX}a-")
    assert not folder.exists()


def test_all_folders_of_a_process_are_removed(temporary):
    made = [make_scratch("a"), make_scratch("b", temporary)]
    remove_all()
    assert not any(folder.exists() for folder in made)


def test_what_a_killed_process_left_is_swept_and_nothing_of_one_that_runs(temporary):
    running, kept = holder(temporary)
    killed, left = holder(temporary)
    mine = make_scratch("mine")
    stranger = temporary / "deepsea-other"
    stranger.mkdir()
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    try:
        sweep()
        assert left.exists(), "too young to be sure"
        for folder in (kept, left, mine, stranger):
            older(folder)
        sweep()
        assert [folder.exists() for folder in (kept, left, mine, stranger)] == [True, False, True, True]
    finally:
        running.kill()
        running.wait()


def test_sweeping_never_raises(temporary, monkeypatch):
    (temporary / f"{PREFIX}file").touch()
    (temporary / f"{PREFIX}link").symlink_to("/")
    sweep()
    monkeypatch.setattr("tempfile.tempdir", str(temporary / "none"))
    sweep()
