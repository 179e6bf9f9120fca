"""Where the camera stands so that the whole motion is in the picture, and where a place is in it."""

from __future__ import annotations

import numpy as np

from .film import Eye

AROUND = 1.2
"""How much wider than what moves the picture is."""

ABOVE = 0.04
"""How far the middle of what moves is below the picture's, as a share of its height: what is written stands above."""


def axes(azimuth: float, elevation: float) -> np.ndarray:
    """Unit vectors (3, 3) to the right, upwards and ahead of a camera, for angles in degrees."""
    a, e = np.radians(azimuth), np.radians(elevation)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return np.array([right, np.cross(right, ahead), ahead])


def framing(points: np.ndarray, view: tuple[float, float], opening: float, aspect: float) -> Eye:
    """The camera that has all points (n, 3) in its picture of the given aspect; `opening` upwards [deg]."""
    frame = axes(*view)
    seen = points @ frame.T
    tall = np.tan(0.5 * np.radians(opening))
    wide = tall * aspect
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    distance = 1.0
    for _ in range(20):  # the middle of the picture moves with the distance, for nearer points are larger
        away = seen - middle
        depth = np.maximum(away[:, 2] + distance, 1e-3)
        for k in (0, 1):
            share = away[:, k] / depth
            middle[k] += 0.5 * (share.min() + share.max()) * distance
        away = seen - middle
        needed = np.maximum(np.abs(away[:, 0]) / wide, np.abs(away[:, 1]) / tall) * AROUND - away[:, 2]
        distance = float(max(needed.max(), 1e-3))
    middle[1] += ABOVE * 2.0 * tall * distance
    lookat = middle @ frame
    return Eye((float(lookat[0]), float(lookat[1]), float(lookat[2])), distance, *view)


def projected(points: np.ndarray, eye: Eye, opening: float, size: tuple[int, int]) -> np.ndarray:
    """Pixels (..., 2) from the upper left of places (..., 3) in a picture of that width and height."""
    width, height = size
    seen = (points - np.array(eye.lookat)) @ axes(eye.azimuth, eye.elevation).T
    depth = seen[..., 2] + eye.distance
    scale = 0.5 * height / np.tan(0.5 * np.radians(opening)) / np.maximum(depth, 1e-9)
    return np.stack([0.5 * width + scale * seen[..., 0], 0.5 * height - scale * seen[..., 1]], axis=-1)
