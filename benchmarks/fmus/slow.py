"""A slow FMU written in Python (pythonfmu): y' = u - y, and a millisecond of the processor's time for every step."""

from time import thread_time

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Slow(Fmi2Slave):
    """One input, one output."""

    def __init__(self, **given):
        super().__init__(**given)
        self.u1 = 0.0
        self.y1 = 1.0
        self.register_variable(Real("u1", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y1", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        until = thread_time() + 1e-3
        self.y1 += step_size * (self.u1 - self.y1)
        while thread_time() < until:
            pass
        return True
