"""Requests to end a command."""

import os
import signal
import subprocess
import sys

import pytest
from deepsea_cosim.core.ending import starting_processes

pytestmark = pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="signals cannot be held back here")

CHILD = """
import sys
print("ready", flush=True)
sys.stdin.readline()
from deepsea_cosim.core.ending import ignore_interrupts
ignore_interrupts()
print("goes on", flush=True)
"""


def test_a_process_that_is_starting_is_not_ended_by_ctrl_c():
    with starting_processes():
        child = subprocess.Popen([sys.executable, "-c", CHILD], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert child.stdout.readline() == "ready\n"
    child.send_signal(signal.SIGINT)
    said, error = child.communicate("\n", timeout=60.0)
    assert (said, error, child.returncode) == ("goes on\n", "", 0)


def test_ctrl_c_reaches_who_starts_processes_afterwards():
    reached = []

    def interrupted_meanwhile():
        with starting_processes():
            os.kill(os.getpid(), signal.SIGINT)
            reached.append(True)

    with pytest.raises(KeyboardInterrupt):
        interrupted_meanwhile()
    assert reached


def test_whoever_starts_processes_listens_as_before():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set())
    with starting_processes():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())
    assert signal.pthread_sigmask(signal.SIG_BLOCK, set()) == before
