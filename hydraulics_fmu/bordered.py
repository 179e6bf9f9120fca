"""Linear systems of the circuit's shape: a tridiagonal chain (the lines' insides) bordered by a few dense states.

The matrix is A = sigma I - J with

        J = [ T  B ]    T: nc x nc tridiagonal (sub, dia, sup)      B: nc x m dense
            [ C  D ]    C: border row i is fed by one chain column port[i], gain feed[i]      D: m x m dense

Behind the border may stand lags, `LAGS` of each flow of the chain: w' = follow (Q - w), which pull at their flow only,
Q' = ... + pull w. They are eliminated before and found after.

Factorising costs O(nc m) + O(m^3), solving O(nc + m^2). No pivoting in the chain: with flow and pressure in turn its
off-diagonals have opposite signs, so the pivots only grow; the m x m Schur complement is pivoted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import inlined, kernel
from .line import LAGS


class Jacobian(NamedTuple):
    """J by its parts: views of what somebody else owns."""

    sub: np.ndarray
    dia: np.ndarray
    sup: np.ndarray
    """The chain (nc,): row i has sub[i], dia[i], sup[i]."""
    B: np.ndarray
    """(nc, m)."""
    port: tuple[int, ...]
    feed: np.ndarray
    """Which chain columns feed the first rows of the border, and how much."""
    D: np.ndarray
    """(m, m)."""
    pull: np.ndarray
    follow: np.ndarray
    """Of the lags (LAGS times flows,), or (0,)."""


class Factors(NamedTuple):
    """The factors of A: views, too."""

    pivot: np.ndarray
    """Of the chain (nc,)."""
    Z: np.ndarray
    """T^-1 B (nc, m)."""
    S: np.ndarray
    order: np.ndarray
    """The Schur complement (m, m), decomposed, and its row exchanges (m,)."""


@kernel
def factorise(J: object, sigma: float, factors: object) -> None:
    """Factorise A into the `Factors`."""
    sub, sup, port = J.sub, J.sup, J.port
    pivot, Z, S, order = factors.pivot, factors.Z, factors.S, factors.order
    nc, m = Z.shape
    for i in range(nc):
        pivot[i] = J.dia[i]
    fold_lags(J, sigma, pivot)
    pivot[0] = sigma - pivot[0]
    for i in range(1, nc):
        pivot[i] = sigma - pivot[i] - sub[i] * sup[i - 1] / pivot[i - 1]
    for j in range(m):
        Z[0, j] = -J.B[0, j]
    for i in range(1, nc):
        w = sub[i] / pivot[i - 1]
        for j in range(m):
            Z[i, j] = w * Z[i - 1, j] - J.B[i, j]
    for j in range(m):
        Z[nc - 1, j] /= pivot[nc - 1]
    for i in range(nc - 2, -1, -1):
        for j in range(m):
            Z[i, j] = (Z[i, j] + sup[i] * Z[i + 1, j]) / pivot[i]
    for i in range(m):
        for j in range(m):
            S[i, j] = -J.D[i, j]
        S[i, i] += sigma
    for i in range(len(port)):
        for j in range(m):
            S[i, j] += J.feed[i] * Z[port[i], j]
    for k in range(m):
        p = k
        for i in range(k + 1, m):
            if abs(S[i, k]) > abs(S[p, k]):
                p = i
        order[k] = p
        if p != k:
            for j in range(m):
                S[k, j], S[p, j] = S[p, j], S[k, j]
        for i in range(k + 1, m):
            S[i, k] /= S[k, k]
            for j in range(k + 1, m):
                S[i, j] -= S[i, k] * S[k, j]


@inlined
def solve(J: object, sigma: float, factors: object, r: object) -> None:
    """Solve A u = r in place after `factorise`; r has the chain, the border and the lags."""
    eliminate_lags(J, sigma, r)
    solve_bordered(J, factors, r)
    restore_lags(J, sigma, r)


@inlined
def solve_bordered(J: object, factors: object, r: object) -> None:
    """Solve for chain and border, in place."""
    sub, sup, port, feed = J.sub, J.sup, J.port, J.feed
    pivot, Z, S, order = factors.pivot, factors.Z, factors.S, factors.order
    nc, m = Z.shape
    for i in range(1, nc):
        r[i] += sub[i] / pivot[i - 1] * r[i - 1]
    r[nc - 1] /= pivot[nc - 1]
    for i in range(nc - 2, -1, -1):
        r[i] = (r[i] + sup[i] * r[i + 1]) / pivot[i]
    for i in range(len(port)):
        r[nc + i] += feed[i] * r[port[i]]
    for k in range(m):
        p = int(order[k])
        if p != k:
            r[nc + k], r[nc + p] = r[nc + p], r[nc + k]
    for k in range(m):
        for i in range(k + 1, m):
            r[nc + i] -= S[i, k] * r[nc + k]
    for k in range(m - 1, -1, -1):
        for j in range(k + 1, m):
            r[nc + k] -= S[k, j] * r[nc + j]
        r[nc + k] /= S[k, k]
    for i in range(nc):
        total = r[i]
        for j in range(m):
            total -= Z[i, j] * r[nc + j]
        r[i] = total


@kernel
def flow_of(k: int, nc: int) -> int:
    """Place of the flow k in a chain of nc states, in which each of two lines begins with one and every second is."""
    n = nc // 4 + 1
    return 2 * k if k < n else nc // 2 + 2 * (k - n)


@kernel
def fold_lags(J: object, sigma: float, dia: object) -> None:
    """Add to the chain's diagonal what the lags of each flow make of it."""
    pull, follow = J.pull, J.follow
    for i in range(len(pull)):
        dia[flow_of(i // LAGS, len(dia))] += pull[i] * follow[i] / (sigma + follow[i])


@inlined
def eliminate_lags(J: object, sigma: float, r: object) -> None:
    """Take the lags out of the right-hand side r."""
    pull, follow, (nc, m) = J.pull, J.follow, J.B.shape
    for i in range(len(pull)):
        r[flow_of(i // LAGS, nc)] += pull[i] * r[nc + m + i] / (sigma + follow[i])


@inlined
def restore_lags(J: object, sigma: float, u: object) -> None:
    """Find the lags in the solution u from what stands in their place of the right-hand side."""
    follow, (nc, m) = J.follow, J.B.shape
    for i in range(len(follow)):
        w = nc + m + i
        u[w] = (u[w] + follow[i] * u[flow_of(i // LAGS, nc)]) / (sigma + follow[i])
