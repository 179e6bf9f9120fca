"""Requests to end a command."""

import signal
import subprocess
import sys
import threading
from textwrap import indent

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


def test_a_process_that_is_starting_is_not_ended_by_ctrl_c(listening):
    with starting_processes():
        child = subprocess.Popen([sys.executable, "-c", CHILD], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert child.stdout.readline() == "ready\n"
    child.send_signal(signal.SIGINT)
    said, error = child.communicate("\n", timeout=60.0)
    assert (said, error, child.returncode) == ("goes on\n", "", 0)


@pytest.fixture
def listening():
    """To Ctrl-C, which whoever runs the tests may ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_reaches_who_starts_processes_afterwards(listening):
    reached = []

    def interrupted_meanwhile():
        with starting_processes():
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)  # another thread may listen
            reached.append(True)

    with pytest.raises(KeyboardInterrupt):
        interrupted_meanwhile()
    assert reached


def test_whoever_starts_processes_listens_as_before():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set())
    with starting_processes():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set())
    assert signal.pthread_sigmask(signal.SIG_BLOCK, set()) == before


COMMAND = """
import os, signal, sys, time
from deepsea_cosim.core.cli import end_with, exit_code

signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may ignore them
signal.signal(signal.SIGHUP, signal.SIG_DFL)

def strike(*numbers):
    for number in numbers:
        os.kill(os.getpid(), number)
    time.sleep(10.0)

def work():
{work}

end_with(lambda: exit_code("command", work))
"""


def commanded(work):
    """(exit code, what is said) of a command that does this."""
    script = COMMAND.format(work=indent(work, "    "))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60.0)
    return done.returncode, done.stderr.strip()


@pytest.mark.parametrize(("name", "code", "said"), [
    ("SIGINT", 130, "command: interrupted"), ("SIGTERM", 143, "command: asked to end (SIGTERM)"),
    ("SIGHUP", 129, "command: asked to end (SIGHUP)"),
])  # fmt: skip
def test_requests_end_a_command_in_a_line(name, code, said):
    assert commanded(f"strike(signal.{name})") == (code, said)
    assert commanded(f"strike(signal.{name}, signal.{name})") == (code, said), "by a terminal and by who passes it on"
    swallowed = f"try:\n    strike(signal.{name})\nexcept BaseException:\n    raise ImportError('failed')"
    assert commanded(swallowed) == (code, said), "a library that is being loaded makes another error of it"


@pytest.mark.parametrize(("name", "code", "said"), [
    ("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "asked to end (SIGTERM)"),
])  # fmt: skip
def test_a_request_before_a_command_takes_care_of_it_is_a_line_too(name, code, said):
    early = COMMAND.replace("end_with(", "from deepsea_cosim.core import scratch\nscratch.sweep = work\nend_with(")
    script = early.format(work=f"    strike(signal.{name})")
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60.0)
    assert (done.returncode, done.stderr) == (code, f"-c: {said}\n")


def test_an_error_of_a_command_that_was_asked_to_end_has_that_exit_code():
    work = "from deepsea_cosim.core.errors import SimulationError\ntry:\n    strike(signal.SIGTERM)\n"
    assert commanded(f"{work}finally:\n    raise SimulationError('nothing to say')") == (143, "command: nothing to say")


def test_a_fault_of_ours_is_none_of_the_users():
    code, said = commanded("raise ImportError('initialization failed')")
    assert code == 1
    assert "Traceback" in said


@pytest.mark.parametrize("name", ["SIGINT", "SIGHUP"])
def test_what_is_ignored_stays_so(name):
    """As of a command in the background of a shell, or of one that nohup starts."""
    script = f"signal.signal(signal.{name}, signal.SIG_IGN)"
    whole = COMMAND.replace("def work", f"{script}\n\ndef work").replace("10.0", "0.1")
    done = subprocess.run([sys.executable, "-c", whole.format(work=f"    strike(signal.{name})\n    return 0")],
                          capture_output=True, text=True, timeout=60.0)  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


HALF_MADE = """
import os, signal
from deepsea_cosim.core.ending import terminable

class Half:
    def __init__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        signal.sigtimedwait([], 5.0)
        self.made = True

    def __del__(self):
        assert self.made

class Whole:
    def __del__(self):
        raise ValueError("told")

with terminable():
    try:
        Half()
    except KeyboardInterrupt:
        print("asked to end")
Whole()
"""


def test_what_was_half_made_says_nothing_as_it_is_put_away():
    """A library's object that was being made as the signal came; afterwards such errors are told again."""
    done = subprocess.run([sys.executable, "-c", HALF_MADE], capture_output=True, text=True, timeout=60.0)
    assert (done.stdout, done.returncode) == ("asked to end\n", 0)
    assert "made" not in done.stderr
    assert "ValueError: told" in done.stderr
