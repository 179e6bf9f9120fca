"""What the commands share."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

from . import ending
from .console import cannot_be_written, escaping, json_text, one_line, print_into_nothing
from .errors import CosimError, Interrupted, SimulationError, UsageError, install
from .plain_numbers import plain_number, plain_whole
from .scripts import end_if_loaded_again


class OneLineParser(argparse.ArgumentParser):
    """A parser whose help keeps its line breaks and whose errors are one line."""

    def __init__(self, **kwargs: object):
        super().__init__(**{"formatter_class": argparse.RawDescriptionHelpFormatter, **kwargs})  # type: ignore[arg-type]

    def error(self, message: str) -> NoReturn:
        """End the process with code 2 and one line."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


class _Versions(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from .versions import line

        try:
            print(line(), flush=True)
        except OSError as error:
            sys.stdout = open(os.devnull, "w")  # noqa: SIM115
            parser.exit(1, f"{parser.prog}: {error.strerror}\n")
        parser.exit()


SHELLS = ("bash", "zsh", "tcsh")

Words = Callable[[], Mapping[str, argparse.ArgumentParser]]


class _Completion(argparse.Action):
    def __init__(self, *args: Any, words: Words = dict, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._words = words

    def __call__(self, parser: argparse.ArgumentParser, *asked: object) -> NoReturn:
        import shtab

        shell = str(asked[1])  # (namespace, shell, option)
        words = self._words() if shell == "bash" else {}  # others would complete no options behind a file any more
        if words:
            parser._actions.remove(next(action for action in parser._actions if not action.option_strings))
            below = parser.add_subparsers()
            for word, one in words.items():
                below.add_parser(word, parents=[one], add_help=False, help=one.description)
        _complete_files(parser, shtab.FILE)
        print(shtab.complete(parser, shell))
        if words:
            name = parser.prog.replace("-", "_")
            print(f"_shtab_{name}_pos_0_COMPGEN=_shtab_compgen_files")  # the first word may be a file, too
        parser.exit()


def _complete_files(parser: argparse.ArgumentParser, what: object) -> None:
    """Let what takes a path, there and in commands below, complete names of files."""
    for action in parser._actions:
        if action.type in (Path, file, folder):
            action.complete = what  # type: ignore[attr-defined]
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                _complete_files(below, what)


def add_version(p: argparse.ArgumentParser, words: Words = dict) -> None:
    """The options that print what is installed, and a script that completes the command in a shell.

    words: gives the parsers of first words that may stand for the command's first argument.
    """
    p.add_argument("--version", action=_Versions, nargs=0, help="print the versions and exit")
    p.add_argument(
        "--print-completion", action=_Completion, words=words, choices=SHELLS, metavar="SHELL",
        help=f"print a script that completes this command in {', '.join(SHELLS)}, and exit",
    )  # fmt: skip


def file(text: str) -> Path:
    """A file that is named; an empty name, as of a variable of the shell that is not set, would be this folder."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the file is empty")
    return Path(text)


def folder(text: str) -> Path:
    """An option's folder; an empty name, as of a variable of the shell that is not set, is none."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the folder is empty")
    return Path(text)


def positive(text: str) -> int:
    """An option's number of things, at least 1."""
    try:
        value = plain_whole(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: it has to be at least 1")
    return value


def natural(text: str) -> int:
    """An option's whole number, 0 or more."""
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number of at least 0")
    return int(text)


def seconds(text: str) -> float:
    """An option's time, above 0."""
    try:
        value = plain_number(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds") from None
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text}: it has to be positive")
    return value


def decimal(text: str) -> float:
    """An option's number."""
    try:
        return plain_number(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_processes(p: argparse.ArgumentParser, dask: bool = True) -> None:
    """The options that say where many runs are simulated."""
    p.add_argument("--processes", metavar="N", type=positive, help="simulation processes (default: one per core)")
    if dask:
        p.add_argument("--dask", metavar="ADDRESS", help="simulate on the Dask cluster with this scheduler")


def need(extra: str, *modules: str) -> None:
    """Raise `UsageError` when a library of that extra is not installed."""
    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        raise UsageError(f"this needs {', '.join(missing)}: {install(extra)}")


def exit_code(command: str, work: Callable[[], int], interrupted: str = "interrupted", as_json: bool = False) -> int:
    """The exit code of the work; a user's mistake is one line and 2, a run that had to stop 1, Ctrl-C 130,
    SIGTERM 143, SIGHUP 129.

    as_json: the line is an object on standard output, too.
    """
    end_if_loaded_again()
    with escaping(), ending.terminable():
        from .figures import settle_matplotlib
        from .scratch import sweep

        sweep()
        with suppress(OSError, RuntimeError):  # no home, or no place for what is temporary
            settle_matplotlib()
        return _exit_code(command, work, interrupted, as_json)


def _exit_code(command: str, work: Callable[[], int], interrupted: str, as_json: bool) -> int:
    def failed(text: str, code: int) -> int:
        print(f"{command}: {one_line(text)}", file=sys.stderr)
        if as_json:
            print(json_text({"error": one_line(text), "exit_code": code}))
        return code

    def ended() -> int:
        return failed(interrupted.replace("interrupted", ending.told()), ending.code())

    try:
        code = work()
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except OSError as error:
        refused = cannot_be_written(sys.stdout)
        if refused:
            print_into_nothing()
        if isinstance(error, BrokenPipeError) and (refused or cannot_be_written(sys.stderr)):
            return 0  # nobody reads on, as after `| head`
        if error.errno == errno.EBADF:
            return failed("an FMU, most likely, has closed files of this process; --isolate says which", 1)
        place = f"{error.filename}: " if error.filename else ""
        return failed(f"{place}{error.strerror or error}", 2 if error.errno == errno.ENAMETOOLONG else 1)
    except CosimError as error:
        by_request = ending.asked() or isinstance(error, Interrupted)
        code = ending.code() if by_request else 1 if isinstance(error, SimulationError) else 2
        return failed(str(error), code)
    except KeyboardInterrupt:
        return ended()
    except MemoryError:
        return failed("there is not enough memory for this", 1)
    except Exception:
        if not ending.asked():
            raise
        return ended()


def end_with(main: Callable[[], int], last: Callable[[], object] = lambda: None) -> NoReturn:
    """A console script: run its main function, then `last`, remove what it needed for a while, and end the process at
    once.

    FMUs that are still loaded may crash while Python shuts down, and after a diagnosis that takes a second.
    """
    for name in ("stdout", "stderr"):  # closed by the caller: print into nothing
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        getattr(sys, name).reconfigure(errors="replace")
    try:
        code = main()
        sys.stdout.flush()
    except OSError as error:  # what is printed cannot be written; nobody reads on, as after `| head`, is no fault
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
        code = int(not isinstance(error, BrokenPipeError))
    except SystemExit as stop:
        code = ending.code_of(stop)
    except KeyboardInterrupt:  # before or after what the command itself takes care of
        ending.take_no_more()
        code = ending.tell(Path(sys.argv[0]).stem)
    ending.take_no_more()
    last()
    ending.put_away()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
