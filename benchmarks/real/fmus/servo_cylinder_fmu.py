"""A servo valve and a differential cylinder without load, as an FMU: plain pythonfmu, no other file.

Two chambers with compliance and four orifices with one gain. A time step is implicit in pressures and velocity; Coulomb
friction and end stops act as set-valued forces, so the piston really sticks (Moreau's time stepping). Every effect is
exactly absent at its start value.
"""

from bisect import bisect
from math import ceil, copysign, exp, pi, sqrt

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

H = 1e-3
"""Longest internal time step [s]."""

P_SMALL = 2e4
"""Pressure difference below which an orifice is linear [Pa]."""

P_AMBIENT = 1e5
"""[Pa]; all other pressures are above it."""

KNOTS = (-0.4, -0.2, -0.1, -0.04, -0.01, 0.01, 0.04, 0.1, 0.2, 0.4)
"""Speeds at which the friction curve has values [m/s]."""

PARAMETERS = {
    # base: dimensions as published; pS and pT as measured at the end stops; b by least squares on the ten steady
    # forces, which is the author's model; K and dead_zone from the speeds, C_hose from the pressures' transients
    "D": (0.016, "piston diameter [m]"),
    "d": (0.010, "rod diameter [m]"),
    "x_min": (0.00555, "position at the retracted stop [m]"),
    "x_max": (0.20205, "position at the extended stop [m]"),
    "m": (0.5, "mass of piston and rod [kg]"),
    "b": (421.0, "viscous friction [N s/m]"),
    "pS": (4.37e6, "supply pressure [Pa]"),
    "pT": (0.11e6, "tank pressure [Pa]"),
    "K": (6.1e-9, "gain of an orifice [m3/(s V sqrt(Pa))]"),
    "gain_B": (1.0, "gain of the orifices of B over those of A [1]"),
    "dead_zone": (0.18, "dead zone of the valve [V]"),
    "beta": (1.2e9, "bulk modulus of the oil [Pa]"),
    "C_hose": (3.8e-13, "compliance of a chamber's hose and dead volume [m3/Pa]"),
    # state at the start of a run
    "x0": (0.00555, "position [m]"),
    "pA0": (0.25e6, "pressure A [Pa]"),
    "pB0": (3.9e6, "pressure B [Pa]"),
    # effects
    "F_coulomb": (0.0, "Coulomb friction [N]"),
    "F_offset": (0.0, "constant force on the piston [N]"),
    "F_stribeck": (0.0, "friction that fades with speed [N]"),
    "v_stribeck": (0.03, "speed at which it has faded to 1/e [m/s]"),
    "k_pressure": (0.0, "Coulomb friction per pressure over the piston [N/Pa]"),
    "b_scale": (1.0, "factor on viscous friction [1]"),
    "null_shift": (0.0, "shift of the valve's zero [V]"),
    "T_valve": (0.0, "lag of the valve [s]"),
    "delay": (0.0, "delay of the command [s]"),
    "saturation": (0.0, "share of the flow gain lost per volt [1/V]"),
    "gain_retract": (1.0, "flow gain when retracting over that when extending [1]"),
    "back_pressure": (0.0, "rise of the tank pressure per speed of the piston [Pa s/m]"),
    "droop": (0.0, "fall of the supply pressure per speed of the piston [Pa s/m]"),
    "air": (0.0, "free air in a chamber with its hose, at ambient pressure [m3]"),
    "leak_piston": (0.0, "leakage over the piston [m3/(s Pa)]"),
    "leak_valve": (0.0, "opening that each closed land keeps [V]"),
    **{f"F_curve{k}": (0.0, f"dry friction beyond all other at {v:g} m/s [N]") for k, v in enumerate(KNOTS, 1)},
}
OUTPUTS = {
    "x": "position [m]",
    "v": "speed [m/s]",
    "pA": "pressure A [Pa]",
    "pB": "pressure B [Pa]",
    "F": "pA A1 - pB A2 [N]",
}


def orifice(gain, dp):
    """Flow [m3/s] over dp [Pa] and the slope of its secant [m3/(s Pa)]; with it an implicit step never overshoots."""
    slope = gain / sqrt(sqrt(dp * dp + P_SMALL * P_SMALL))
    return slope * dp, slope


