"""The state at rest from which every run starts: nothing moves until the command or the load does."""

from __future__ import annotations

import numpy as np

from ..core.jit import kernel
from .circuit import (
    A1,
    A2,
    A_C,
    ALPHA,
    BORDER,
    C_FURTHER,
    C_L,
    C_TURBULENT,
    ETA0,
    I_MAX,
    K_C,
    LAW,
    LINE_R,
    NULL_SHIFT,
    P_AM,
    P_CRACK,
    PRECOMPRESSION,
    Q_PUMP,
    SEGMENTS,
    VARIABLE,
    valve_flows,
)  # fmt: skip
from .cylinder import leakage
from .line import mean_viscosity
from .oil import viscosity

SMALLEST_OPENING = 1e-6
BEYOND = 2e9
"""Pressure [Pa] at which the search for a state gives a line up: more than any machine holds."""


@kernel
def line_nodes(P_start: float, q: float, sign: float, c: object, nodes: object) -> None:
    """Write the n + 1 node pressures of a line that passes q [m3/s], from the end P_start [Pa]; sign -1 follows q."""
    n = len(nodes) - 1
    nodes[0] = P_start
    for j in range(n):
        P = nodes[j]
        for _ in range(50):
            if c[VARIABLE] != 0.0:
                eta = mean_viscosity(nodes[j], P, c[ETA0], c[ALPHA], c[LAW])
            else:  # Eq. 21: the lower of the two port pressures, with equal losses of all segments
                eta = viscosity(min(P_start, P_start + n * (P - nodes[j])), c[ETA0], c[ALPHA], c[LAW])
            P_next = min(max(nodes[j] + sign * c[LINE_R] * eta * q, 0.0), BEYOND)
            if P_next == P:
                break
            P = P_next
        nodes[j + 1] = P


@kernel
def opening_for(q: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Spool position at which the valve takes q [m3/s] in at port b; an end of the stroke when it cannot."""
    low, high = -1.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle in (low, high):  # two neighbours among the numbers: it would stay there
            break
        if valve_flows(middle, Pa, Pb, Pt, c)[1] < q:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def steady_state(c: object, F_hold: float) -> tuple[object, bool]:
    """State (ny,) at rest in which the pressures hold the force F_hold [N].

    The spool stands where its flow replaces the piston's leakage q, and the integral part of the controller holds it
    there. Unknown is P2: the force gives P1, q follows, Eq. 22 gives both lines' losses, and both lands must pass q
    at one opening. The difference of the lands' flows falls with P2, so bisection closes it. A force that the supply
    cannot hold against the leakage is held by oil behind the closed valve, with the unloaded chamber at tank pressure;
    then the second result is false, and the machine sinks as fast as the piston leaks.
    """
    n = int(c[SEGMENTS])
    Pt = c[P_AM] + c[K_C] * c[PRECOMPRESSION] / c[A_C]
    P_top = Pt + c[P_CRACK]
    nodes_a = np.empty(n + 1)
    nodes_b = np.empty(n + 1)
    low, high = Pt, P_top
    q, Q_b, surplus = 0.0, 0.0, 0.0
    x_v = 0.0
    for _ in range(100):
        P_2 = 0.5 * (low + high)
        P_1 = c[P_AM] + (F_hold + (P_2 - c[P_AM]) * c[A2]) / c[A1]
        q = leakage(P_1, P_2, c[C_L], c[C_FURTHER], c[C_TURBULENT])
        line_nodes(P_1, q, 1.0, c, nodes_a)  # from the chamber back to port a
        line_nodes(P_2, q, -1.0, c, nodes_b)
        Pa, Pb = nodes_a[n], nodes_b[n]
        x_v = opening_for(q, Pa, Pb, Pt, c)
        if abs(x_v) < SMALLEST_OPENING:  # the valve shut: decide by its first opening
            x_v = SMALLEST_OPENING if q >= 0.0 else -SMALLEST_OPENING
        Q_a, Q_b, _, _ = valve_flows(x_v, Pa, Pb, Pt, c)
        surplus = Q_a - Q_b
        if P_2 in (low, high):  # as above
            break
        if surplus > 0.0:
            low = P_2
        else:
            high = P_2
    held = abs(surplus) <= 1e-6 * c[Q_PUMP] and abs(Q_b - q) <= 1e-6 * c[Q_PUMP]
    if not held:
        q, x_v = 0.0, 0.0
        P_2 = Pt if F_hold > 0.0 else c[P_AM] + ((Pt - c[P_AM]) * c[A1] - F_hold) / c[A2]
        nodes_a[:] = c[P_AM] + (F_hold + (P_2 - c[P_AM]) * c[A2]) / c[A1]
        nodes_b[:] = P_2
    b = 2 * (2 * n - 1)
    y = np.zeros(b + BORDER)
    for j in range(n):
        y[2 * j] = q
        y[2 * n - 1 + 2 * j] = q
        if j > 0:
            y[2 * j - 1] = nodes_a[n - j]
            y[2 * n - 2 + 2 * j] = nodes_b[j]
    y[b] = nodes_a[n]
    y[b + 1] = nodes_a[0]
    y[b + 2] = nodes_b[0]
    y[b + 3] = nodes_b[n]
    y[b + 4] = Pt
    if abs(x_v) <= SMALLEST_OPENING:
        x_v = 0.0
    y[b + 7] = (x_v - c[NULL_SHIFT]) * c[I_MAX]
    y[b + 8] = x_v
    return y, held
