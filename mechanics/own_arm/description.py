"""What an FMU carries of a user's arm: the model less what it does not need, pose, tendons, joints, wet geoms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from .water import Wet


@dataclass(frozen=True)
class Description:
    """An arm as it goes into an FMU; joints: those of one degree of freedom that move, by name, with their units; held:
    names of those that stay where they are."""

    name: str
    xml: str
    pose: tuple[float, ...]
    tendons: tuple[str, ...]
    joints: tuple[tuple[str, str], ...]
    wet: tuple[Wet, ...]
    held: tuple[str, ...] = ()

    def as_data(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Description:
        """From what `as_data` gave."""
        wet = tuple(Wet(**w) for w in data["wet"])
        joints = tuple((name, unit) for name, unit in data["joints"])
        pose, tendons, held = (tuple(data[key]) for key in ("pose", "tendons", "held"))
        return cls(data["name"], data["xml"], pose, tendons, joints, wet, held)
