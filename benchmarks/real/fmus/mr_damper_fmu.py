"""A magnetorheological damper that is moved to and fro, as an FMU: plain pythonfmu, no other file.

Position and speed are measured and drive it. Every effect is exactly absent at its start value.
"""

from math import exp, tanh

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    # base: what least squares makes of the first two periods without any effect
    "c": (29600.0, "viscous damping [N s/m]"),
    # effects
    "F_yield": (0.0, "yield force of the fluid, at once in full (Bingham) [N]"),
    "F_hysteresis": (0.0, "yield force that builds up over a way (Bouc and Wen with exponent 1, Dahl) [N]"),
    "way": (1e-4, "way over which it comes to within 1/e of its end [m]"),
    "F_shifted": (0.0, "yield force that depends on the side of the middle (Kwok et al. 2006) [N]"),
    "v_width": (0.01, "speed within which it turns round [m/s]"),
    "v_shift": (0.01, "speed at which it is zero, with the sign of the half of the stroke [m/s]"),
    "thinning": (0.0, "share of the viscous damping that is lost per speed [s/m]"),
    "k": (0.0, "stiffness of the accumulator's gas [N/m]"),
    "F_offset": (0.0, "constant force of the accumulator's gas on the rod [N]"),
    "m": (0.0, "mass between damper and load cell [kg]"),
    "softness": (0.0, "compressibility: way of the piston per viscous force before fluid flows [m/N]"),
}


def sign(value):
    return 1.0 if value > 0.0 else -1.0 if value < 0.0 else 0.0


class MrDamper(Fmi2Slave):
    """Inputs x [m] from mid-stroke, v [m/s]; output F [N].

    What is read after a step answers to inputs at its start. So the states are brought to there, and only what is read
    is carried on to the end along straight lines: exactly, where those of the inputs last longer than a step.
    """

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.v, self.F = 0.0, 0.0, 0.0
        self.register_variable(Real("x", causality=Fmi2Causality.input, description="position from mid-stroke [m]"))
        self.register_variable(Real("v", causality=Fmi2Causality.input, description="speed [m/s]"))
        self.register_variable(Real("F", causality=Fmi2Causality.output, description="force that moves it [N]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, description=text, **fixed))

    def exit_initialization_mode(self):
        self.before = self.x, self.v
        self.built, self.viscous = 0.0, self.flowing(self.v)
        self.F = self.viscous

    def do_step(self, current_time, step_size):
        h, x, v = step_size, self.x, self.v
        x0, v0 = self.before
        self.before = x, v
        self.built = self.build_up(self.built, x - x0)
        self.viscous = self.follow(self.viscous, self.flowing(v0), self.flowing(v), h)
        x1, v1 = 2.0 * x - x0, 2.0 * v - v0
        dry = self.F_yield * sign(v1) + self.F_hysteresis * self.build_up(self.built, x1 - x)
        if self.F_shifted != 0.0:
            dry += self.F_shifted * tanh((v1 + self.v_shift * sign(x1)) / self.v_width)
        wet = self.follow(self.viscous, self.flowing(v), self.flowing(v1), h)
        self.F = wet + dry + self.k * x1 + self.F_offset + self.m * (v - v0) / h
        return True

    def build_up(self, share, dx):
        """The share z of the yield force, on a way dx [m] later: way dz = dx (1 - z sign(dx)), in closed form."""
        end = sign(dx)
        return end + (share - end) * exp(-abs(dx) / self.way)

    def flowing(self, v):
        """The viscous force at a steady speed [N]."""
        return self.c * v / (1.0 + self.thinning * abs(v))

    def follow(self, force, u0, u1, h):
        """The viscous force [N] a time h later, by way of the spring before it (Maxwell), if steady it went from u0 to
        u1 along a straight line."""
        if self.softness <= 0.0:
            return u1
        tau = self.c * self.softness
        slope = (u1 - u0) / h
        return u1 - tau * slope + (force - u0 + tau * slope) * exp(-h / tau)
