"""Two tanks, one above the other, and a pump, as an FMU: plain pythonfmu, no other file.

Levels in V of the level sensor. Ideal: x1' = k4 u - k1 sqrt(x1), x2' = k1 sqrt(x1) - k3 sqrt(x2); the upper level is
not measured, so it has a scale in which its outlet has one coefficient. Second-order steps of at most 1 s. Every effect
is exactly absent at its start value.
"""

from math import ceil, exp

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

H = 1.0
"""Longest internal time step [s]."""

PARAMETERS = {
    # base: least squares of the ideal model on the record for estimation
    "k1": (0.0539, "outlet of the upper tank [sqrt(V)/s]"),
    "k3": (0.0897, "outlet of the lower tank [sqrt(V)/s]"),
    "k4": (0.0747, "pump [1/s]"),
    "x10": (14.04, "level of the upper tank at the start [V]"),
    "x20": (5.131, "level of the lower tank at the start [V]"),
    # effects
    "spill": (0.0, "rate at which what stands above a rim flows over [1/s]"),
    "rim1": (14.0, "rim of the upper tank [V]"),
    "rim2": (10.0, "rim of the lower tank [V]"),
    "caught": (0.5, "share of the upper tank's overflow that the lower one catches [1]"),
    "spill_lower": (0.0, "the same rate, of the lower tank alone [1/s]"),
    "n1": (0.5, "exponent of the upper outlet [1]"),
    "n2": (0.5, "exponent of the lower outlet [1]"),
    "depth2": (0.0, "depth of the lower outlet below the sensor's zero [V]"),
    "leak1": (0.0, "linear part of the upper outlet [1/s]"),
    "pump_curve": (0.0, "share of flow that the pump gains per volt above 3 V [1/V]"),
    "pump_dead": (0.0, "voltage below which the pump gives nothing [V]"),
    "pump_lag": (0.0, "lag of the pump [s]"),
    "splash": (0.0, "share of the pump's flow that goes straight into the lower tank [1]"),
}


class CascadedTanks(Fmi2Slave):
    """Input u [V]; output y [V]."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y = 0.0, 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, description="pump voltage [V]"))
        self.register_variable(Real("y", causality=Fmi2Causality.output, description="level of the lower tank [V]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))

    def exit_initialization_mode(self):
        self.x1, self.x2, self.y = self.x10, self.x20, self.x20
        self.flow = self.pump()

    def pump(self):
        """Flow of the pump [V/s] once it follows."""
        return self.k4 * max(self.u - self.pump_dead, 0.0) * (1.0 + self.pump_curve * (self.u - 3.0))

    def rates(self, x1, x2):
        """Of the levels [V/s]."""
        down = self.k1 * max(x1, 0.0) ** self.n1 + self.leak1 * x1
        out = self.k3 * max(x2 + self.depth2, 0.0) ** self.n2
        return self.flow * (1.0 - self.splash) - down, down + self.flow * self.splash - out

    def do_step(self, current_time, step_size):
        n = ceil(step_size / H - 1e-6)
        h = step_size / n
        goal = self.pump()
        follows = 1.0 - exp(-h / self.pump_lag) if self.pump_lag > 0.0 else 1.0
        over = 1.0 - exp(-h * self.spill)
        over2 = 1.0 - exp(-h * (self.spill + self.spill_lower))
        for _ in range(n):
            self.flow = goal if self.pump_lag == 0.0 else self.flow + (goal - self.flow) * follows
            a, b = self.rates(self.x1, self.x2)
            a, b = self.rates(self.x1 + 0.5 * h * a, self.x2 + 0.5 * h * b)
            x1, x2 = max(self.x1 + h * a, 0.0), max(self.x2 + h * b, 0.0)
            if over > 0.0:
                lost = over * max(x1 - self.rim1, 0.0)
                x1, x2 = x1 - lost, x2 + self.caught * lost
            if over2 > 0.0:
                x2 -= over2 * max(x2 - self.rim2, 0.0)
            self.x1, self.x2 = x1, x2
        self.y = x2
        return True
