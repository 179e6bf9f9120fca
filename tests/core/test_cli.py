"""What a command leaves behind when its work raises: one line and a code that is not that of success."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module

import pytest
from deepsea_cosim.core.cli import exit_code
from deepsea_cosim.core.errors import Interrupted, PackageError, SimulationError


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (PackageError("p.ssp: line\nbreaks\r\nin it"), 2, "p.ssp: line breaks in it"),
        (SimulationError("stopped"), 1, "stopped"),
        (Interrupted("stopped by you"), 130, "stopped by you"),
        (OSError(36, "File name too long", "aaaa"), 2, "aaaa: File name too long"),
        (PermissionError(13, "Permission denied", "/somewhere"), 1, "/somewhere: Permission denied"),
        (OSError("of no number"), 1, "of no number"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_what_is_raised_is_one_line(capsys, error, code, told):
    def work():
        raise error

    assert exit_code("cosim-x", work) == code
    assert capsys.readouterr().err == f"cosim-x: {told}\n"


def test_what_a_file_says_commands_no_terminal(capsys):
    def work():
        print("name \x1b]0;title\x07 \u202e")
        raise PackageError("\x1b[2J" + 5000 * "long ")

    assert exit_code("cosim-x", work) == 2
    told = capsys.readouterr()
    assert told.out == "name \\x1b]0;title\\x07 \\u202e\n"
    assert told.err.startswith("cosim-x: \\x1b[2Jlong ")
    assert len(told.err) < 1100


@pytest.mark.skipif(os.name != "posix", reason="there is no SIGTERM")
def test_a_request_to_end_is_a_line_and_143():
    text = "from deepsea_cosim.core.cli import exit_code; import time; "
    text += "raise SystemExit(exit_code('cosim-x', lambda: (print(flush=True), time.sleep(60))[0]))"
    process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.readline()
    process.terminate()
    assert process.communicate(timeout=30)[1] == "cosim-x: asked to end (SIGTERM)\n"
    assert process.returncode == 143


def test_a_fault_of_our_own_is_not_hidden():
    with pytest.raises(ZeroDivisionError):
        exit_code("cosim-x", lambda: 1 // 0)


@pytest.mark.parametrize("command", ["master", "gap", "fmus", "study"])
def test_every_command_tells_its_version(capsys, command):
    main = import_module(f"deepsea_cosim.{command}.cli").main
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert "deepsea-cosim" in capsys.readouterr().out


def test_a_folder_without_a_name_is_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        import_module("deepsea_cosim.fmus.cli").main(["build", "--out", ""])
    assert ended.value.code == 2
    assert "the name of the folder is empty" in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash here")
@pytest.mark.parametrize(
    ("command", "begun", "expected"),
    [
        ("gap", "di", {"diagnose"}),
        ("master", "--sav", {"--save-state", "--save-state-every"}),
        ("master", "comp", {"compare"}),
        ("master", "compare --tol", {"--tolerance"}),
        ("master", "plant.ssp --sav", {"--save-state", "--save-state-every"}),
        ("master", "/usr/sha", {"/usr/share"}),
        ("fmus", "bu", {"build"}),
        ("study", "sw", {"sweep"}),
    ],
)
def test_a_shell_completes_it(capsys, tmp_path, command, begun, expected):
    with pytest.raises(SystemExit) as ended:
        import_module(f"deepsea_cosim.{command}.cli").main(["--print-completion", "bash"])
    assert ended.value.code == 0
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out)
    words = f"COMP_WORDS=(cosim-{command} {begun}); COMP_CWORD={len(begun.split())}"
    ask = f"source {script}; {words}; _shtab_cosim_{command}; "
    done = subprocess.run(["bash", "-c", f'{ask} echo "${{COMPREPLY[@]}}"'], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == expected


READ_NO_MORE = """
import argparse, sys
from pathlib import Path
from deepsea_cosim.core.cli import exit_code
from deepsea_cosim.core.console import conclude, on_the_way
options = argparse.Namespace(json=False, quiet=False)

def work():
    say = on_the_way(options)
    sys.stdin.readline()
    for k in range(3):
        say(f"line {k}")
    Path(sys.argv[1]).write_text("done")
    conclude(options, dict, lambda: ["all"])
    return 7

raise SystemExit(exit_code("cosim-x", work))
"""


@pytest.mark.skipif(os.name != "posix", reason="another signal tells it there")
def test_work_is_finished_though_nobody_reads_on(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", READ_NO_MORE, str(tmp_path / "file")], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
    process.stdout.close()
    process.stdin.write("\n")
    process.stdin.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 7
    assert (tmp_path / "file").read_text() == "done"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device", "/tmp"), BrokenPipeError(32, "Broken pipe")],
                         ids=["a full disk", "another pipe"])  # fmt: skip
def test_what_has_nothing_to_do_with_standard_output_is_told_there(capfd, error):
    def work():
        raise error

    assert exit_code("cosim-x", work, as_json=True) == 1
    told = capfd.readouterr()
    assert json.loads(told.out) == {"error": told.err.strip().removeprefix("cosim-x: "), "exit_code": 1}


def test_a_command_of_which_nobody_reads_what_came_out_has_done_its_work():
    text = "import sys; from deepsea_cosim.core.cli import exit_code; sys.stdin.readline(); "
    text += "raise SystemExit(exit_code('cosim-x', lambda: print('x' * 1000000)))"
    process = subprocess.Popen([sys.executable, "-c", text], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)  # fmt: skip
    process.stdout.close()
    process.stdin.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 0