def on_curve(v, values):
    """The curve at a speed v [m/s]: straight between its knots, level beyond them."""
    i = min(max(bisect(KNOTS, v), 1), len(KNOTS) - 1)
    share = min(max((v - KNOTS[i - 1]) / (KNOTS[i] - KNOTS[i - 1]), 0.0), 1.0)
    return values[i - 1] + share * (values[i] - values[i - 1])


class ServoCylinder(Fmi2Slave):
    """Input u [V]; outputs as in OUTPUTS."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, description="valve command [V]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))
        for name, text in OUTPUTS.items():
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output, description=text))

    def exit_initialization_mode(self):
        self.A1 = pi / 4 * self.D**2
        self.A2 = self.A1 - pi / 4 * self.d**2
        self.x, self.v, self.pA, self.pB = self.x0, 0.0, self.pA0, self.pB0
        self.F = self.pA * self.A1 - self.pB * self.A2
        self.spool, self.commands = self.u, []
        self.curve = [getattr(self, f"F_curve{k}") for k in range(1, len(KNOTS) + 1)]

    def do_step(self, current_time, step_size):
        n = ceil(step_size / H - 1e-6)
        for _ in range(n):
            self.advance(step_size / n)
        self.F = self.pA * self.A1 - self.pB * self.A2
        return True

    def opening(self, h):
        """What the spool makes of the command in a time step h [V]."""
        u = self.u
        if self.delay > 0.0:
            self.commands.append(u)
            late = self.delay / h
            k = len(self.commands) - 1 - int(late)
            new, old = self.commands[max(k, 0)], self.commands[max(k - 1, 0)]
            u = new + (old - new) * (late - int(late))
        if self.T_valve > 0.0:
            self.spool += (u - self.spool) * (1.0 - exp(-h / self.T_valve))
            u = self.spool
        u += self.null_shift
        if self.dead_zone > 0.0:
            u = copysign(max(abs(u) - self.dead_zone, 0.0), u)
        return u / (1.0 + self.saturation * abs(u))

    def friction(self, way):
        """Largest dry friction against a push to that way [N]."""
        dry = self.F_coulomb + self.k_pressure * abs(self.pA - self.pB)
        if self.F_stribeck > 0.0:
            dry += self.F_stribeck * exp(-abs(self.v) / self.v_stribeck)
        if any(self.curve):
            dry += on_curve(copysign(max(abs(self.v), KNOTS[len(KNOTS) // 2]), way), self.curve)
        return max(dry, 0.0)

    def compliance(self, volume, p):
        """Of a chamber with that volume of oil at pressure p [m3/Pa]; the air in it is compressed isothermally."""
        made = self.C_hose + volume / self.beta
        if self.air > 0.0:
            made += self.air * P_AMBIENT / max(p + P_AMBIENT, P_AMBIENT) ** 2
        return made

    def advance(self, h):
        """One implicit time step h [s]."""
        u, A1, A2 = self.opening(h), self.A1, self.A2
        pS, pT = self.pS - self.droop * abs(self.v), self.pT + self.back_pressure * abs(self.v)
        KA = self.K if u > 0.0 else self.K * self.gain_retract
        KB = KA * self.gain_B
        out, back = max(u, 0.0) + self.leak_valve, max(-u, 0.0) + self.leak_valve
        qSA, gSA = orifice(KA * out, pS - self.pA)
        qAT, gAT = orifice(KA * back, self.pA - pT)
        qSB, gSB = orifice(KB * back, pS - self.pB)
        qBT, gBT = orifice(KB * out, self.pB - pT)
        qL = self.leak_piston * (self.pA - self.pB)
        # pressures after the step were the piston at rest, and their stiffness against it [m3/(s Pa)]
        sA = self.compliance(A1 * (self.x - self.x_min), self.pA) / h + gSA + gAT + self.leak_piston
        sB = self.compliance(A2 * (self.x_max - self.x), self.pB) / h + gSB + gBT + self.leak_piston
        pA, pB = self.pA + (qSA - qAT - qL) / sA, self.pB + (qSB - qBT + qL) / sB
        mass = self.m / h + self.b * self.b_scale + A1 * A1 / sA + A2 * A2 / sB
        push = self.m / h * self.v + pA * A1 - pB * A2 + self.F_offset
        v = (push - copysign(min(self.friction(push), abs(push)), push)) / mass
        x = min(max(self.x + h * v, self.x_min), self.x_max)
        if x != self.x + h * v:
            v = (x - self.x) / h
        self.x, self.v = x, v
        self.pA, self.pB = pA - A1 * v / sA, pB + A2 * v / sB
