"""The tables of campaign.toml: which keys each of them may have."""

from __future__ import annotations

from typing import Any

from ...core.toml_tables import Tables
from .campaign import CampaignError

take = Tables(CampaignError)

FILE_KEYS = ("delimiter", "decimal", "time_unit", "start")
"""How run files are written: for all of them at the top, or in a run."""

KNOWN = {
    "": ("name", "system", "effects", "channel", "run", "base", "accept", *FILE_KEYS),
    "channel": (
        "column", "connector", "unit", "noise_std", "role", "clock_jitter", "model_form_scatter", "faulty_readings",
        "scale",
    ),
    "run": ("file", "parameters", "use", "event", "stop_time", "name", *FILE_KEYS),
    "event": ("connector", "target", "within", "after", "until", "first", "std", "time", "at_most", "at_least"),
    "base": ("parameter", "tolerance"),
}  # fmt: skip


def reject_unknown_keys(table: dict[str, Any], kind: str, where: str) -> None:
    """Raise `CampaignError` for a key that such a table does not have."""
    take.reject_unknown_keys(table, KNOWN[kind], where)
