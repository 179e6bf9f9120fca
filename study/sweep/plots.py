"""A picture of each metric: a line over one parameter, lines or a map over two, points over each of more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .axes import Axis

FEW = 8
"""Values of a second parameter that are drawn as lines of their own; more make a map."""


def picture(path: Path, *what: Any) -> None:
    """Write the `figure_of` one metric into a file."""
    figure_of(*what).savefig(path, dpi=130)


def figure_of(
    axes: Sequence[Axis], sampled: bool, table: Sequence[Mapping[str, Any]], label: str,
    indices: Mapping[str, Any] | None = None, units: Mapping[str, str] | None = None,
) -> Figure:  # fmt: skip
    """The picture of one metric; units: of the axes, by name, and of the metric, by label."""
    names = [a.name for a in axes]
    units = units or {}
    shown = {name: f"{name} [{units[name]}]" if units.get(name, "1") != "1" else name for name in (*names, label)}
    shown = {name: text.replace("$", r"\$") for name, text in shown.items()}  # no formula
    if sampled or len(axes) > 2:
        figure = _scatter(names, table, label, indices, shown)
    else:
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        _over(figure, figure.add_subplot(), axes, table, label, shown)
    FigureCanvasAgg(figure)
    return figure


def _over(
    figure: Figure, ax: Axes, axes: Sequence[Axis], table: Sequence[Mapping[str, Any]], label: str,
    shown: Mapping[str, str],
) -> None:  # fmt: skip
    axes, table = _sorted(axes, table)
    first, *rest = axes if len(axes[0].values) > 1 else axes[::-1]  # what does not vary is no direction
    ax.set_xlabel(shown.get(first.name, first.name))
    if rest and len(rest[0].values) > FEW and _numbers(first.values) and _numbers(rest[0].values):
        second = rest[0]
        z = np.array([_number(row[label]) for row in table]).reshape([len(a.values) for a in axes])
        z = z if first is axes[0] else z.T
        drawn = ax.pcolormesh(first.values, second.values, z.T, shading="nearest")
        figure.colorbar(drawn, ax=ax, label=shown.get(label, label))
        ax.set_ylabel(shown.get(second.name, second.name))
        return
    ax.set_ylabel(shown.get(label, label))
    ax.grid(alpha=0.3)
    x = list(first.values) if _numbers(first.values) else [str(v) for v in first.values]
    for value in rest[0].values if rest else (None,):
        mine = [row for row in table if not rest or row[rest[0].name] == value]
        y = [_number(row[label]) for row in mine]
        ax.plot(x, y, marker="o", ms=3.5, label=None if value is None else f"{value}")
    if rest:
        ax.legend(title=shown.get(rest[0].name, rest[0].name))


def _sorted(
    axes: Sequence[Axis], table: Sequence[Mapping[str, Any]]
) -> tuple[list[Axis], list[Mapping[str, Any]]]:
    """The axes of numbers with their values in order, and the rows of the grid accordingly."""
    made = [replace(a, values=tuple(sorted(a.values))) if _numbers(a.values) else a for a in axes]
    places = [{value: k for k, value in enumerate(a.values)} for a in made]
    return made, sorted(table, key=lambda row: [p[row[a.name]] for a, p in zip(made, places, strict=True)])


def _scatter(
    names: Sequence[str], table: Sequence[Mapping[str, Any]], label: str, indices: Mapping[str, Any] | None,
    shown: Mapping[str, str],
) -> Figure:  # fmt: skip
    panels = len(names) + (indices is not None)
    columns = min(3, panels)
    lines = -(-panels // columns)
    figure = Figure(figsize=(3.6 * columns, 2.9 * lines), layout="constrained")
    y = np.array([_number(row[label]) for row in table])
    for k, name in enumerate(names):
        ax = figure.add_subplot(lines, columns, k + 1)
        values = [row[name] for row in table]
        x = values if _numbers(values) else [str(v) for v in values]
        ax.plot(x, y, ".", ms=3, alpha=0.5)
        ax.set_xlabel(shown.get(name, name))
        ax.set_ylabel(shown.get(label, label) if k % columns == 0 else "")
        ax.grid(alpha=0.3)
    if indices is not None:
        ax = figure.add_subplot(lines, columns, panels)
        width = 0.8 / len(indices)
        for k, (kind, by_name) in enumerate(indices.items()):
            place = np.arange(len(names)) + k * width
            values = [by_name[n]["value"] for n in names]
            ax.barh(place, values, width, xerr=[by_name[n]["half_width"] for n in names], label=kind)
        ax.set_yticks(np.arange(len(names)) + 0.4 - width / 2, names)
        ax.invert_yaxis()
        ax.set_xlabel("share of the variation")
        ax.legend()
    return figure


def _numbers(values: Sequence[Any]) -> bool:
    return all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
