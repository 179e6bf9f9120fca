"""Small drawings of points and lines as SVG that a page contains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..result.numbers import short
from .section import SHOWN
from .signals import Array, Dependence


@dataclass(frozen=True)
class Geometry:
    """Size and margins of a drawing, in its units."""

    width: float = 640.0
    height: float = 260.0
    left: float = 66.0
    right: float = 10.0
    top: float = 10.0
    bottom: float = 42.0
    apart: float = 0.1
    """Part of the width across which no mean is drawn: nothing was measured between."""


SIZE = Geometry()
INK = ("#0072b2", "#d55e00", "#009e73")

if TYPE_CHECKING:
    from markupsafe import Markup


@dataclass(frozen=True)
class Axes:
    """Data limits of a drawing."""

    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Places of points (n,); those beyond the limits are put at them."""
        u = (np.clip(x, *self.x) - self.x[0]) / (self.x[1] - self.x[0])
        v = (np.clip(y, *self.y) - self.y[0]) / (self.y[1] - self.y[0])
        return SIZE.left + u * (SIZE.width - SIZE.left - SIZE.right), SIZE.height - SIZE.bottom - v * (
            SIZE.height - SIZE.top - SIZE.bottom
        )


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers between two limits, at most so many."""
    span = high - low
    if not (np.isfinite(span) and span > 0.0):
        return [low]
    power = 10.0 ** np.floor(np.log10(span / most))
    step = next(s for s in (power, 2.0 * power, 5.0 * power, 10.0 * power) if span / s <= most)
    return [float(k * step) for k in range(int(np.ceil(low / step)), int(np.floor(high / step + 1e-9)) + 1)]


def limits(values: Array, least: float | None = None) -> tuple[float, float]:
    """Limits with a margin around values, at least from -least to least if that is given."""
    low, high = float(values.min()), float(values.max())
    if least is not None:
        low, high = min(low, -least), max(high, least)
    margin = 0.05 * (high - low) or max(abs(high), 1.0) * 0.05
    return low - margin, high + margin


def path(x: Array, y: Array) -> str:
    """A line through places (n,)."""
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))


def dots(x: Array, y: Array) -> str:
    """Points at places (n,), as one path of lines without length."""
    return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True))


def frame(axes: Axes, x_label: str, y_label: str, inner: Sequence[str], alt: str) -> Markup:
    """The drawing with its axes; inner: SVG elements made here; labels and what is said are escaped."""
    from markupsafe import Markup, escape  # comes with jinja2, which only a report needs

    elements = []
    for t in ticks(*axes.x):
        x, _ = axes.at(np.array([t]), np.array([axes.y[0]]))
        elements.append(
            f'<line class="grid" x1="{x[0]:.1f}" x2="{x[0]:.1f}" y1="{SIZE.top}" y2="{SIZE.height - SIZE.bottom}"/>'
        )
        elements.append(
            f'<text x="{x[0]:.1f}" y="{SIZE.height - SIZE.bottom + 15}" text-anchor="middle">{short(t)}</text>'
        )
    for t in ticks(*axes.y, most=5):
        _, y = axes.at(np.array([axes.x[0]]), np.array([t]))
        elements.append(
            f'<line class="grid" x1="{SIZE.left}" x2="{SIZE.width - SIZE.right}" y1="{y[0]:.1f}" y2="{y[0]:.1f}"/>'
        )
        elements.append(f'<text x="{SIZE.left - 6}" y="{y[0] + 4:.1f}" text-anchor="end">{short(t)}</text>')
    middle = 0.5 * (SIZE.left + SIZE.width - SIZE.right)
    elements.append(f'<text x="{middle}" y="{SIZE.height - 6}" text-anchor="middle">{escape(x_label)}</text>')
    turned = f"translate(12 {0.5 * (SIZE.top + SIZE.height - SIZE.bottom)}) rotate(-90)"
    elements.append(
        f'<text transform="{turned}" text-anchor="middle">'
        f"{escape(y_label)}</text>"
    )
    body = "".join([*elements, *inner])
    head = f'<svg class="plot" viewBox="0 0 {SIZE.width:.0f} {SIZE.height:.0f}" role="img" aria-label="{escape(alt)}">'
    return Markup(f"{head}{body}</svg>")  # noqa: S704  escaped above


def scatter(d: Dependence, x_label: str, y_label: str) -> Markup:
    """A residual against a signal: readings, their means, and the band of twice the noise."""
    drawn = np.random.default_rng(0).permutation(len(d.x))[: SHOWN.scatter_points]
    reach = float(np.quantile(np.abs(d.residual), 0.995)) if len(d.residual) else 0.0
    axes = Axes(limits(d.x), limits(np.array([-reach, reach]), 2.2 * d.noise))
    _, band = axes.at(np.zeros(2), np.array([2.0 * d.noise, -2.0 * d.noise]))
    height = band[1] - band[0]
    box = f'x="{SIZE.left}" width="{SIZE.width - SIZE.left - SIZE.right}" y="{band[0]:.1f}" height="{height:.1f}"'
    inner = [f'<rect class="band" {box}/>', f'<path class="dots" d="{dots(*axes.at(d.x[drawn], d.residual[drawn]))}"/>']
    mean = d.mean
    if len(mean.x):
        breaks = np.flatnonzero(np.diff(mean.x) > SIZE.apart * (axes.x[1] - axes.x[0])) + 1
        lines = zip(np.split(mean.x, breaks), np.split(mean.y, breaks), strict=True)
        inner.append(f'<path class="mean" stroke="{INK[0]}" d="{"".join(path(*axes.at(*xy)) for xy in lines)}"/>')
    return frame(axes, x_label, y_label, inner, f"{y_label} against {x_label}")


def curve(
    points: Sequence[Sequence[float]], band: Sequence[Sequence[float]], plain: Sequence[Sequence[float]],
    x_label: str, y_label: str,
) -> Markup:  # fmt: skip
    """A curve through points (x, y), with a band (low, high) at the same x, and another one, dashed, beside it."""
    p = np.asarray(points, float)
    b, dashed = np.asarray(band, float).reshape(-1, 2), np.asarray(plain, float).reshape(-1, 2)
    axes = Axes(limits(p[:, 0]), limits(np.concatenate([p[:, 1], dashed[:, 1], b.ravel()])))
    inner = []
    if len(b) == len(p):
        edge = np.concatenate([p[:, 0], p[::-1, 0]]), np.concatenate([b[:, 0], b[::-1, 1]])
        inner.append(f'<path class="band" d="{path(*axes.at(*edge))}Z"/>')
    if len(dashed):
        inner.append(f'<path class="plain" stroke="{INK[1]}" d="{path(*axes.at(dashed[:, 0], dashed[:, 1]))}"/>')
    inner.append(f'<path class="mean" stroke="{INK[0]}" d="{path(*axes.at(p[:, 0], p[:, 1]))}"/>')
    return frame(axes, x_label, y_label, inner, f"{y_label} over {x_label}")
