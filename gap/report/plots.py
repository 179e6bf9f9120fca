"""The pictures of a report: matplotlib without a display, one figure used again for all of a kind.

Names that a user chose stay out of the pictures (they stand in the page), so that no font lacks their letters.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from .series import Dependence, Trace

MEASURED, DELIVERED, REFITTED, BEST = "#111111", "#d55e00", "#e69f00", "#0072b2"
"""Okabe and Ito's colours, which the colour-blind tell apart."""

FLOOR = "#d9dde2"
DPI = 110
HEAD = 0.36
"""Height of the legend [inch]."""

MOST = 1400
"""Points of a line."""

FAR = 3.0
"""From this ratio of residuals on, those after the refit get a panel of their own."""

STYLE = {
    "font.family": "DejaVu Sans", "font.size": 9.0, "text.parse_math": False, "axes.linewidth": 0.7,
    "axes.edgecolor": "#6b7480", "axes.labelcolor": "#333a42", "text.color": "#333a42", "xtick.color": "#333a42",
    "ytick.color": "#333a42", "axes.grid": True, "grid.color": "#e7eaee", "grid.linewidth": 0.7,
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "xtick.major.size": 2.5,
    "ytick.major.size": 2.5, "lines.linewidth": 1.1, "axes.unicode_minus": True, "path.simplify_threshold": 0.4,
    "agg.path.chunksize": 0,
}  # fmt: skip


def pixels(figure: Figure) -> np.ndarray:
    """A figure as an array (height, width, 4)."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.array(canvas.buffer_rgba())


def png(picture: np.ndarray) -> str:
    """A picture as an address that contains it."""
    image = Image.fromarray(picture).convert("RGB")
    file = io.BytesIO()
    image.quantize(64, method=Image.Quantize.FASTOCTREE).save(file, "PNG", compress_level=6)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")


def decimate(t: np.ndarray, y: np.ndarray, most: int = MOST) -> tuple[np.ndarray, np.ndarray]:
    """Fewer points of a line with its peaks: the first, least and largest of every few."""
    size = -(-2 * len(t) // most)
    if size <= 2:
        return t, y
    n = len(t) // size * size
    parts = y[:n].reshape(-1, size)
    row = np.arange(len(parts)) * size
    keep = np.unique(np.concatenate([row + parts.argmin(1), row + parts.argmax(1), np.arange(n, len(t)), [len(t) - 1]]))
    return t[keep], y[keep]


def far_apart(traces: Sequence[Trace]) -> bool:
    """Whether some channel's residual as delivered hides what is left after the refit."""
    return any(
        _reach(t.measured - t.nominal) > FAR * max(_reach(t.measured - t.refitted), 2.0 * float(np.median(t.floor)))
        for t in traces
    )


def _reach(x: np.ndarray) -> float:
    return float(np.quantile(np.abs(x), 0.995))


