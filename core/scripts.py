"""Processes that simulate load the user's script once more, which should not begin to work by that."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection

from .errors import UsageError

LOADED_AGAIN = 76
"""Exit code of a process that was to begin anew what its script has begun already."""


def end_if_loaded_again() -> None:
    """End this process where it is one that simulates for others and only loads their script.

    There, what the script does outside `if __name__ == "__main__":` would be done once more. Nothing else happens in
    any other process.
    """
    processes = sys.modules.get("multiprocessing.process")  # such a process has it
    if processes is not None and getattr(processes.current_process(), "_inheriting", False):
        os._exit(LOADED_AGAIN)


def check_script() -> None:
    """Raise `UsageError` where the script of this process is no file, which others could load."""
    script = getattr(sys.modules.get("__main__"), "__file__", None) or ""
    if script.startswith("<"):
        raise UsageError(f"{script}: processes that simulate load the script: write it to a file")


def unguarded(codes: Collection[int | None]) -> str | None:
    """What to say of the script of this process where processes that it started have ended so; else None."""
    if LOADED_AGAIN not in codes:
        return None
    script = getattr(sys.modules.get("__main__"), "__file__", None) or "the script"
    return (
        f"{script}: each process that simulates loads the script, and would begin its work anew: put what it does "
        'below a line `if __name__ == "__main__":`'
    )
