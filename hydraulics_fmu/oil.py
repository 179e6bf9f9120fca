"""Hydraulic oil: viscosity growing exponentially with pressure, and pressure that cannot fall below the vapour's."""

from __future__ import annotations

from math import exp, log, log10, sqrt

from ..core.jit import kernel
from ..core.sea import ATMOSPHERE

GAP_PRESSURE = 1e7
"""Pressure difference [Pa] at which a turbulent leakage is as large as the laminar one of the same coefficient."""

HOSE_PRESSURE = 1e7
"""Pressure above the sea's [Pa] at which the compliance of hoses is stated."""

STATED_AT = 313.15
"""Temperature [K] that parameters of the oil, and of what depends on it, are stated at."""

GAP_SMOOTHING = 1e4
"""Pressure difference [Pa] below which a turbulent leakage is made linear, so that its slope stays finite."""


@kernel
def viscosity(P: float, eta0: float, alpha: float, law: float = 0.0) -> float:
    """Dynamic viscosity [Pa s] at pressure P [Pa]: eta = eta0 exp(alpha P) (Eq. 1, Barus).

    law: 0 is Barus, 1 is Roelands (1966), ln eta = ln eta0 + (ln eta0 + 9.67) ((1 + 5.1e-9 P)^Z - 1) in SI units, with
    the Z that gives it the slope alpha at P = 0; the logarithms are mixed in between.
    """
    if law == 0.0:
        return eta0 * exp(alpha * P)
    depth = log(eta0) + 9.67
    roelands = depth * ((1.0 + 5.1e-9 * P) ** (alpha / (5.1e-9 * depth)) - 1.0)
    return eta0 * exp((1.0 - law) * alpha * P + law * roelands)


@kernel
def gap_flow(dp: float, c: float, turbulent: float = 0.0, thinner: float = 1.0) -> float:
    """Flow [m3/s] through a gap of leakage coefficient c [m3/(s Pa)] under the pressure difference dp [Pa].

    c dp where it is laminar, in proportion to how much `thinner` the oil is than that which c was stated for; of a worn
    one a share is turbulent, c sqrt(10 MPa |dp|), whatever the viscosity: alike at 10 MPa. The root is made linear
    below some 10 kPa.
    """
    if turbulent == 0.0:
        return c * dp * thinner
    root = dp * sqrt(GAP_PRESSURE) / sqrt(sqrt(dp * dp + GAP_SMOOTHING * GAP_SMOOTHING))
    return c * ((1.0 - turbulent) * thinner * dp + turbulent * root)


@kernel
def effective_bulk_modulus(beta: float, beta_wall: float) -> float:
    """Modulus [Pa] of oil in an elastic wall: 1/beta_e = 1/beta + 1/beta_wall (Eq. 15)."""
    return 1.0 / (1.0 / beta + 1.0 / beta_wall)


@kernel
def air_softening(P: float, beta: float, air: float, polytropic: float) -> float:
    """Factor on the modulus beta [Pa] of oil that carries a share `air` of free air, measured at 0.1013 MPa.

    1/K = 1/beta + air (p0/P)^(1/n)/(n P) (Merritt 1967, polytropic bubbles); the factor is K/beta and 1 without air.
    It vanishes in the deep: at 110 MPa 3 % of air leave 0.9985 of the modulus.
    """
    if air == 0.0:
        return 1.0
    return 1.0 / (1.0 + beta * air * (ATMOSPHERE / P) ** (1.0 / polytropic) / (polytropic * P))


@kernel
def modulus_factor(P: float, beta: float, c: object) -> float:
    """Factor on the modulus beta [Pa] of oil and walls at the pressure P [Pa]: K grows with it, air softens it.

    The oil's own share of 1/beta follows K0 + m P.
    """
    air, growth = c.effect.entrained_air, c.effect.bulk_modulus_pressure.m
    free = air.fraction
    if air.dissolving > 0.0:
        free /= 1.0 + air.dissolving * max(P - ATMOSPHERE, 0.0)
    if growth == 0.0:
        return air_softening(P, beta, free, air.polytropic)
    K = 1.0 / (1.0 / beta - 1.0 / c.oil.beta + 1.0 / (c.oil.beta + growth * P))
    return K / beta * air_softening(P, K, free, air.polytropic)


@kernel
def wall_softening(P: float, c: object) -> float:
    """Compliance of the lines' walls at the pressure P [Pa] relative to that which is stated: 1, or falling with the
    pressure above the sea's."""
    s = c.effect.hose_compliance.stiffening
    return 1.0 if s == 0.0 else (1.0 + s) / (1.0 + s * max(P - c.sea.p_am, 0.0) / HOSE_PRESSURE)


