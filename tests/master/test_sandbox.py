"""What an FMU may do in a sandbox, and what its process may tell the master."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim import simulate
from deepsea_cosim.master.isolation import plain_pickle
from deepsea_cosim.master.isolation.sandbox import landlock_version

from benchmarks import native, rogue

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

needs_landlock = pytest.mark.skipif(not landlock_version(), reason="there is no Landlock here")


@needs_landlock
def test_writes_go_into_its_own_folders_only(tmp_path):
    text = f"""
from deepsea_cosim.master.isolation.sandbox import restrict
from pathlib import Path
own, other = Path({str(tmp_path / "own")!r}), Path({str(tmp_path / "other")!r})
own.mkdir(); other.mkdir(); (other / "file").write_text("kept")
restrict([str(own)])
(own / "a").write_text("x"); (own / "folder").mkdir(); (own / "a").replace(own / "b"); open("/dev/null", "w").write("x")
print((other / "file").read_text())
for act in (
    lambda: (other / "new").write_text("x"),
    lambda: (other / "file").unlink(),
    lambda: (own / "b").replace(other / "b"),
    lambda: (other / "file").write_text("x"),
    lambda: (other / "folder").mkdir(),
):
    try:
        act()
        print("could")
    except OSError:
        print("could not")
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n") == ["kept", *["could not"] * 5, ""]


@needs_landlock
def test_no_network_and_no_signals_to_others():
    text = """
import os, signal, socket
from deepsea_cosim.master.isolation.sandbox import landlock_version, restrict
listener = socket.create_server(("127.0.0.1", 0))
address = listener.getsockname()
restrict([])
try:
    socket.create_connection(address)
    print("connected")
except PermissionError:
    print("no network")
try:
    os.kill(os.getppid(), 0)
    print("sent")
except PermissionError:
    print("no signals")
print(landlock_version())
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.split("\n")
    version = int(done[2])
    assert done[0] == ("no network" if version >= 4 else "connected")
    assert done[1] == ("no signals" if version >= 6 else "sent")


@pytest.mark.parametrize(
    ("how", "where", "way", "verdict", "said"),
    [
        ("_exit", "fmi2DoStep", "plain", "told", "ended the whole process (exit code 7) in doStep at t = 0.3 s"),
        ("_exit", "fmi2Instantiate", "plain", "told", "(exit code 7) in being instantiated"),
        ("thread", "fmi2DoStep", "plain", "told", "a thread that an FMU has started crashed (SIGSEGV)"),
        ("descriptors", "fmi2DoStep", "plain", "told", "has closed files of this process; --isolate says which"),
        pytest.param("write", "fmi2DoStep", "isolate", "runs", "", id="write isolated"),
        pytest.param(
            *("write", "fmi2DoStep", "sandbox", "told", "'rogue', doStep at t = 0.3 s: the FMU returned fmi2Error"),
            marks=needs_landlock,
        ),
    ],
)  # fmt: skip
def test_an_fmu_that_misbehaves(how, where, way, verdict, said):
    with tempfile.TemporaryDirectory() as name:
        found = rogue.attempt(Path(name), how, where, way)
    assert (found.verdict, found.wrote) == (verdict, how == "write" and way == "isolate")
    assert said in found.said


def test_a_percent_sign_in_a_message_is_text(tmp_path):
    log = tmp_path / "out" / "said.txt"
    simulate(rogue.package(tmp_path, "percent", "fmi2DoStep"), tmp_path / "out", log="said.txt")
    assert "100 % of %n and %-5n" in log.read_text()


def test_values_come_from_an_fmus_process_and_nothing_that_runs():
    value = ("done", [1.5, "text", b"bytes", None, True, {"a": (1, 2)}, np.arange(3.0), np.float64(2.0)])
    kind, found = plain_pickle.loads(pickle.dumps(value))
    assert kind == "done"
    assert found[:6] == value[1][:6]
    assert found[6].tolist() == [0.0, 1.0, 2.0]

    class Evil:
        def __reduce__(self):
            return os.system, ("true",)

    with pytest.raises(pickle.UnpicklingError, match="system is no plain value"):
        plain_pickle.loads(pickle.dumps(("done", Evil())))
