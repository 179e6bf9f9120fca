"""Only regular files are read: a device or a pipe may never end."""

from __future__ import annotations

import stat
from pathlib import Path

from .errors import CosimError

KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
)  # fmt: skip


def require_regular(path: Path, error: type[CosimError]) -> None:
    """Raise `error` in one line for a folder, a device, a pipe or what is not there."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as fault:
        raise error(f"{path}: cannot be read ({getattr(fault, 'strerror', None) or fault})") from None
    if not stat.S_ISREG(mode):
        kind = next((name for test, name in KINDS if test(mode)), "no file")
        raise error(f"{path}: is {kind}; only regular files are read")
