"""Runs of a campaign that are taken for each other: by their names, or because one is a copy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

from .campaign import CampaignError, Run


def distinguish(runs: Sequence[Run], tables: Sequence[dict[str, Any]], path: Path) -> None:
    """Give runs of the same name that of their file with its folder; every run is told by its name."""
    count = Counter(r.name for r in runs)
    for run, table in zip(runs, tables, strict=True):
        if count[run.name] > 1 and "name" not in table and "file" in table:
            run.name = str(Path(table["file"]).with_suffix("").as_posix())
    name, times = Counter(r.name for r in runs).most_common(1)[0]
    if times > 1:
        raise CampaignError(f"{path}: two runs are called '{name}'; give them names of their own with 'name'")


def copies(runs: Sequence[Run], outputs: set[str]) -> Iterator[tuple[Run, Run]]:
    """(an earlier run, the run that holds the same readings), a pair for each run that is such a copy.

    A command may be the same in all of them. Runs need not have the same channels: those that both have count. The
    time that this takes is linear in runs and grows with the square of the different sets of channels.
    """
    digests = [{c: sha256(v.tobytes()).digest() for c, (_, v) in r.series.items() if c in outputs} for r in runs]
    by_channels: dict[frozenset[str], list[int]] = {}
    for k, of_run in enumerate(digests):
        by_channels.setdefault(frozenset(of_run), []).append(k)
    earlier: dict[int, int] = {}
    for a, b in product(by_channels, repeat=2):
        if common := sorted(a & b):
            contents = {k: tuple(digests[k][c] for c in common) for k in (*by_channels[a], *by_channels[b])}
            first = {contents[k]: k for k in reversed(by_channels[a])}
            for k in by_channels[b]:
                if (found := first.get(contents[k], k)) < k:
                    earlier[k] = min(found, earlier.get(k, found))
    for again, found in sorted(earlier.items()):
        yield runs[found], runs[again]
