"""Commands called in this process."""

from __future__ import annotations


def code(main, arguments):
    """The exit code of a command's `main`, also where the parser ends the process."""
    try:
        return main(arguments)
    except SystemExit as stop:
        return stop.code
