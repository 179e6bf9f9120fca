"""What a run left behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import UsageError
from ..accuracy.held_inputs import HeldInputs
from .answers import Answers


@dataclass
class Result:
    """What a run left behind."""

    folder: Path
    summary: dict[str, Any]
    names: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    sample: np.ndarray | None = None
    """Communication points at even distances, at most about 2 `recording.SAMPLE` rows (n, columns), for plots."""
    extremes: np.ndarray | None = None
    """First, least, greatest and last value of each column (4, columns)."""
    connected: list[str] = field(default_factory=list)
    """Names of the outputs that drive an input."""
    outputs: list[str] = field(default_factory=list)
    system_outputs: list[str] = field(default_factory=list)
    """Names of the outputs of the system itself."""
    file: Path | None = None
    texts: Sequence[str] = ()
    """Names of the columns that hold texts."""
    truths: Sequence[str] = ()
    """Names of the columns that hold true and false."""
    stride: int = 1
    """Distance of the sampled points [steps]."""
    held: HeldInputs | None = None
    """How far inputs were off in the steps."""
    answers: Answers | None = None
    """What the package wants said of the run."""

    @property
    def frame(self) -> Any:
        """The record as a pandas frame, read from its file; units are in frame.attrs["units"]."""
        from ..results.frame import frame

        if self.file is None:
            raise UsageError("this run kept no record")
        made = frame(self.file, self.texts, self.truths)
        made.attrs["units"] = dict(self.units)
        return made
