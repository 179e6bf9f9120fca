"""How much a campaign may be, seen before any of its files is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...core.regular import require_regular
from ..settings import FILE_LIMITS
from .campaign import CampaignError
from .tables import reject_unknown_keys, take


def check_amount(data: dict[str, Any], path: Path) -> None:
    """Raise `CampaignError` for more runs or larger files than are taken, for a file that is not there and for a key
    that no run has: reading what is before it could take minutes."""
    tables = take.tables(data, str(path), "run")
    most = _limit(data, path, "max_runs", FILE_LIMITS.most_runs)
    if len(tables) > most:
        raise CampaignError(
            f"{path}: {len(tables)} runs; {most:g} are taken at most, for each is simulated hundreds of times: "
            f"max_runs = {len(tables)} at the top takes them all"
        )
    size = 0.0
    for i, table in enumerate(tables, 1):
        where = f"{path}: run {i}"
        reject_unknown_keys(table, "run", where)
        if "file" in table:
            file = take.file(table, where, "file", path.parent)
            require_regular(file, CampaignError)
            size += file.stat().st_size / FILE_LIMITS.megabyte
    most = _limit(data, path, "max_megabytes", FILE_LIMITS.most_megabytes)
    if size > most:
        raise CampaignError(
            f"{path}: the run files have {size:.3g} MB; {most:g} are taken at most, for all are held in memory: "
            f"max_megabytes = {size + 1.0:.0f} at the top takes them all"
        )


def _limit(data: dict[str, Any], path: Path, key: str, usual: float) -> float:
    most = take.number(data, str(path), key, usual)
    if not most > 0.0:
        raise CampaignError(f"{path}: {key} = {most:g} has to be positive")
    return most
