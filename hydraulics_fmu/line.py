"""A slender line: inertia (Eq. 13) and capacity (Eq. 14) in equal segments, with the loss of Eq. 22 or Eq. 21.

A line of n segments has n flows and n - 1 pressures inside, in turn [Q_0, p_1, Q_1, ..., p_(n-1), Q_(n-1)]; its two
ports belong to the neighbours, which also carry the half segment of oil at each end. Flow is positive from the inlet
to the outlet.
"""

from __future__ import annotations

from math import exp, log, pi, sinh, sqrt

from ..core.jit import kernel
from .oil import air_softening, pressure, viscosity


@kernel
def mean_viscosity(P_i: float, P_o: float, eta0: float, alpha: float, law: float = 0.0) -> float:
    """Viscosity [Pa s] that makes Poiseuille's law exact between the pressures P_i and P_o [Pa].

    For steady flow of a Barus fluid, dP/dx = -(128 Q / pi D^4) eta0 exp(alpha P) integrates to Eq. 22, and Eq. 22
    solved for Q is Poiseuille's law with eta = eta(P_mean) z/sinh(z), z = alpha (P_i - P_o)/2. This form is the same
    in both directions of flow and has no singularity, and a chain of segments reproduces Eq. 22 of the whole line.
    Another viscosity law is taken as exponential between the two pressures.
    """
    z = 0.5 * alpha * (P_i - P_o)
    middle = viscosity(0.5 * (P_i + P_o), eta0, alpha)
    if law != 0.0:
        eta_i, eta_o = viscosity(P_i, eta0, alpha, law), viscosity(P_o, eta0, alpha, law)
        z = 0.5 * log(eta_i / eta_o)
        middle = sqrt(eta_i * eta_o)
    z2 = z * z
    if z2 < 0.01:  # the series is exact to 1e-12 here
        shape = 1.0 - z2 * (1.0 / 6.0 - z2 * (7.0 / 360.0 - z2 * (31.0 / 15120.0 - z2 * (127.0 / 604800.0))))
    else:
        shape = z / sinh(z)
    return middle * shape


@kernel
def poiseuille_resistance(eta: float, length: float, diameter: float) -> float:
    """Laminar resistance [Pa s/m3] = 128 eta L / (pi D^4) (Eq. 21)."""
    return 128.0 * eta * length / (pi * diameter**4)


@kernel
def line_derivatives(
    y: object, first: int, n: int, P_in: float, P_out: float,
    eta0: float, alpha: float, law: float, variable: bool, p_vapour: float,
    resistance: float, inertance: float, stiffness: float, minor: float,
    beta: float, air: float, polytropic: float, f: object,
) -> None:  # fmt: skip
    """Write the time derivatives of a line's 2n - 1 states y[first:] into f[first:].

    P_in, P_out: port pressures [Pa]; resistance: of one segment per viscosity [1/m3]; inertance: rho l/A of one segment
    [kg/m4]; stiffness: beta_e/(A l) of one segment [Pa/m3]; minor: K rho/(2 A^2 n) of bends and fittings [Pa s2/m6];
    beta, air, polytropic: as in `oil.air_softening`. With `variable` false the viscosity is that at the lower of the
    two port pressures for the whole line (Eq. 21).
    """
    eta = 0.0
    if not variable:
        eta = viscosity(min(P_in, P_out), eta0, alpha, law)
    P_left = P_in
    for j in range(n):
        k = first + 2 * j
        if j < n - 1:
            P_right = pressure(y[k + 1], p_vapour)
            f[k + 1] = stiffness * air_softening(P_right, beta, air, polytropic) * (y[k] - y[k + 2])
        else:
            P_right = P_out
        if variable:
            eta = mean_viscosity(P_left, P_right, eta0, alpha, law)
        f[k] = (P_left - P_right - (resistance * eta + minor * abs(y[k])) * y[k]) / inertance
        P_left = P_right


def steady_loss(Q: float, P_o: float, eta0: float, alpha: float, length: float, diameter: float) -> float:
    """Pressure loss [Pa] of steady flow Q [m3/s] into the outlet pressure P_o [Pa] (Eq. 22); inf when Q cannot flow."""
    from math import inf, log1p

    poiseuille = poiseuille_resistance(eta0 * exp(alpha * P_o), length, diameter) * Q
    if alpha == 0.0:
        return poiseuille
    z = alpha * poiseuille
    return inf if z >= 1.0 else -log1p(-z) / alpha
