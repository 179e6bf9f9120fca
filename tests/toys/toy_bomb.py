"""Goes wrong at t_bomb: 1 gives NaN, 2 refuses the step, 3 raises, 4 raises in short steps, 5 changes its folder, 6
kills its process.

x counts time, y = 2 u + 1.
"""

import os
import signal

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Bomb(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.how, self.t_bomb, self.x, self.u = 1, 1e9, 0.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Integer("how", **fixed))
        self.register_variable(Real("t_bomb", **fixed))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: 2.0 * self.u + 1.0))

    def do_step(self, current_time, step_size):
        self.x = current_time + step_size
        if self.x > self.t_bomb:
            if self.how == 3 or (self.how == 4 and step_size < 0.07):
                raise RuntimeError("bang")
            if self.how == 5:
                os.chdir(os.path.dirname(os.path.abspath(__file__)))
            if self.how == 6:
                os.kill(os.getpid(), signal.SIGKILL)
            if self.how >= 4:
                return True
            self.x = float("nan")
            return self.how != 2
        return True
