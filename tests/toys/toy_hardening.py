"""A spring that hardens, F = -(k x + c x^3), in a rate form that carries x on with v in a step; x = 1 at the start."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Hardening(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.v, self.k, self.c = 1.0, 0.0, 100.0, 200.0
        self.F = -(self.k + self.c)
        self.register_variable(Real("x", causality=Fmi2Causality.input))
        self.register_variable(Real("v", causality=Fmi2Causality.input))
        self.register_variable(Real("F", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        way = self.v * step_size
        self.F -= self.k * way + self.c * ((self.x + way) ** 3 - self.x**3)
        return True
