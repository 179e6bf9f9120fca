"""Draws docs/overview.svg: the machine's two halves and their coupling, and what depth does to the displacement.

    python docs/make_overview.py BUILD_FOLDER
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from deepsea_cosim.master.simulation.run import Options, run

WIDTH, HEIGHT = 900, 330
PLOT = (500, 40, 380, 240)  # x, y, width, height
COLOURS = {0: "#2a78b5", 9: "#3aa06a", 10: "#e0912f", 11: "#c43c39"}


def displacement(package: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and command and displacement [mm] of a scenario, thinned."""
    with tempfile.TemporaryDirectory() as folder:
        result = run(package, Path(folder), Options(step=4e-3))
    rows = result.sample[::25]
    columns = [result.names.index(name) for name in ("hydraulics.x_cmd", "arm.x_h")]
    return rows[:, 0], 1e3 * rows[:, columns].T


def path(t: np.ndarray, x: np.ndarray, style: str) -> str:
    """A polyline in the plot's frame."""
    left, top, width, height = PLOT
    points = " ".join(
        f"{left + width * a / 22:.1f},{top + height * (1 - (b + 5) / 215):.1f}" for a, b in zip(t, x, strict=True)
    )
    return f'<polyline points="{points}" fill="none" {style}/>'


def box(x: int, title: str, lines: list[str], colour: str) -> str:
    """A labelled box."""
    middle = f'x="{x + 85}" text-anchor="middle"'
    text = "".join(f'<text {middle} y="{112 + 19 * i}">{s}</text>' for i, s in enumerate(lines))
    return (
        f'<rect x="{x}" y="60" width="170" height="180" rx="8" fill="{colour}" fill-opacity="0.13" stroke="{colour}"/>'
        f'<text x="{x + 85}" y="86" text-anchor="middle" font-weight="bold">{title}</text>{text}'
    )


def main() -> None:
    """Run four scenarios and write the picture."""
    build = Path(sys.argv[1])
    left, top, width, height = PLOT
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
        'font-size="13">',
        '<defs><marker id="a" markerWidth="9" markerHeight="9" refX="8" refY="4.5" orient="auto">'
        '<path d="M0,0 L9,4.5 L0,9 z" fill="#333"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        box(15, "DeepseaHydraulics", ["pump, relief valve", "servo valve", "two 4 m lines of 4 mm", "cylinder chambers",
                                      "tank, compensator", "PID controller"], "#2a78b5"),
        box(280, "DeepseaArm", ["beam and load", "cylinder's masses", "buoyancy", "Morison loads", "current",
                                "on MuJoCo"], "#c43c39"),
        '<path d="M185,125 H278" stroke="#333" marker-end="url(#a)"/>'
        '<text x="232" y="118" text-anchor="middle">F_h</text>',
        '<path d="M280,185 H187" stroke="#333" marker-end="url(#a)"/>'
        '<text x="232" y="178" text-anchor="middle">x_h, v_h</text>',
        '<text x="232" y="290" text-anchor="middle" fill="#555">cosim-master deepsea_11km.ssp</text>',
    ]  # fmt: skip
    for mm in (0, 50, 100, 150, 200):
        y = top + height * (1 - (mm + 5) / 215)
        parts.append(f'<path d="M{left},{y:.1f} h{width}" stroke="#ddd"/>')
        parts.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end" font-size="11">{mm}</text>')
    for s in range(0, 23, 5):
        x = left + width * s / 22
        parts.append(f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle" font-size="11">{s}</text>')
    parts.append(f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#999"/>')
    parts.append(f'<text x="{left + width / 2}" y="{top + height + 36}" text-anchor="middle">time [s]</text>')
    parts.append(f'<text x="{left}" y="{top - 12}">displacement x_h [mm]</text>')
    for i, (km, colour) in enumerate(COLOURS.items()):
        t, (command, x) = displacement(build / f"deepsea_{km}km.ssp")
        if i == 0:
            parts.append(path(t, command, 'stroke="#888" stroke-dasharray="5 3"'))
        parts.append(path(t, x, f'stroke="{colour}" stroke-width="2"'))
        y = top + height - 78 + 17 * i
        parts.append(f'<path d="M{left + 152},{y} h20" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{left + 178}" y="{y + 4}" font-size="12">{km} km</text>')
    y = top + height - 78 - 17
    parts.append(f'<path d="M{left + 152},{y} h20" stroke="#888" stroke-dasharray="5 3"/>')
    parts.append(f'<text x="{left + 178}" y="{y + 4}" font-size="12">command</text></svg>')
    (Path(__file__).parent / "overview.svg").write_text("\n".join(parts) + "\n")


if __name__ == "__main__":
    main()
