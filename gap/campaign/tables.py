"""The tables of campaign.toml: which keys each of them may have."""

from __future__ import annotations

from typing import Any

from ...core.json_schema import Keys
from ...core.toml_tables import Tables
from .campaign import CampaignError
from .keys import CAMPAIGN, CAMPAIGN_BASE, CHANNEL, EVENT, RUN

take = Tables(CampaignError)

KNOWN: dict[str, Keys] = {"": CAMPAIGN, "channel": CHANNEL, "run": RUN, "event": EVENT, "base": CAMPAIGN_BASE}
"""By the kind of table; "" is the file itself."""


def reject_unknown_keys(table: dict[str, Any], kind: str, where: str) -> None:
    """Raise `CampaignError` for a key that such a table does not have."""
    take.reject_unknown_keys(table, KNOWN[kind], where)
