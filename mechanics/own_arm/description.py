"""What an FMU carries of a user's arm: the model less what it does not need, pose, tendons, joints, wet geoms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from .water import Wet


@dataclass(frozen=True)
class Description:
    """An arm as it goes into an FMU; joints: those of one degree of freedom, by name, with their units."""

    name: str
    xml: str
    pose: tuple[float, ...]
    tendons: tuple[str, ...]
    joints: tuple[tuple[str, str], ...]
    wet: tuple[Wet, ...]

    def as_data(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Description:
        """From what `as_data` gave."""
        wet = tuple(Wet(**w) for w in data["wet"])
        joints = tuple((name, unit) for name, unit in data["joints"])
        return cls(data["name"], data["xml"], tuple(data["pose"]), tuple(data["tendons"]), joints, wet)