@kernel
def line_factor(P: float, c: object) -> float:
    """Factor on the modulus of a line [Pa], as of `modulus_factor`, with walls that get stiffer."""
    beta, hose = c.line.beta, c.effect.hose_compliance
    if hose.stiffening == 0.0:
        return modulus_factor(P, beta, c)
    wall = hose.compliance * (wall_softening(P, c) - 1.0)
    stiffer = 1.0 / (1.0 / beta + wall)
    return stiffer / beta * modulus_factor(P, stiffer, c)


@kernel
def heavier(P: float, c: object) -> float:
    """Density at the pressure P [Pa] relative to that which is stated: 1 + P/K, as far as it is switched on."""
    return 1.0 + c.effect.density_pressure.share * P / (c.oil.beta + c.effect.bulk_modulus_pressure.m * P)


def emulsion(eta: float, rho: float, beta: float, water: float) -> tuple[float, float, float]:
    """Viscosity [Pa s], density [kg/m3] and modulus [Pa] of oil with that share of water in fine drops.

    eta (1 - w)^-2.5 (Brinkman 1952, J. Chem. Phys. 20, 571), while its pressure index stays that of the oil between
    the drops; density and 1/K are those of both, by volume (water: 998 kg/m3, 2.2 GPa).
    """
    if water == 0.0:
        return eta, rho, beta
    soft = (1.0 - water) / beta + water / 2.2e9
    return eta * (1.0 - water) ** -2.5, (1.0 - water) * rho + water * 998.0, 1.0 / soft


def temperature_factor(T: float, nu_40: float) -> float:
    """Kinematic viscosity at T [K] of oil with nu_40 [m2/s] at 40 C, relative to that, by Walther's law.

    log10 log10(nu/cSt + 0.7) = A - B log10 T (ASTM D341), A from nu_40 and B that of an oil with 22 cSt at 40 C and
    4.3 cSt at 100 C, whose viscosity index is 100. Others of this index have nearly the same B: at 100 C this is 3 %
    too thin for VG 46 and 7 % for VG 68, at 0 C 7 and 17 % too thick. Oil below 2 cSt, for which the law is not made,
    changes like that of 2 cSt. Exactly 1 at 313.15 K.
    """
    y_22, y_100 = (log10(log10(nu + 0.7)) for nu in (22.0, 4.3))
    slope = (y_22 - y_100) / (log10(373.15) - log10(STATED_AT))
    y_40 = log10(log10(max(1e6 * nu_40, 2.0) + 0.7))

    def nu(kelvin: float) -> float:
        return 10.0 ** 10.0 ** (y_40 - slope * (log10(kelvin) - log10(STATED_AT))) - 0.7

    return nu(T) / nu(STATED_AT)


def expansion(T: float) -> float:
    """Volume of oil at T [K] relative to that at 40 C: 8e-4 a kelvin (Bair 2007, High Pressure Rheology for
    Quantitative Elastohydrodynamics). Exactly 1 at 313.15 K."""
    return 1.0 + 8e-4 * (T - STATED_AT)


def stiffness_factor(T: float) -> float:
    """Bulk modulus of oil at T [K] relative to that at 40 C: exp(-6.5e-3 dT) (Bair 2007, for the modulus without
    pressure in Tait's equation). Exactly 1 at 313.15 K."""
    return exp(-6.5e-3 * (T - STATED_AT))


def index_factor(eta: float, eta_40: float) -> float:
    """Viscosity-pressure index of oil with the viscosity eta relative to that of the same with eta_40 [Pa s].

    Wooster's rule: alpha = (0.6 + 0.965 log10 eta/cP) 1e-8/Pa (in Stachowiak and Batchelor, Engineering Tribology,
    2.9), not below what it gives for 1 cP. Exactly 1 for equal viscosities.
    """

    def rule(x: float) -> float:
        return 0.6 + 0.965 * max(log10(1e3 * x), 0.0)

    return rule(eta) / rule(eta_40)


@kernel
def pressure(p: float, p_vapour: float) -> float:
    """Absolute pressure P [Pa] of a volume whose content is known by its state p [Pa].

    The state obeys dp/dt = beta_e/V * (net inflow) without limit, so that volume is conserved. While the oil is
    liquid, P = p. Below the vapour pressure the volume holds oil and a void, whose size is V (p_vapour - p)/beta_e,
    and P = p_vapour^2/(2 p_vapour - p), the pressure of a gas that shares the void: positive always, continuous with
    its slope, reversible. Our choice; the paper says nothing of cavitation.
    """
    if p >= p_vapour:
        return p
    return p_vapour * p_vapour / (2.0 * p_vapour - p)
