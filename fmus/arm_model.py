"""The arm of an FMU that `own_arm` is built for; empty in the repository."""

from __future__ import annotations

from typing import Any

DATA: dict[str, Any] = {"name": "OwnArm", "xml": "", "pose": (), "tendons": (), "joints": (), "wet": (), "held": ()}
