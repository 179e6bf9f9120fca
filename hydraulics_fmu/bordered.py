"""Linear systems of the circuit's shape: a tridiagonal chain (the lines' insides) bordered by a few dense states.

The matrix is A = sigma I - J with

        J = [ T  B ]    T: nc x nc tridiagonal (sub, dia, sup)      B: nc x m dense
            [ C  D ]    C: border row i is fed by one chain column port[i], gain feed[i]      D: m x m dense

Behind the border may stand lags, so many of each flow of the chain: w' = follow (Q - w), which pull at their flow only,
Q' = ... + pull w. They are eliminated before and found after.

Factorising costs O(nc m) + O(m^3), solving O(nc + m^2). No pivoting in the chain: with flow and pressure in turn its
off-diagonals have opposite signs, so the pivots only grow; the m x m Schur complement is pivoted.
"""

from __future__ import annotations

from ..core.jit import kernel


@kernel
def factorise(
    sub: object, dia: object, sup: object, B: object, port: object, feed: object, D: object, sigma: float,
    pivot: object, Z: object, S: object, order: object,
) -> None:  # fmt: skip
    """Factorise A: the chain into `pivot` (nc) and `Z` = T^-1 B (nc, m), the Schur complement into `S`, `order` (m)."""
    nc, m = B.shape
    pivot[0] = sigma - dia[0]
    for i in range(1, nc):
        pivot[i] = sigma - dia[i] - sub[i] * sup[i - 1] / pivot[i - 1]
    for j in range(m):
        Z[0, j] = -B[0, j]
    for i in range(1, nc):
        w = sub[i] / pivot[i - 1]
        for j in range(m):
            Z[i, j] = w * Z[i - 1, j] - B[i, j]
    for j in range(m):
        Z[nc - 1, j] /= pivot[nc - 1]
    for i in range(nc - 2, -1, -1):
        for j in range(m):
            Z[i, j] = (Z[i, j] + sup[i] * Z[i + 1, j]) / pivot[i]
    for i in range(m):
        for j in range(m):
            S[i, j] = -D[i, j]
        S[i, i] += sigma
    for i in range(len(port)):
        for j in range(m):
            S[i, j] += feed[i] * Z[port[i], j]
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


@kernel
def solve(
    sub: object, sup: object, port: object, feed: object, pivot: object, Z: object, S: object, order: object, r: object
) -> None:
    """Solve A u = r in place, r of length nc + m with the border last, after `factorise`."""
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
def fold_lags(pull: object, follow: object, lags: int, sigma: float, dia: object) -> None:
    """Add to the chain's diagonal what `lags` lags of each flow make of it."""
    for i in range(len(pull)):
        dia[flow_of(i // lags, len(dia))] += pull[i] * follow[i] / (sigma + follow[i])


@kernel
def eliminate_lags(pull: object, follow: object, lags: int, sigma: float, nc: int, first: int, r: object) -> None:
    """Take the lags, which begin at `first`, out of the right-hand side r."""
    for i in range(len(pull)):
        r[flow_of(i // lags, nc)] += pull[i] * r[first + i] / (sigma + follow[i])


@kernel
def restore_lags(follow: object, lags: int, sigma: float, nc: int, first: int, u: object) -> None:
    """Find the lags in the solution u from what stands in their place of the right-hand side."""
    for i in range(len(follow)):
        u[first + i] = (u[first + i] + follow[i] * u[flow_of(i // lags, nc)]) / (sigma + follow[i])
