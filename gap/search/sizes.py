"""At which sizes an effect is run for the bank of responses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
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


def usual_sizes(x: EstimatedParameter, settings: SearchSettings) -> list[float]:
    """The size of the grid to each side that is nearest to the usual one: every effect is run at these first."""
    sizes = grid(x, settings)
    sides = ([s for s in sizes if s * sign > 0.0] for sign in (1.0, -1.0))
    return [min(side, key=lambda s: abs(abs(s) - settings.usual)) for side in sides if side]


def second_size(
    x: EstimatedParameter, usual: float, change: float, gap: float, settings: SearchSettings
) -> float | None:
    """The size of the grid on the same side that is run next: where the effect would do as much as is left, if the
    usual size cannot be scaled up so far; else the small one. None where there is no other.

    change: normalised RMS of what the effect does at its usual size; gap: of what is left.
    """
    others = [s for s in grid(x, settings) if s * usual > 0.0 and s != usual]
    wanted = abs(usual) * gap / change if change > 0.0 else 0.0
    target = wanted if wanted > settings.extrapolation * abs(usual) else settings.small
    return min(others, key=lambda s: abs(math.log(abs(s) / target)), default=None)


def resized(candidate: EffectCandidate, values: Mapping[str, float], size: float) -> dict[str, float]:
    """An effect's values by parameter, at another size."""
    return {x.name: values[x.name] if x.shape else min(max(size, x.low), x.high) for x in candidate.parameters}


def between(tried: Iterable[float], nearest: float) -> list[float]:
    """Sizes half way, by their ratio, from one of those that were tried to its neighbours on the same side."""
    sizes = sorted(s for s in tried if s * nearest > 0.0)
    k = sizes.index(nearest)
    return [float(np.sign(nearest) * np.sqrt(nearest * s)) for s in (*sizes[max(0, k - 1) : k], *sizes[k + 1 : k + 2])]


def starts_of_shapes(candidate: EffectCandidate) -> list[tuple[float, ...]]:
    """All combinations of the starts of its shapes, each in their order."""
    return list(product(*(x.starts or (0.0,) for x in candidate.parameters if x.shape)))


def variants(candidate: EffectCandidate, sizes: Sequence[float], settings: SearchSettings) -> list[dict[str, float]]:
    """Points at which an effect is run: every size with every start of its shapes, or the usual size alone where these
    are many, such as frequencies and phases; parameters by name."""
    main = [x for x in candidate.parameters if not x.shape]
    shapes = [x for x in candidate.parameters if x.shape]
    starts = starts_of_shapes(candidate)
    if len(starts) > settings.shapes:
        sides = ([s for s in sizes if s * sign > 0.0] for sign in (1.0, -1.0))
        sizes = [min(side, key=lambda s: abs(abs(s) - settings.usual)) for side in sides if side]
    points = []
    for size in sizes:
        for values in starts:
            amount = {x.name: min(max(size, x.low), x.high) for x in main}
            points.append({**amount, **{x.name: v for x, v in zip(shapes, values, strict=True)}})
    return points


def frequency_of(c: EffectCandidate) -> EstimatedParameter | None:
    """The shape of an effect that is a frequency, if any."""
    return next((x for x in c.parameters if x.frequency), None)
