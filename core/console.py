"""What a command says in the end: lines for people or, with --json, one object for programs."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any, TextIO, cast

LONGEST = 1000
"""Characters of a message."""

_CONTROLS = {
    code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
    for code in (*range(32), *range(127, 160), *range(0x202A, 0x202F), *range(0x2066, 0x206A), 0x200E, 0x200F)
    if chr(code) not in "\n\r\t"
}
"""Control characters, and those that turn the direction of writing."""


def add_output(p: argparse.ArgumentParser, quiet: bool = True) -> None:
    """The options that say how much of what a command has to say is printed, and in which form."""
    if quiet:
        p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    p.add_argument(
        "--json", action="store_true",
        help="print one JSON object instead of text, also where it failed: {\"error\": ..., \"exit_code\": ...}",
    )  # fmt: skip


def conclude(
    options: argparse.Namespace, content: Callable[[], Mapping[str, Any]], lines: Callable[[], Iterable[str]]
) -> None:
    """Print what came of a command: `content` with --json, else `lines`, nothing with --quiet."""
    if options.json:
        print(json_text(content()))
    elif not getattr(options, "quiet", False):
        for line in lines():
            print(line)


def on_the_way(options: argparse.Namespace) -> Callable[[str], None]:
    """What prints a line while a command works, on standard output: nothing with --quiet or --json."""
    if options.json or getattr(options, "quiet", False):
        return lambda text: None
    return _say_while_read


def _say_while_read(text: str) -> None:
    """Print a line; where nobody reads on, as after `| head`, the work goes on all the same."""
    try:
        print(f"  {text}", flush=True)
    except BrokenPipeError:
        print_into_nothing()


def print_into_nothing() -> None:
    """From now on what is printed on standard output goes nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def cannot_be_written(stream: object) -> bool:
    """Whether a standard stream of a command has refused what was written to it."""
    return bool(getattr(stream, "refused", False))


class Escaped:
    """A stream in which control characters are written as \\x1b and the like, for names and messages of FMUs and
    files may hold commands to a terminal. Line ends and what a progress bar needs go through."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self.refused = False
        """Whether it could not be written to: nobody reads on, or a disk is full."""

    def write(self, text: str) -> int:
        """See `TextIO.write`."""
        with self._noting():
            self._stream.write(escaped(text))
        return len(text)

    def flush(self) -> None:
        """See `TextIO.flush`."""
        with self._noting():
            self._stream.flush()

    @contextmanager
    def _noting(self) -> Iterator[None]:
        try:
            yield
        except OSError:
            self.refused = True
            raise

    def writelines(self, lines: Iterable[str]) -> None:
        """See `TextIO.writelines`."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def escaping() -> Iterator[None]:
    """Around a command: what it prints is `Escaped`."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (cast(TextIO, Escaped(s)) if s is not None else s for s in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def escaped(text: str) -> str:
    """A text with its control characters as people write them."""
    return text.translate(_CONTROLS)


def in_line(text: str) -> str:
    """A text with a stranger's names, its line ends as \\n: a name cannot write a line of its own."""
    return text.replace("\r", "\\r").replace("\n", "\\n")


def one_line(text: str) -> str:
    """A message as one line of a length that can be read."""
    line = " ".join(text.splitlines())
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"


def json_text(value: Any) -> str:
    """Strict JSON of a value of mappings, lists, paths and numbers."""
    return json.dumps(plain(value), indent=1, allow_nan=False)


def strict_json(value: Any) -> bytes:
    """The same for a file, in UTF-8, for values that may be large."""
    import orjson

    try:
        return orjson.dumps(value, default=plain, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
    except TypeError:  # a text that is no Unicode
        return json_text(value).encode() + b"\n"


def plain(value: Any) -> Any:
    """For JSON: numbers that are none become null, paths texts, arrays and numbers of numpy Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return None if isinstance(value, float) and not isfinite(value) else value
