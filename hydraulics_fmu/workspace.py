"""The workspace of an instance: one row `w` of numbers, so that it can be saved and restored, and records of its parts.

It has, in this order, some scalars, the Jacobian, its factors, and room for a step. What hands such records on in every
step is inlined, since a call would copy a hundred numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import inlined, kernel
from .bordered import Factors, Jacobian
from .states import border_length, chain_length, lag_length
from .tableau import STAGES

STEP, AGE, FACTORED = 0, 1, 2
"""Scalars at the start of the workspace: proposed step [s], age of the Jacobian (-1 = none), sigma of the factors."""
SCALARS = 4
PORTS = 4


class Scratch(NamedTuple):
    """What a step needs room for: views of the workspace."""

    U: np.ndarray
    """The stages (STAGES, ny), see `tableau`."""
    moved: np.ndarray
    f: np.ndarray
    """A state beside the one where the step begins (ny,), and the rates there."""
    y_0: np.ndarray
    """The state before all (ny,), for a failure."""


@kernel
def workspace_size(c: object) -> int:
    """Length of the workspace of a machine with these constants."""
    nc, m, nl = chain_length(c), border_length(c), lag_length(c)
    jacobian = 3 * nc + nc * m + PORTS + m * m + 2 * nl
    factors = nc + nc * m + m * m + m
    return SCALARS + jacobian + factors + (STAGES + 3) * (nc + m + nl)


def new_workspace(c: object) -> np.ndarray:
    """A workspace without a Jacobian, for a machine with these constants."""
    w = np.zeros(workspace_size(c))
    w[AGE] = -1.0
    return w


@inlined
def jacobian_in(w: object, c: object) -> object:
    """The `Jacobian` of the workspace."""
    nc, m, nl = chain_length(c), border_length(c), lag_length(c)
    a = SCALARS
    sub, a = w[a : a + nc], a + nc
    dia, a = w[a : a + nc], a + nc
    sup, a = w[a : a + nc], a + nc
    B, a = w[a : a + nc * m].reshape(nc, m), a + nc * m
    feed, a = w[a : a + PORTS], a + PORTS
    D, a = w[a : a + m * m].reshape(m, m), a + m * m
    pull, a = w[a : a + nl], a + nl
    follow = w[a : a + nl]
    port = (0, nc // 2 - 1, nc // 2, nc - 1)  # what feeds the border rows pa, p1, p2, pb
    return Jacobian(sub, dia, sup, B, port, feed, D, pull, follow)


@inlined
def factors_in(w: object, c: object) -> object:
    """The `Factors` of the workspace."""
    nc, m, nl = chain_length(c), border_length(c), lag_length(c)
    a = SCALARS + 3 * nc + nc * m + PORTS + m * m + 2 * nl
    pivot, a = w[a : a + nc], a + nc
    Z, a = w[a : a + nc * m].reshape(nc, m), a + nc * m
    S, a = w[a : a + m * m].reshape(m, m), a + m * m
    return Factors(pivot, Z, S, w[a : a + m])


@inlined
def scratch_in(w: object, ny: int) -> object:
    """The `Scratch` of the workspace: its end."""
    a = len(w) - (STAGES + 3) * ny
    U, a = w[a : a + STAGES * ny].reshape(STAGES, ny), a + STAGES * ny
    return Scratch(U, w[a : a + ny], w[a + ny : a + 2 * ny], w[a + 2 * ny :])
