"""What is written into the pictures: time, the scales of the colours, labels with their lines, and which run is
which."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ...core.display_units import DisplayUnits
from .colours import RAMP, Scale
from .labels import Box, Label, arranged

INK, SHADE, LINE = (245, 248, 250), (8, 20, 30, 165), (245, 248, 250, 200)


@cache
def font(height: int) -> Any:
    """Letters of that height [pixels]: those of matplotlib, which know the signs of units."""
    found = find_spec("matplotlib")
    for place in (found.submodule_search_locations or ()) if found is not None else ():
        file = Path(place) / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
        if file.is_file():
            return ImageFont.truetype(str(file), height)
    return ImageFont.load_default(height)


class Lettering:
    """Writes into the pictures of a film. `size` is (width, height), `legend` the lines in the lower left corner;
    `anchors` (n, labels, 2) are the pixels of the labels' places; `busy`: some frames, and points (frames, points, 2)
    of the machine in them, which the labels are to leave free."""

    def __init__(
        self, size: tuple[int, int], scales: Sequence[Scale], labels: Sequence[Label], anchors: np.ndarray,
        display: DisplayUnits, legend: Sequence[str], speed: float, busy: tuple[Sequence[int], np.ndarray],
    ):  # fmt: skip
        self.size, self.labels, self.anchors, self.speed = size, labels, anchors, speed
        self.height = max(9, round(size[1] / 34))
        self.gap = max(3, self.height // 2)
        self.font = font(self.height)
        self.still, taken = self._still(scales, display, legend)
        pads = [(w + 2 * self.gap, h + self.gap) for w, h in map(self._widest, labels)]
        self.offsets = arranged(anchors[list(busy[0])], pads, taken, size, busy[1])

    def _extent(self, text: str) -> tuple[float, float]:
        left, _, right, _ = self.font.getbbox(text)
        return float(right - left), float(self.height * 1.2)

    def _widest(self, label: Label) -> tuple[float, float]:
        """Size of a label whose text is as long as it gets."""
        times = np.linspace(label.times[0], label.times[-1], 40)
        return self._extent(max((label.at(float(t)) for t in times), key=len))

    def _still(
        self, scales: Sequence[Scale], display: DisplayUnits, legend: Sequence[str]
    ) -> tuple[Image.Image, list[Box]]:
        """What is the same in all pictures, and the room that is taken by it and by the time."""
        image = Image.new("RGBA", self.size, (0, 0, 0, 0))
        draw = ImageDraw.Draw(image)
        width, height = self.size
        line, gap = round(1.5 * self.height), self.gap
        taken: list[Box] = [(0, 0, 0.28 * width, 2 * gap + 1.6 * line)]
        top = gap
        for scale in scales:
            wide = round(0.26 * width)
            left = width - wide - 2 * gap
            draw.rounded_rectangle((left - gap, top, width - gap, top + 3 * line + gap), gap, fill=SHADE)
            name, least, greatest = ends(scale, display)
            draw.text((left, top + gap // 2), f"{scale.text or scale.name}", INK, self.font)
            self._ramp(image, (left, top + line + gap // 2, left + wide, top + 2 * line))
            draw.text((left, top + 2 * line + gap // 2), least, INK, self.font)
            right = f"{greatest} {name}".rstrip()
            draw.text((left + wide - self.font.getlength(right), top + 2 * line + gap // 2), right, INK, self.font)
            taken.append((left - gap, top, width - gap, top + 3 * line + gap))
            top += 3 * line + 2 * gap
        for k, text in enumerate(reversed(legend)):
            at = height - gap - (k + 1) * line
            long = self.font.getlength(text) + 2 * gap
            draw.rounded_rectangle((gap, at, gap + long, at + line - 2), gap, fill=SHADE)
            draw.text((2 * gap, at + gap // 4), text, INK, self.font)
            taken.append((gap, at, gap + long, at + line))
        return image, taken

    @staticmethod
    def _ramp(image: Image.Image, box: tuple[int, int, int, int]) -> None:
        left, top, right, bottom = box
        share = np.linspace(0.0, 1.0, right - left)
        rgb = np.stack([np.interp(share, np.linspace(0, 1, len(RAMP)), RAMP[:, k]) for k in range(3)], axis=-1)
        strip = np.broadcast_to((255 * rgb).astype(np.uint8), (bottom - top, right - left, 3))
        image.paste(Image.fromarray(np.ascontiguousarray(strip)), (left, top))

    def written(self, shot: np.ndarray, k: int, t: float) -> Image.Image:
        """Frame k at the time t [s] with all that is written into it."""
        image = Image.fromarray(shot).convert("RGB")
        image.paste(self.still, (0, 0), self.still)
        draw = ImageDraw.Draw(image, "RGBA")
        gap = self.gap
        clock = f"t = {t:.2f} s" + (f"   {self.speed:g} x" if self.speed != 1.0 else "")
        large = font(round(1.3 * self.height))
        draw.rounded_rectangle(
            (gap, gap, 3 * gap + large.getlength(clock), gap + round(2.1 * self.height)), gap, fill=SHADE
        )
        draw.text((2 * gap, gap + gap // 2), clock, INK, large)
        for label, anchor, offset in zip(self.labels, self.anchors[k], self.offsets, strict=True):
            self._label(draw, label.at(t), anchor, offset)
        return image

    def _label(self, draw: Any, text: str, anchor: np.ndarray, offset: tuple[float, float]) -> None:
        wide, tall = self._extent(text)
        x, y = anchor[0] + offset[0], anchor[1] + offset[1]
        box = (x - 0.5 * wide - self.gap, y - 0.5 * tall, x + 0.5 * wide + self.gap, y + 0.5 * tall)
        near = (min(max(anchor[0], box[0]), box[2]), min(max(anchor[1], box[1]), box[3]))
        draw.line((*anchor, *near), fill=LINE, width=max(1, self.height // 10))
        dot = max(1.5, self.height / 7)
        draw.ellipse((anchor[0] - dot, anchor[1] - dot, anchor[0] + dot, anchor[1] + dot), fill=LINE)
        draw.rounded_rectangle(box, self.gap, fill=SHADE)
        draw.text((x, y), text, INK, self.font, anchor="mm")


def ends(scale: Scale, display: DisplayUnits) -> tuple[str, str, str]:
    """Unit and both ends of a scale as they are shown."""
    largest = max(abs(scale.least), abs(scale.greatest))
    name, factor, offset = display.of(scale.unit, largest) if scale.unit else ("", 1.0, 0.0)
    least, greatest = (f"{factor * x + offset:.3g}" for x in (scale.least, scale.greatest))
    return "" if name == "1" else name, least, greatest
