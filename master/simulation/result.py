"""What a run left behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...core.display_units import display_units
from ...core.errors import UsageError
from ...core.figures import in_notebooks
from ..accuracy.held_inputs import HeldInputs
from .answers import Answers
from .trust import trust


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

    def __repr__(self) -> str:
        """In a notebook or at a prompt: what the run answers, how far to trust it, where it is."""
        told = self.answers.texts(display_units(None)) if self.answers is not None else []
        trusted = [trust(self.summary, bool(self.connected), "in .summary")] if "coupling" in self.summary else []
        return "\n".join([*told, *trusted, f"Result({str(self.folder)!r}, {self.summary.get('steps')} steps)"])

    def frame(self) -> Any:
        """The record as a pandas frame, read from its file; units by column are in its `attrs["units"]`.

        Raises `UsageError` where the run kept no record.
        """
        from ..results.frame import frame

        if self.file is None:
            raise UsageError("this run kept no record")
        made = frame(self.file, self.texts, self.truths)
        made.attrs["units"] = dict(self.units)
        return made

    def plot(self, *patterns: str, units: str | None = None) -> Any:
        """A matplotlib figure of the signals that match, a panel a unit; without patterns that of overview.png.

        units: what `--units` takes. It is drawn from `sample`, some thousands of points. Raises `UsageError` where
        nothing matches.

        >>> result.plot("arm.x_h", "*.P?", units="bar,mm").savefig("stroke.png")   # doctest: +SKIP
        """
        from .plot import figure, signals_to_draw

        chosen, asked = signals_to_draw(self, patterns)
        assert self.sample is not None
        rows = self.sample[:, [self.names.index(name) for name in chosen]]
        made = figure(self.folder.name, chosen, self.units, self.connected, rows, asked, display_units(units))
        return in_notebooks(made)
