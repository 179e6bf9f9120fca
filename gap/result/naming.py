"""Effects, channels and quantities as a person calls them."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.units import unit
from ..pipeline.state import State
from .numbers import listed


def plain(id: str) -> str:
    """An id as words."""
    return id.replace("_", " ")


def members(state: State, group: str) -> list[str]:
    """Ids of a group that a share is told of: those that are probable in themselves, else all that may be it."""
    inclusion = state.inclusion
    ids = [id for id, g in inclusion.group_of.items() if g == group]
    ids.sort(key=lambda id: -inclusion.effects[id])
    sure = [id for id in ids if inclusion.effects[id] >= state.problem.settings.posterior.named]
    looked_at = {id for r in state.ranked for id in r.hypothesis.ids}
    return sure or [id for id in ids if id in looked_at]


def part_name(state: State, group: str, effects: Sequence[str]) -> str:
    """A part of the budget in words: its effects, or the group where they cannot be told apart."""
    sure = [e for e in effects if state.inclusion.effects[e] >= state.problem.settings.posterior.named]
    if sure:
        return listed([plain(e) for e in sure])
    names = [plain(e) for e in effects[:3]]
    return names[0] if len(names) == 1 else f"{plain(group)} ({listed(names, word='or')})"


def shown_factor(state: State, label: str) -> tuple[float, str]:
    """Factor from a channel's unit in its FMU to the one in which it was measured, and that unit's name."""
    channel = next((c for c in state.problem.campaign.outputs if c.connector == label), None)
    if channel is None:
        return 1.0, "s"
    fmu_unit = state.problem.units.get(label, channel.unit)
    return unit(fmu_unit).factor / unit(channel.unit).factor, channel.unit
