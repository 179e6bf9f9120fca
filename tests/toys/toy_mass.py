"""A mass driven by a force: exact for a force held during a step."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Mass(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.m, self.F, self.x, self.v, self.x0 = 1.0, 0.0, 0.0, 0.0, 1.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("F", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("v", causality=Fmi2Causality.output))
        self.register_variable(Real("m", **fixed))
        self.register_variable(Real("x0", **fixed))

    def exit_initialization_mode(self):
        self.x = self.x0

    def do_step(self, current_time, step_size):
        a = self.F / self.m
        self.x += step_size * (self.v + 0.5 * step_size * a)
        self.v += step_size * a
        return True
