"""A process gives up what an FMU needs not: writing anywhere but in its own folders, the network, signals to others.

By Landlock (Linux 5.13 and later, man 7 landlock), which needs no rights and cannot be taken back. Reading stays as it
is: an FMU needs libraries, and licences stand anywhere.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Sequence
from functools import cache

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
VERSION = 1
PATH_BENEATH = 1
NO_NEW_PRIVILEGES = 38

WRITE_FILE, TRUNCATE = 1 << 1, 1 << 14
MAKE_AND_REMOVE = sum(1 << bit for bit in range(4, 13))
"""Remove folders and files; make devices, folders, files, sockets, pipes, block devices, symbolic links."""
REFER = 1 << 13
TCP = 0b11
"""Bind and connect."""
SCOPES = 0b11
"""No abstract sockets, and no signals, to processes outside."""

DEVICES = ("/dev/null", "/dev/zero", "/dev/tty")
"""What everybody may write to, and libraries open."""


@cache
def landlock_version() -> int:
    """Version of the interface; 0 where there is none."""
    if not sys.platform.startswith("linux"):
        return 0
    found = int(ctypes.CDLL(None, use_errno=True).syscall(CREATE_RULESET, None, ctypes.c_size_t(0), VERSION))
    return max(0, found)


def restrict(writable: Sequence[str]) -> None:
    """From now on this process writes only into these folders, and uses no network. Raises `OSError`."""
    libc, version = ctypes.CDLL(None, use_errno=True), landlock_version()
    writes = WRITE_FILE | MAKE_AND_REMOVE | (REFER if version >= 2 else 0) | (TRUNCATE if version >= 3 else 0)
    fields = struct.pack("QQQ", writes, TCP if version >= 4 else 0, SCOPES if version >= 6 else 0)
    attributes = fields[: 8 if version < 4 else 16 if version < 6 else 24]
    rules = _checked(libc.syscall(CREATE_RULESET, attributes, ctypes.c_size_t(len(attributes)), 0))
    try:
        devices = [device for device in DEVICES if os.path.exists(device)]
        for path in (*writable, *devices):
            rights = writes & (WRITE_FILE | TRUNCATE) if path in devices else writes
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
            try:
                _checked(libc.syscall(ADD_RULE, rules, PATH_BENEATH, struct.pack("=Qi", rights, place), 0))
            finally:
                os.close(place)
        _checked(libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0))
        _checked(libc.syscall(RESTRICT_SELF, rules, 0))
    finally:
        os.close(rules)


def _checked(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return int(result)
