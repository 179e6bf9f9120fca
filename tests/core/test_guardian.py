"""A command in a process of its own, and the one that waits for it."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")

SCRIPT = """
import os, signal, sys, time
from deepsea_cosim.core.guardian import guarded, tell

for name in ("SIGTERM", "SIGHUP"):  # whoever runs the tests may ignore them
    signal.signal(getattr(signal, name), signal.SIG_DFL)

def main():
    {main}

sys.exit(guarded("command", main, lambda what, results, time: what))
"""


def guarded(main):
    """(exit code, what is said) of a command that does this."""
    environment = {k: v for k, v in os.environ.items() if k != "DEEPSEA_COSIM_GUARDIAN"}
    done = subprocess.run([sys.executable, "-c", SCRIPT.format(main=main)], env=environment, capture_output=True,
                          text=True, timeout=60.0)  # fmt: skip
    return done.returncode, done.stderr.strip()


@pytest.mark.parametrize("code", [0, 1, 2, 143])
def test_the_exit_code_of_a_command_is_handed_on(code):
    assert guarded(f"return {code}") == (code, "")
    assert guarded(f"sys.exit({code})") == (code, "")


def test_a_command_that_ends_without_a_word_is_told():
    assert guarded("os._exit(0)") == (1, "command: an FMU ended the whole process (exit code 0)")
    assert guarded("os.kill(os.getpid(), signal.SIGSEGV)") == (1, "command: an FMU crashed (SIGSEGV)")
    said = "command: the run was killed (SIGKILL), by somebody or for lack of memory"
    assert guarded("os.kill(os.getpid(), signal.SIGKILL)") == (1, said)


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_request_to_end_that_comes_before_the_command_listens(name, code):
    """It is passed on to the command's process, which dies of it."""
    assert guarded(f"os.kill(os.getppid(), signal.{name}); time.sleep(50)") == (code, f"command: asked to end ({name})")


def test_a_signal_that_nobody_sent_is_the_commands_own():
    assert guarded("signal.raise_signal(signal.SIGTERM)") == (1, "command: an FMU crashed (SIGTERM)")
