"""One slender line by the method of characteristics: pressure waves without the dispersion that segments have.

Along dx/dt = +-c the equations of momentum and continuity are ordinary ones in p and Q (Wylie and Streeter 1993, Fluid
Transients in Systems, chapter 3), here with the laminar loss of oil whose viscosity grows with pressure. Where the
pressure would fall below the vapour's a cavity opens at the node (their section 8.2).

It is independent of the FMU's line, whose segments it judges: what is a step at the inlet stays one on its way, where
segments of any number ring.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from ..core.jit import kernel
from ..core.sea import ambient_pressure
from .table1 import BETA, P_VAPOUR, RHO

NODES = 400
"""Reaches of the line: halving them changes the loss by less than 0.05 % (RMS)."""


@kernel
def march(
    p: object, up: object, down: object, cavity: object, loss: object, steps: int, dt: float,
    Q: float, rise: float, Z: float, resistance: float, eta0: float, alpha: float, variable: bool, p_vapour: float,
) -> None:  # fmt: skip
    """Write the loss [Pa] at the start of every step into `loss` (steps,).

    p, cavity (n,): pressure [Pa] and size of the void [m3] at each node; up, down (n,): flow into and out of it [m3/s],
    which differ where there is a void. Q [m3/s] comes in at node 0 after a `rise` [s]; the last node has a constant
    pressure. Z = rho c/A [Pa s/m3]; resistance: of one reach per viscosity [1/m3].
    """
    n = len(p)
    ahead, behind = np.empty(n), np.empty(n)
    for k in range(steps):
        loss[k] = p[0] - p[n - 1]
        eta = eta0 * np.exp(alpha * min(p[0], p[n - 1]))
        for i in range(n - 1):
            if variable:
                eta = 0.5 * eta0 * (np.exp(alpha * p[i]) + np.exp(alpha * p[i + 1]))
            ahead[i + 1] = p[i] + (Z - resistance * eta) * down[i]
            behind[i] = p[i + 1] - (Z - resistance * eta) * up[i + 1]
        t = (k + 1) * dt
        inflow = Q if t >= rise else Q * t / rise
        for i in range(n - 1):
            if i == 0:
                P = behind[0] + Z * inflow
                open_in, open_out = inflow, (p_vapour - behind[0]) / Z
            else:
                P = 0.5 * (ahead[i] + behind[i])
                open_in, open_out = (ahead[i] - p_vapour) / Z, (p_vapour - behind[i]) / Z
            grown = cavity[i] + (open_out - open_in) * dt
            if (cavity[i] > 0.0 and grown > 0.0) or p_vapour > P:
                p[i], up[i], down[i], cavity[i] = p_vapour, open_in, open_out, max(grown, 0.0)
            else:
                p[i], cavity[i] = P, 0.0
                up[i] = down[i] = (P - behind[i]) / Z
        up[n - 1] = down[n - 1] = (ahead[n - 1] - p[n - 1]) / Z


def line_transient(
    alpha: float, nu0: float, length: float, diameter: float, depth: float, Q: float,
    variable: bool = True, rise: float = 0.0, stop: float = 0.5, nodes: int = NODES,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Times [s] and loss [Pa] of a line from rest, into whose inlet flows Q [m3/s] after a `rise` [s]; its outlet is
    held at the ambient pressure. The line of `table1.line_response`, with the same names.

    variable: viscosity by the pressure of each reach (True), or that at the lower port's pressure for all (False).
    """
    area, dx = pi * diameter**2 / 4.0, length / nodes
    speed = sqrt(BETA / RHO)
    steps = int(stop * speed / dx) + 1
    p, loss = np.full(nodes + 1, ambient_pressure(depth)), np.empty(steps)
    up, down, cavity = (np.zeros(nodes + 1) for _ in range(3))
    resistance = 128.0 * dx / (pi * diameter**4)
    march(p, up, down, cavity, loss, steps, dx / speed, Q, max(rise, 1e-12), RHO * speed / area, resistance,
          RHO * nu0, alpha, variable, P_VAPOUR)  # fmt: skip
    return np.arange(steps) * dx / speed, loss
