"""check.png: measured against modelled, a row for each channel and a column for each run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import replacing
from ...core.units import unit
from ..campaign.campaign import Channel, si
from ..measurements.table import split_unit
from ..problem.problem import Problem
from ..settings import CHECKS
from .guess import spread

MEASURED, MODELLED, DRIVES = "#0072b2", "#d55e00", "#555555"


def draw(problem: Problem, nominal: np.ndarray, target: Path) -> bool:
    """Write the picture; false where there is no channel. Raises `OutputError`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    campaign = problem.campaign
    runs = spread(len(campaign.runs), CHECKS.drawn_runs)
    channels = [*campaign.outputs, *campaign.inputs][: CHECKS.drawn_channels]
    if not channels:
        return False
    figure = Figure(figsize=(1.0 + 3.6 * len(runs), 0.9 + 1.7 * len(channels)), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(channels), len(runs), squeeze=False)
    for i, c in enumerate(channels):
        for j, r in enumerate(runs):
            _panel(axes[i, j], problem, nominal, c, r)
            axes[i, j].tick_params(labelsize=7)
            axes[i, j].grid(alpha=0.3)
            if i == 0:
                axes[i, j].set_title(_plain(campaign.runs[r].name), fontsize=9)
            if i == len(channels) - 1:
                axes[i, j].set_xlabel("time [s]", fontsize=8)
        axes[i, 0].set_ylabel(_plain(f"{split_unit(c.column)[0]}\n[{c.unit}]"), fontsize=8)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper right", ncols=3, fontsize=8, frameon=False)
    width, height = figure.get_size_inches()
    figure.suptitle(_plain(campaign.name), fontsize=10, x=0.02, ha="left", y=1.0 - 0.1 / height)
    figure.subplots_adjust(0.85 / width, 0.45 / height, 1.0 - 0.1 / width, 1.0 - 0.55 / height, 0.2, 0.3)
    with replacing(target) as part:
        figure.savefig(part, pil_kwargs={"compress_level": 3})
    return True


def _panel(axis: Any, problem: Problem, nominal: np.ndarray, c: Channel, r: int) -> None:
    series = problem.campaign.runs[r].series.get(c.connector)
    if series is None:
        axis.text(0.5, 0.5, "not measured", ha="center", transform=axis.transAxes, fontsize=8)
        return
    t, y = series
    every = max(1, len(t) // CHECKS.drawn_points)
    u, of_si = unit(c.unit), unit(si(c.unit))
    shown = (of_si.factor * y + of_si.offset - u.offset) / u.factor
    if c.role == "input":
        axis.plot(t[::every], shown[::every], color=DRIVES, linewidth=0.8, label="drives the model")
        return
    axis.plot(t[::every], shown[::every], ".", color=MEASURED, markersize=2.5, label="measured")
    blocks = problem.observations.of_run(r)
    if c.connector in blocks:
        b = blocks[c.connector]
        of_fmu = unit(problem.units[c.connector])
        model = (of_fmu.factor * nominal[b.place] + of_fmu.offset - u.offset) / u.factor
        axis.plot(b.t, model, color=MODELLED, linewidth=1.1, label="model as delivered")


def _plain(text: str) -> str:
    """A text in which matplotlib finds no formula."""
    return text.replace("$", r"\$")