class Sheet:
    """A figure for a channel: readings above, residuals below; drawn again and again, its legend only once."""

    def __init__(self, best_name: str | None, closer: bool, width: float = 6.2):
        """best_name: of the hypothesis beyond the refit, None: there is none; closer: a panel for what is left."""
        self.best_name, self.closer = best_name, closer
        heights = [1.65, 1.2, 1.2] if closer else [1.65, 1.5]
        self.header: np.ndarray | None = None
        gap, top, bottom = 0.3, HEAD, 0.42
        total = sum(heights) + gap * (len(heights) - 1) + top + bottom
        with rc_context(STYLE):
            self.figure = Figure(figsize=(width, total), dpi=DPI, facecolor="white")
            FigureCanvasAgg(self.figure)
            self.axes: list[Axes] = []
            place = total - top
            for h in heights:
                place -= h
                self.axes.append(self.figure.add_axes((0.7 / width, place / total, 1.0 - 0.8 / width, h / total)))
                place -= gap
            for axis in self.axes:
                axis.locator_params(axis="y", nbins=5)
                axis.ticklabel_format(style="plain", axis="y", useOffset=False)
                axis.yaxis.set_label_coords(-0.52 / (width - 0.8), 0.5)
            for axis in self.axes[:-1]:
                axis.tick_params(labelbottom=False)
            self.axes[-1].set_xlabel("time [s]", labelpad=2)
            self._lines()

    def _lines(self) -> None:
        top, middle, low = self.axes[0], self.axes[1], self.axes[-1]
        last = self.best_name or "refitted"
        self.top = [
            top.plot([], [], color=MEASURED, lw=2.6, alpha=0.35, label="measured", solid_capstyle="butt")[0],
            top.plot([], [], color=DELIVERED, lw=1.2, label="as delivered")[0],
            top.plot([], [], color=BEST, lw=1.2, dashes=(5, 2), label=last)[0],
        ]
        self.middle = [middle.plot([], [], color=DELIVERED, lw=0.9)[0]]
        self.low = []
        if self.best_name:
            self.low.append(low.plot([], [], color=REFITTED, lw=0.9)[0])
            top.plot([], [], color=REFITTED, lw=1.2, label="refitted")
        self.low.append(low.plot([], [], color=BEST, lw=0.9)[0])
        if self.closer:
            self.middle.append(middle.plot([], [], color=BEST, lw=0.9)[0])
        handles = [self.top[0], self.top[1], *([top.lines[3]] if self.best_name else []), self.top[2]]
        band = low.fill_between([0, 1], 0, 0, color=FLOOR, lw=0, label="±2 noise floors")
        band.remove()
        self.legend = top.legend(
            handles=[*handles, band], ncols=5, fontsize=8, frameon=False, loc="lower left",
            bbox_to_anchor=(-0.01, 0.98), handlelength=1.5, columnspacing=1.1, handletextpad=0.5, borderpad=0.1,
        )  # fmt: skip
        style = {"fontsize": 8, "va": "bottom", "ha": "left"}
        middle.text(0.0, 1.02, "residual: measured − simulated", transform=middle.transAxes, **style)
        if self.closer:
            low.text(0.0, 1.02, "the same, closer, without the model as delivered", transform=low.transAxes, **style)

    def draw(self, x: Trace) -> str:
        """The picture of a channel."""
        with rc_context(STYLE):
            label = f"[{x.unit}]" if x.unit else "[–]"
            for line, y in zip(self.top, (x.measured, x.nominal, x.best), strict=True):
                line.set_data(*decimate(x.t, y))
            before, refit, after = (x.measured - y for y in (x.nominal, x.refitted, x.best))
            self.middle[0].set_data(*decimate(x.t, before))
            if self.closer:
                self.middle[1].set_data(*decimate(x.t, after))
            for line, y in zip(self.low, ([refit, after] if self.best_name else [after]), strict=True):
                line.set_data(*decimate(x.t, y))
            middle, low = self.axes[1], self.axes[-1]
            marks = []
            coarse = slice(None, None, max(1, len(x.t) // 400))
            for axis in {id(a): a for a in (middle, low)}.values():
                marks.append(
                    axis.fill_between(
                        x.t[coarse], -2.0 * x.floor[coarse], 2.0 * x.floor[coarse], color=FLOOR, lw=0, zorder=1
                    )
                )
            top = low.get_xaxis_transform()
            for t in x.changes:
                marks.append(low.axvline(t, color="#555b63", lw=0.8, dashes=(1.5, 2), zorder=1.5))
                marks += low.plot([t], [1.0], "v", color="#555b63", ms=4, transform=top, clip_on=False)
            values = np.concatenate([x.measured, x.nominal, x.best])
            _limits(self.axes[0], float(values.min()), float(values.max()))
            floor = 2.2 * float(np.median(x.floor))
            below = [refit, after] if self.best_name else [after]
            _limits(low, *_range(below if self.closer else [before, *below], floor))
            if self.closer:
                _limits(middle, *_range([before, after], floor))
            for axis in self.axes:
                axis.set_xlim(x.t[0], x.t[-1])
                axis.set_ylabel(label)
            made = pixels(self.figure)
            if self.header is None:
                self.header = made[: round(0.9 * HEAD * DPI)].copy()
                self.legend.set_visible(False)
            made[: len(self.header)] = self.header
            for mark in marks:
                mark.remove()
            return png(made)


def _range(lines: Sequence[np.ndarray], floor: float) -> tuple[float, float]:
    """From the least to the largest, the floor at least; rare peaks may be cut."""
    low = min(max(float(x.min()), 1.6 * float(np.quantile(x, 0.004))) for x in (np.minimum(y, 0.0) for y in lines))
    high = max(min(float(x.max()), 1.6 * float(np.quantile(x, 0.996))) for x in (np.maximum(y, 0.0) for y in lines))
    return min(low, -floor), max(high, floor)


def _limits(axis: Axes, low: float, high: float) -> None:
    margin = 0.08 * (high - low) or max(abs(high), 1.0) * 0.01
    axis.set_ylim(low - margin, high + margin)


def against(x: Dependence) -> str:
    """Residual against what it varies with: points, and their mean in narrow intervals."""
    with rc_context(STYLE):
        figure = Figure(figsize=(6.2, 2.7), dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)
        axis = figure.add_axes((0.7 / 6.2, 0.44 / 2.7, 1.0 - 0.8 / 6.2, 1.0 - 0.72 / 2.7))
        some = np.random.default_rng(0).permutation(len(x.x))[:3000]
        axis.axhspan(-2.0 * x.floor, 2.0 * x.floor, color=FLOOR, lw=0, zorder=1, label="±2 noise floors")
        axis.plot(x.x[some], x.residual[some], ".", color="#7d8791", ms=2, alpha=0.45, label="reading", zorder=2)
        ways = [(1, BEST, "mean, signal rising"), (-1, DELIVERED, "mean, signal falling")] if x.odd else []
        for way, colour, said in ways or [(0, BEST, "mean")]:
            axis.plot(*x.means(way), color=colour, lw=1.5, label=said, zorder=3)
        reach = max(2.2 * x.floor, _reach(x.residual))
        _limits(axis, -reach, reach)
        axis.set_xlabel(f"{'measured input' if x.given else 'simulated signal'} [{x.x_unit or '–'}]", labelpad=2)
        axis.set_ylabel(f"residual [{x.unit or '–'}]")
        axis.locator_params(axis="y", nbins=6)
        axis.legend(
            ncols=4, fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(-0.01, 0.98), borderpad=0.1,
            handlelength=1.5, markerscale=3, columnspacing=1.2,
        )  # fmt: skip
        return png(pixels(figure))
