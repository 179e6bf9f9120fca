"""What the commands share."""

from __future__ import annotations

import argparse
from typing import NoReturn


class OneLineParser(argparse.ArgumentParser):
    """A parser whose help keeps its line breaks and whose errors are one line."""

    def __init__(self, **kwargs: object):
        super().__init__(**{"formatter_class": argparse.RawDescriptionHelpFormatter, **kwargs})  # type: ignore[arg-type]

    def error(self, message: str) -> NoReturn:
        """End the process with code 2 and one line."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")
