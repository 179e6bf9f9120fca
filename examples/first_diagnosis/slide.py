"""A slide between springs that a measured force pushes, as an FMU: docs/first-diagnosis.md goes through it.

Built by `pythonfmu build -f slide.py effect_forms.py`.
"""

from effect_forms import DeadZone, Delay, Friction, add
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    "mass": (2.0, "mass of the slide [kg]"),
    "payload": (0.0, "mass on it [kg]"),
    "stiffness": (80.0, "stiffness of the springs [N/m]"),
    "damping": (3.0, "viscous damping of the guides [N.s/m]"),
}

STEP = 2e-3
"""Longest internal step [s]."""


class Slide(Fmi2Slave):
    """Input: force [N]; outputs: position [m], velocity [m/s]."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.force, self.position, self.velocity = 0.0, 0.0, 0.0
        self.register_variable(Real("force", causality=Fmi2Causality.input, description="force of the drive [N]"))
        out = {"causality": Fmi2Causality.output}
        self.register_variable(Real("position", **out, description="position of the slide [m]"))
        self.register_variable(Real("velocity", **out, description="velocity of the slide [m/s]"))
        for name, (value, text) in PARAMETERS.items():
            setattr(self, name, value)
            fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, **fixed, description=text))
        # what the slide may have and the model lacks, with the usual sizes
        add(self, "rub", Friction(), "the slide rubs", F_c=0.3, F_s=0.2)
        add(self, "slack", DeadZone(), "the drive does not pass small forces on", half_width=0.2)
        add(self, "late", Delay(), "the drive's force", time=0.02)

    def rate(self, force, x, v):
        """Acceleration [m/s2]."""
        inner = self.stiffness * x + self.damping * v + self.rub.force(v)
        return (force - inner) / (self.mass + self.payload)

    def do_step(self, current_time, step_size):
        force = self.slack(self.late(current_time, self.force))
        n = max(1, round(step_size / STEP))
        h = step_size / n
        for _ in range(n):  # Runge and Kutta's method of fourth order
            x, v = self.position, self.velocity
            a1 = self.rate(force, x, v)
            v2 = v + 0.5 * h * a1
            a2 = self.rate(force, x + 0.5 * h * v, v2)
            v3 = v + 0.5 * h * a2
            a3 = self.rate(force, x + 0.5 * h * v2, v3)
            v4 = v + h * a3
            a4 = self.rate(force, x + h * v3, v4)
            self.position += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            self.velocity += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        return True
