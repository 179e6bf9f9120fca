"""A mass on a spring with a damper, pushed by a force; as effects friction, a cubic spring, a gain of the force, and
a drive that makes it swing by itself (van der Pol). Friction may be uneven: greater one way than the other; and a curve
over velocity."""

from bisect import bisect
from math import tanh

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KNOTS = (-0.4, -0.25, -0.15, -0.05, 0.05, 0.15, 0.25, 0.4)
"""Velocities [m/s] at which the friction curve has its values; beyond the ends it is constant."""

LONGEST = 8e-3
"""Longest step of the integration [s]."""


class Oscillator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.x, self.v = 0.0, 0.0, 0.0
        self.m, self.k, self.d, self.F_c, self.k3, self.gain = 2.0, 80.0, 3.0, 0.0, 0.0, 1.0
        self.mu, self.uneven = 0.0, 0.0
        curve = [f"y{k}" for k in range(1, len(KNOTS) + 1)]
        for name in curve:
            setattr(self, name, 0.0)
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("v", causality=Fmi2Causality.output))
        for name in ("m", "k", "d", "F_c", "k3", "gain", "mu", "uneven", *curve):
            self.register_variable(Real(name, **fixed))

    def exit_initialization_mode(self):
        self.y = [getattr(self, f"y{k}") for k in range(1, len(KNOTS) + 1)]
        self.curved = any(self.y)

    def rate(self, x, v):
        force = self.gain * self.u - self.k * x - self.d * v
        if self.k3:
            force -= self.k3 * x**3
        if self.F_c:
            force -= self.F_c * (1.0 + self.uneven * tanh(v / 0.01)) * tanh(v / 0.01)
        if self.curved:
            k = min(max(bisect(KNOTS, v), 1), len(KNOTS) - 1)  # by hand: numpy takes longer for one value
            share = min(max((v - KNOTS[k - 1]) / (KNOTS[k] - KNOTS[k - 1]), 0.0), 1.0)
            force -= self.y[k - 1] + share * (self.y[k] - self.y[k - 1])
        if self.mu:
            force += self.mu * (1.0 - (x / 0.02) ** 2) * v
        return force / self.m

    def do_step(self, current_time, step_size):
        n = max(1, round(step_size / LONGEST))
        h = step_size / n
        for _ in range(n):
            x, v = self.x, self.v
            a1 = self.rate(x, v)
            v2 = v + 0.5 * h * a1
            a2 = self.rate(x + 0.5 * h * v, v2)
            v3 = v + 0.5 * h * a2
            a3 = self.rate(x + 0.5 * h * v2, v3)
            v4 = v + h * a3
            a4 = self.rate(x + h * v3, v4)
            self.x += h / 6.0 * (v + 2 * v2 + 2 * v3 + v4)
            self.v += h / 6.0 * (a1 + 2 * a2 + 2 * a3 + a4)
        return True
