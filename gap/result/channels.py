"""Which channel speaks for the gap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def leading_channel(budget: Mapping[str, Any]) -> str:
    """The channel in which effects explain most, in noise; where none has a share worth telling, the one that is
    furthest off as delivered. Empty if there is none. budget: as in diagnosis.json."""
    channels = budget["per_channel"]
    has_effects = any(p["kind"] == "effect" and not p["minor"] for p in budget["parts"])

    def weight(label: str) -> tuple[float, float]:
        c = channels[label]
        explained = max(0.0, c["calibrated"] - c["explained"]) if has_effects else 0.0
        return explained / (c["noise"] or 1e-300), c["delivered"] / (c["noise"] or 1e-300)

    return max(channels, key=weight, default="")
