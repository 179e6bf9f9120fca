"""At which sizes an effect is run for the bank of responses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from ..problem.parameters import EffectCandidate, EstimatedParameter
from ..settings import SearchSettings


def grid(x: EstimatedParameter, settings: SearchSettings) -> list[float]:
    """Normalised values of an effect's main parameter, to both sides as far as its range reaches, small ones first.

    A factor of about three lies between them; the end of a range is one, too.
    """
    sizes: list[float] = []
    for sign, reach in ((1.0, x.high), (-1.0, -x.low)):
        if reach <= 0.0:
            continue
        one_side = [s for s in settings.sizes if s < 0.999 * reach]
        if one_side and reach > settings.max_size_ratio * settings.sizes[-1]:
            parts = math.ceil(math.log(reach / one_side[-1]) / math.log(settings.max_size_ratio))
            one_side += [one_side[-1] * (reach / one_side[-1]) ** (k / parts) for k in range(1, parts)]
        sizes += [sign * s for s in (*one_side, reach)]
    return sizes


def first_sizes(x: EstimatedParameter, settings: SearchSettings) -> list[float]:
    """Those of the grid that every effect is run at."""
    sizes = grid(x, settings)
    chosen: set[float] = set()
    for sign in (1.0, -1.0):
        one_side = [s for s in sizes if s * sign > 0.0]
        chosen |= {min(one_side, key=lambda s: abs(abs(s) - size)) for size in settings.first if one_side}
    return [s for s in sizes if s in chosen]


def between(tried: Iterable[float], nearest: float) -> list[float]:
    """Sizes half way, by their ratio, from one of those that were tried to its neighbours on the same side."""
    sizes = sorted(s for s in tried if s * nearest > 0.0)
    k = sizes.index(nearest)
    return [float(np.sign(nearest) * np.sqrt(nearest * s)) for s in (*sizes[max(0, k - 1) : k], *sizes[k + 1 : k + 2])]


def variants(candidate: EffectCandidate, sizes: Sequence[float], settings: SearchSettings) -> list[dict[str, float]]:
    """Points at which an effect is run: every size with every start of its shapes, or the usual size alone where these
    are many, such as frequencies and phases; parameters by name."""
    main = [x for x in candidate.parameters if not x.shape]
    shapes = [x for x in candidate.parameters if x.shape]
    starts = list(product(*(x.starts or (0.0,) for x in shapes)))
    if len(starts) > settings.shapes:
        sides = ([s for s in sizes if s * sign > 0.0] for sign in (1.0, -1.0))
        sizes = [min(side, key=lambda s: abs(abs(s) - 1.0)) for side in sides if side]
    points = []
    for size in sizes:
        for values in starts:
            amount = {x.name: min(max(size, x.low), x.high) for x in main}
            points.append({**amount, **{x.name: v for x, v in zip(shapes, values, strict=True)}})
    return points
