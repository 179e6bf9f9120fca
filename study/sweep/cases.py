"""The cases of a sweep: a full grid, or a sample of ranges."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from ...core.cli import need
from ...core.errors import UsageError
from .axes import MOST, Axis, check_names

SAMPLES = ("sobol", "lhs", "saltelli")
"""Low-discrepancy, Latin hypercube, and the pairs that Sobol indices need (Saltelli 2010)."""

Case = dict[str, Any]
"""A value for each axis."""


def grid(axes: Sequence[Axis]) -> list[Case]:
    """All combinations, the last axis fastest."""
    check_names(axes)
    for a in axes:
        if a.is_range:
            raise UsageError(f"--vary {a.name}={a.low:g}:{a.high:g}: a grid needs a step too, or use --sample sobol:N")
    count = int(np.prod([len(a.values) for a in axes], dtype=float))
    if count > MOST:
        raise UsageError(f"{count} cases are more than {MOST}")
    return [dict(zip((a.name for a in axes), values, strict=True)) for values in product(*(a.values for a in axes))]


def parse_sample(text: str) -> tuple[str, int]:
    """(kind, number) of `--sample kind:number`."""
    kind, colon, number = text.partition(":")
    if kind not in SAMPLES or not colon or not (number.isascii() and number.isdigit()) or int(number) < 1:
        raise UsageError(f"--sample {text}: expected one of {', '.join(f'{s}:N' for s in SAMPLES)}")
    if int(number) > MOST:
        raise UsageError(f"--sample {text}: more than {MOST} cases")
    return kind, int(number)


def sample(axes: Sequence[Axis], kind: str, number: int, seed: int = 0) -> list[Case]:
    """Cases drawn from the axes' ranges; a list of values is drawn from as if it were equally spaced.

    `saltelli` gives number (2 k + 2) cases for k axes, with number a power of two.
    """
    check_names(axes)
    if kind == "saltelli":
        points = _saltelli(axes, number, seed)
    else:
        from scipy.stats import qmc

        make = qmc.Sobol(len(axes), seed=seed) if kind == "sobol" else qmc.LatinHypercube(len(axes), seed=seed)
        if kind == "sobol":
            points = make.random_base2(int(np.ceil(np.log2(number))))[:number]
        else:
            points = make.random(number)
    if len(points) > MOST:
        raise UsageError(f"{len(points)} cases are more than {MOST}")
    return [{a.name: place(a, x) for a, x in zip(axes, row, strict=True)} for row in points.tolist()]


def place(axis: Axis, x: float) -> Any:
    """The axis' value at x in [0, 1)."""
    if axis.is_range:
        return axis.low + x * (axis.high - axis.low)
    return axis.values[min(int(x * len(axis.values)), len(axis.values) - 1)]


def problem(axes: Sequence[Axis]) -> dict[str, Any]:
    """The axes in SALib's terms, scaled to [0, 1]."""
    return {"num_vars": len(axes), "names": [a.name for a in axes], "bounds": [[0.0, 1.0]] * len(axes)}


def _saltelli(axes: Sequence[Axis], number: int, seed: int) -> np.ndarray:
    if number & (number - 1):
        raise UsageError(f"--sample saltelli:{number}: it has to be a power of two, e.g. {1 << number.bit_length()}")
    if (count := number * (2 * len(axes) + 2)) > MOST:
        raise UsageError(f"--sample saltelli:{number}: {count} cases are more than {MOST}")
    need("study", "SALib")
    from SALib.sample import sobol

    return sobol.sample(problem(axes), number, calc_second_order=True, seed=seed)
