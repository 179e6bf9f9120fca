"""Names of effects in answers and diagnoses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import permutations

Names = tuple[str, ...]


def plain(name: str) -> tuple[str, str]:
    """Id and channel of an effect: "sensor_bias(arm.x_h)", "sensor_bias:arm.x_h", "sensor_bias" and the like."""
    match = re.match(r"\s*([A-Za-z_]\w*)\s*(?:[(:@\[ ]\s*([\w.\[\]]+?)\s*[)\]]?\s*)?$", name)
    return (match[1], match[2] or "") if match else (name, "")


def _channels_agree(one: str, other: str) -> bool:
    return not one or not other or one == other


def same_effect(true: str, said: str) -> bool:
    """Whether both name the same effect; a channel counts when both name one."""
    (a, channel_a), (b, channel_b) = plain(true), plain(said)
    return a == b and _channels_agree(channel_a, channel_b)


def in_group(true: str, alike: Iterable[str], said: str) -> bool:
    """Whether an effect that is said is in the ambiguity group of a true one; errors of two sensors are not alike."""
    (id, channel), (_, true_channel) = plain(said), plain(true)
    return id in alike and _channels_agree(channel, true_channel)


def same_set(true: Sequence[str], said: Sequence[str]) -> bool:
    """Whether both sets hold the same effects."""
    if len(true) != len(said):
        return False
    return any(all(same_effect(a, b) for a, b in zip(true, order, strict=True)) for order in permutations(said))
