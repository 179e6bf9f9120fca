"""An oscillator of one mass, driven by a measured voltage, as an FMU: plain pythonfmu, no other file.

y'' + 2 zeta w0 y' + w0^2 y = w0^2 g u. The input is known only at the start of a communication step; within the step it
is continued by the cubic through its last four values, which are a step apart. One step of Runge and Kutta's method per
communication step. Every effect is exactly absent at its start value.
"""

from math import exp

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    # base: least squares of the linear model on the runs for fitting
    "w0": (438.0, "natural frequency [rad/s]"),
    "zeta": (0.0505, "damping ratio [1]"),
    "gain": (0.995, "static gain [1]"),
    # state at the start of a run
    "y0": (0.0, "displacement [V]"),
    "v0": (0.0, "its rate [V/s]"),
    # effects
    "k2": (0.0, "spring: quadratic over linear part [1/V]"),
    "k3": (0.0, "spring: cubic over linear part [1/V2]"),
    "d2": (0.0, "damping that grows with displacement: quadratic over linear part [1/V2]"),
    "d3": (0.0, "damping: cubic in the rate [s/V2]"),
    "offset": (0.0, "constant input [V]"),
    "saturation": (0.0, "input: share lost per squared voltage [1/V2]"),
    "dead_zone": (0.0, "dead zone of the input [V]"),
    "lag": (0.0, "lag of the input [s]"),
    "dry": (0.0, "dry friction, smooth below 1 V/s [V]"),
}


class Silverbox(Fmi2Slave):
    """Input u [V]; output y [V]."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y = 0.0, 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, description="driving voltage [V]"))
        self.register_variable(Real("y", causality=Fmi2Causality.output, description="displacement [V]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))

    def exit_initialization_mode(self):
        self.y, self.v, self.z = self.y0, self.v0, self.u
        self.past = None

    def shaped(self, u):
        """The input after what happens to it before it acts [V]."""
        u += self.offset
        if self.dead_zone > 0.0:
            u -= max(-self.dead_zone, min(self.dead_zone, u))
        return u - self.saturation * u * u * u

    def rates(self, y, v, u):
        """Acceleration [V/s2]."""
        w2 = self.w0 * self.w0
        dry = self.dry * max(-1.0, min(1.0, v)) if self.dry else 0.0
        spring = y * (1.0 + y * (self.k2 + self.k3 * y))
        damping = v * (2.0 * self.zeta * self.w0 * (1.0 + self.d2 * y * y) + self.d3 * v * v)
        return w2 * (self.gain * u - spring - dry) - damping

    def do_step(self, current_time, step_size):
        u = self.u
        if self.lag > 0.0:
            self.z += (u - self.z) * (1.0 - exp(-step_size / self.lag))
            u = self.z
        a, b, c = self.past or (u, u, u)
        self.past = (u, a, b)
        middle = (35.0 * u - 35.0 * a + 21.0 * b - 5.0 * c) / 16.0
        first, middle, last = self.shaped(u), self.shaped(middle), self.shaped(4.0 * (u + b) - 6.0 * a - c)
        h, y, v = step_size, self.y, self.v
        a1 = self.rates(y, v, first)
        v2 = v + 0.5 * h * a1
        a2 = self.rates(y + 0.5 * h * v, v2, middle)
        v3 = v + 0.5 * h * a2
        a3 = self.rates(y + 0.5 * h * v2, v3, middle)
        v4 = v + h * a3
        a4 = self.rates(y + h * v3, v4, last)
        self.y = y + h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
        self.v = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        return True
