"""The process that tries mutants: a line of JSON on standard output for each."""

from __future__ import annotations

import json
import os
import random
import resource
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

from deepsea_cosim.core.console import one_line
from deepsea_cosim.core.errors import CosimError

from .targets import TARGETS, Target

MEMORY = 6 << 30
"""Bytes that the process may have, so that a mutant does not take the machine down."""


def attempt(target: Target, mutant: bytes) -> tuple[str, str]:
    """(outcome, what was said)."""
    with tempfile.TemporaryDirectory(prefix="fuzz_", ignore_cleanup_errors=True) as name:
        folder = Path(name) / "in"
        folder.mkdir()
        try:
            target.act(folder, mutant)
        except CosimError as error:
            text = one_line(str(error))  # as commands print it
            return ("refused", text) if text.strip() else ("failed", "refused without a word")
        except Exception:
            return "failed", traceback.format_exc()
        finally:
            left = [p.name for p in Path(name).iterdir() if p.name != "in"]
        return ("failed", f"written outside of its folder: {left}") if left else ("ran", "")


def main() -> None:
    name, seed, first, count, place = sys.argv[1], *map(int, sys.argv[2:5]), sys.argv[5]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    said = os.dup(1)  # FMUs and libraries print what they like
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    target = TARGETS[name]()
    for k in range(first, count):
        mutant = target.mutate(random.Random(f"{name} {seed} {k}"), target.content)
        Path(f"{place}.{k}").write_bytes(mutant)
        outcome, text = attempt(target, mutant)
        if outcome != "failed":
            Path(f"{place}.{k}").unlink()
        os.write(said, (json.dumps({"outcome": outcome, "said": text}) + "\n").encode())


if __name__ == "__main__":
    main()
