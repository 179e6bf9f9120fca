"""Libraries that an FMU brings beside its own, which does not say where they lie (no $ORIGIN in its rpath)."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

LACKING = re.compile(r"([^\s:/]+\.so[.\d]*): cannot open shared object file")


class Siblings:
    """Those of the FMU in a folder; each is loaded at most once."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._tried: set[str] = set()

    def load(self, error: str) -> bool:
        """Load the library that a loader's message says is missing, and what that needs itself; whether it was there.

        A library that needs it finds it then by the name that it has in itself (SONAME).
        """
        found = LACKING.search(error)
        path = self.find(found[1]) if found else None
        if found is None or path is None or found[1] in self._tried:
            return False
        self._tried.add(found[1])
        while True:
            try:
                ctypes.CDLL(str(path))
                return True
            except OSError as again:
                if not self.load(str(again)):
                    return False

    def find(self, name: str) -> Path | None:
        """Where in the FMU a library lies, by its file's name."""
        places = (p for part in ("binaries", "resources") for p in sorted((self.folder / part).rglob(name)))
        return next((p for p in places if p.is_file()), None)

    def folders(self, error: str) -> list[str]:
        """All folders of the FMU that hold libraries, where a loader's message says that one of these is missing."""
        found = LACKING.search(error)
        if found is None or self.find(found[1]) is None:
            return []
        files = (p for part in ("binaries", "resources") for p in sorted((self.folder / part).rglob("*.so*")))
        return list(dict.fromkeys(str(p.parent) for p in files))

    def remedy(self, error: str) -> str:
        """What to say besides a loader's message of a library that is missing all the same."""
        found = LACKING.search(error)
        path = self.find(found[1]) if found else None
        if path is None:
            return ""
        return (
            f"; {path.relative_to(self.folder)} of the FMU is called so, but does not say it in itself (SONAME): "
            "--isolate has it found"
        )
