"""An envelope as a picture: over the first mapped group, a line for each of the second, a panel for the third."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .options import Group, Options
from .search import Reach


def picture(path: Path, options: Options, groups: Sequence[Group], found: Mapping[tuple[str, ...], Reach]) -> None:
    """Write it; found: by the names of the mapped groups' choices."""
    first, second, third = (*groups, *[None] * (3 - len(groups)))[:3]
    assert first is not None
    panels = third.choices if third else (None,)
    figure = Figure(figsize=(4.2 * len(panels) if third else 6.5, 3.8), layout="constrained")
    shared, along = None, _by_size(first)
    bottom = min((options.low if r.value is None else r.value for r in found.values()), default=options.low)
    bottom = bottom if bottom < options.high else options.low
    for k, panel in enumerate(panels):
        ax = figure.add_subplot(1, len(panels), k + 1, sharey=shared)
        shared = shared or ax
        lines = second.choices if second else (None,)
        for behind, line in zip(reversed(range(len(lines))), lines, strict=True):
            rest = tuple(c.name for c in (line, panel) if c is not None)
            reach = [found[(c.name, *rest)] for c in along]
            values = [options.low if r.value is None else r.value for r in reach]
            names = [c.name for c in along]
            width = 1.5 + 1.4 * behind  # so that designs which reach equally far are seen behind each other
            [drawn] = ax.plot(names, values, "-", linewidth=width, label=line.name if line else None)
            for marker, mine in (("o", _edge), ("^", _beyond), ("x", _nowhere)):
                chosen = [k for k, r in enumerate(reach) if mine(r)]
                at, size = [(names[k], values[k]) for k in chosen], 6 + 3 * behind
                ax.plot(*zip(*at, strict=True) if at else ((), ()), marker, color=drawn.get_color(), markersize=size)
        ax.set_xlabel(first.name)
        ax.grid(alpha=0.3)
        span = options.high - bottom
        ax.set_ylim(bottom - 0.05 * span, options.high + 0.05 * span)
        if panel is not None:
            ax.set_title(f"{third.name}: {panel.name}" if third else "")
        if k == 0:
            ax.set_ylabel(f"{options.parameter} up to which all holds [{options.unit}]")
            if second:
                ax.legend(title=second.name, fontsize=8)
    told = "triangle: holds up to the high end and may beyond it; cross: not even at the low end"
    figure.supxlabel(told, fontsize=8)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=130)


def _edge(r: Reach) -> bool:
    """The edge was found."""
    return r.value is not None and not r.whole


def _beyond(r: Reach) -> bool:
    """Everything holds up to the high end, and may beyond it."""
    return r.whole


def _nowhere(r: Reach) -> bool:
    """It does not hold, or cannot be run, even at the low end."""
    return r.value is None


def _by_size(group: Group) -> list:  # type: ignore[type-arg]
    """The choices in the order of the one number in which they differ, else as given."""
    keys = [tuple(c.parameters.values()) for c in group.choices]
    if all(len(k) == 1 and isinstance(k[0], (int, float)) for k in keys):
        return [c for _, c in sorted(zip(keys, group.choices, strict=True), key=lambda pair: pair[0])]
    return list(group.choices)
