"""A slender line: inertia (Eq. 13) and capacity (Eq. 14) in equal segments, with the loss of Eq. 22 or Eq. 21.

A line of n segments has n flows and n - 1 pressures inside, in turn [Q_0, p_1, Q_1, ..., p_(n-1), Q_(n-1)]; its two
ports belong to the neighbours, which also carry the half segment of oil at each end. Flow is positive from the inlet
to the outlet.
"""

from __future__ import annotations

from math import exp, log, pi, sinh, sqrt

from ..core.jit import kernel
from .oil import line_factor, pressure, viscosity, wall_softening

LAG_WEIGHTS, LAG_RATES = (39.54, 6.212, 2.055), (4171.0, 334.7, 39.49)
"""Zielke's weighting function of unsteady laminar friction as three exponentials, rates in units of nu/R^2.

As Trikha (1975, J. Fluids Eng. 97(1)) has it with 40, 8.1, 1 and 8000, 200, 26.4; these are fitted to the exact loss of
a swinging flow, which they give within 5 % for omega R^2/nu from 0.3 to 2000, where Trikha's are off by up to 29 %.
"""

LAGS = len(LAG_RATES)
"""Lags of each flow."""


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
def turbulence(Q: float, eta: float, c: object) -> float:
    """Friction of a turbulent flow Q [m3/s] of that viscosity [Pa s] relative to a laminar one's.

    64/Re goes over to 0.3164 Re^-0.25 (Blasius) between the critical Reynolds number and one and a half times that.
    """
    line, effect = c.line, c.effect.line_turbulence
    reynolds = line.reynolds * abs(Q) / eta
    x = min((reynolds / effect.Re_crit - 1.0) / 0.5, 1.0)
    if x <= 0.0:
        return 1.0
    excess = max(0.3164 / 64.0 * reynolds**0.75 - 1.0, 0.0)
    return 1.0 + effect.share * x * x * (3.0 - 2.0 * x) * excess


@kernel
def fittings(Q: float, second: bool, c: object) -> float:
    """Loss [Pa s2/m6] of a segment's bends and fittings per Q^2, which can differ from line to line and from one
    direction to the other."""
    effect, minor = c.effect.line_minor_losses, c.line.minor
    if second:
        minor *= effect.line_b
    return minor if Q >= 0.0 else minor * effect.backward


@kernel
def half_at_chamber(P: float, c: object) -> float:
    """Volume [m3] of the half segment at a chamber, its walls' compliance counted as oil."""
    if c.effect.hose_compliance.stiffening == 0.0:
        return c.line.half_at_chamber
    walls = c.line.half_at_chamber - c.line.half_segment
    return c.line.half_segment + walls * wall_softening(P, c)


@kernel
def line_derivatives(y: object, first: int, lags: int, P_in: float, P_out: float, c: object, f: object) -> None:
    """Write the time derivatives of a line's 2n - 1 states y[first:] into f[first:], and of its lags y[lags:].

    P_in, P_out: port pressures [Pa]. With `line.variable_viscosity` zero the viscosity is that at the lower of the
    two port pressures for the whole line (Eq. 21). A lag w follows its flow at the rate r = n nu/R^2; the difference
    Q - w is Zielke's integral of the flow's history (1968, J. Basic Eng. 90) over exp(-r t), of which half the laminar
    resistance makes a loss.
    """
    line, law, p_vapour, n = c.line, c.effect.viscosity_law.share, c.oil.p_vapour, int(c.line.segments)
    variable, turbulent, eta = line.variable_viscosity != 0.0, c.effect.line_turbulence.share > 0.0, 0.0
    # numbers that a loop over stored states would have to read again each time
    softens, lagged, bent = c.oil.softens != 0.0, c.states.lags != 0.0, line.minor != 0.0
    inertance, resistance, stiffness = line.inertance, line.resistance, line.stiffness
    eta0, alpha = line.eta0, line.alpha
    if not variable:
        eta = viscosity(min(P_in, P_out), eta0, alpha, law)
    P_left = P_in
    for j in range(n):
        k = first + 2 * j
        if j < n - 1:
            P_right = pressure(y[k + 1], p_vapour)
            K = stiffness * line_factor(P_right, c) if softens else stiffness
            f[k + 1] = K * (y[k] - y[k + 2])
        else:
            P_right = P_out
        if variable:
            eta = mean_viscosity(P_left, P_right, eta0, alpha, law)
        laminar = resistance * eta
        loss = laminar * turbulence(y[k], eta, c) if turbulent else laminar
        if bent:
            loss += fittings(y[k], first > 0, c) * abs(y[k])
        f[k] = (P_left - P_right - loss * y[k]) / inertance
        if lagged:
            for i in range(LAGS):
                w = lags + LAGS * j + i
                behind = y[k] - y[w]
                f[w] = LAG_RATES[i] * line.relaxation * eta * behind
                f[k] -= 0.5 * c.effect.unsteady_line_friction.share * laminar * LAG_WEIGHTS[i] * behind / inertance
        P_left = P_right


def steady_loss(Q: float, P_o: float, eta0: float, alpha: float, length: float, diameter: float) -> float:
    """Pressure loss [Pa] of steady flow Q [m3/s] into the outlet pressure P_o [Pa] (Eq. 22); inf when Q cannot flow."""
    from math import inf, log1p

    poiseuille = poiseuille_resistance(eta0 * exp(alpha * P_o), length, diameter) * Q
    if alpha == 0.0:
        return poiseuille
    z = alpha * poiseuille
    return inf if z >= 1.0 else -log1p(-z) / alpha
