"""A linear spring with a rate form like that of oil: dF/dt = -k v, started from x at the end of the initialisation."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Spring(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k, self.x, self.v, self.F = 1.0, 0.0, 0.0, 0.0
        self.register_variable(Real("x", causality=Fmi2Causality.input))
        self.register_variable(Real("v", causality=Fmi2Causality.input))
        self.register_variable(Real("F", causality=Fmi2Causality.output))
        self.register_variable(
            Real("k", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        )
        self.started = False

    def do_step(self, current_time, step_size):
        if not self.started:
            self.F, self.started = -self.k * self.x, True
        self.F -= self.k * self.v * step_size
        return True
