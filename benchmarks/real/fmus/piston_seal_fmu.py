"""Friction of a pneumatic piston that is moved to and fro under pressure, as an FMU: plain pythonfmu, no other file.

Position and pressure are measured and drive it. Every effect is exactly absent at its start value.
"""

from math import exp

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    # base: as found at 1 bar
    "F_coulomb": (4.8, "dry friction [N]"),
    # effects
    "k_pressure": (0.0, "friction per pressure [N/Pa]"),
    "F_more": (0.0, "friction more than at 1 bar, whatever the pressure [N]"),
    "b": (0.0, "viscous friction [N s/m]"),
    "F_stribeck": (0.0, "friction that fades with speed [N]"),
    "v_stribeck": (0.01, "speed at which it has faded to 1/e [m/s]"),
    "F_asymmetry": (0.0, "friction more when going in and less when coming out [N]"),
    "k_position": (0.0, "friction per position from mid-stroke [N/m]"),
    "softness": (0.0, "motion per force before the seal slides [m/N]"),
    "line_drop": (0.0, "force of the pressure lost between chamber and sensor per squared speed [N s2/m2]"),
}
MIDDLE = 0.017
"""Mid-stroke [m]."""


class PistonSeal(Fmi2Slave):
    """Inputs x [m], p [Pa]; output F [N]."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.p, self.F = 0.0, 0.0, 0.0
        self.register_variable(Real("x", causality=Fmi2Causality.input, description="position [m]"))
        self.register_variable(Real("p", causality=Fmi2Causality.input, description="pressure over ambient [Pa]"))
        self.register_variable(
            Real("F", causality=Fmi2Causality.output, description="friction, positive when going in [N]")
        )
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))

    def exit_initialization_mode(self):
        self.before, self.dry, self.sign = self.x, 0.0, 1.0
        self.F = 0.0

    def do_step(self, current_time, step_size):
        dx = self.x - self.before
        self.before = self.x
        v = dx / step_size
        if dx != 0.0:
            self.sign = 1.0 if dx > 0.0 else -1.0
        limit = self.F_coulomb + self.F_more + self.k_pressure * self.p + self.k_position * (self.x - MIDDLE)
        limit = max(limit + self.F_asymmetry * self.sign, 0.0)
        if self.F_stribeck > 0.0:
            limit += self.F_stribeck * exp(-abs(v) / self.v_stribeck)
        if self.softness > 0.0:
            self.dry = min(max(self.dry + dx / self.softness, -limit), limit)
        else:
            self.dry = limit * self.sign
        self.F = self.dry + v * (self.b + self.line_drop * abs(v))
        return True
