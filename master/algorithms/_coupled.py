"""What algorithms with a view of the whole coupling share: its real links as vectors, and steps of one instance."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..coupling.loop_solver import input_output_runners
from ..engine.program import Program
from ..engine.runner import Runner
from ..slaves.base import FmuInstance
from ..system.connections import SignalConnection
from ..system.system import System


class AveragedConnections:
    """The links of a system that carry means, element by element: u = factor * y + offset."""

    def __init__(self, system: System):
        self.system = system
        self.links: list[SignalConnection] = [link for link in system.links if system.writer.is_averaged(link)]
        spread = [(link, i) for link in self.links for i in range(link.source.size)]
        self.sources = np.array([link.source.place + i for link, i in spread], np.int64)
        self.targets = np.array([link.target.place + i for link, i in spread], np.int64)
        self.factors = np.array([link.conversion.factor for link, _ in spread])
        self.offsets = np.array([link.conversion.offset for link, _ in spread])
        self.ends = [(link.source, link.target) for link, _ in spread]
        self.givers = [link.source.component for link, _ in spread]
        self.takers = [link.target.component for link, _ in spread]

    def __len__(self) -> int:
        return len(self.sources)

    @property
    def outputs(self) -> np.ndarray:
        """The outputs as they are in the buffer."""
        return self.system.buffer.reals[self.sources]

    @property
    def inputs(self) -> np.ndarray:
        """The inputs as they are in the buffer."""
        return self.system.buffer.reals[self.targets]

    def nominals(self) -> np.ndarray:
        """Usual sizes of the inputs."""
        instances = self.system.instances
        spread = [
            (instances.get(link.target.component), link.target.name)
            for link in self.links
            for _ in range(link.source.size)
        ]
        return np.array([1.0 if instance is None else instance.nominal(name) for instance, name in spread])

    def inputs_from(self, y: np.ndarray) -> np.ndarray:
        """Inputs from outputs."""
        u: np.ndarray = self.factors * y + self.offsets
        return u

    def pass_on_others(self, program: Program) -> None:
        """Write the exchange of all other links."""
        coupled = set(map(id, self.links))
        for link in self.system.links:
            if id(link) not in coupled and self.system.values.has_value(link):
                self.system.writer.pass_on(program, link)


class RepeatableStep:
    """One instance's step from its inputs to its outputs, to be taken and taken back by Python code."""

    def __init__(self, system: System, instance: FmuInstance):
        self.instance = instance
        program = system.writer.program()
        program.set_inputs(instance)
        program.do_step(instance, may_be_restored=True)
        program.get_outputs(instance)
        self._runner = Runner(program)
        self._give, self._take = input_output_runners(system, instance.name)
        self._rows = np.zeros((1, 0))

    @property
    def seconds(self) -> float:
        """Time in doStep [s]."""
        return float(self._runner.seconds.sum())

    def step(self, t: float, h: float) -> None:
        """Set the inputs, step, read the outputs."""
        self._runner.run(self._rows, t, h, 0, 1, 2, t + h)

    def answer(self) -> None:
        """Set the inputs, read the outputs: what these say at once."""
        self._give.once()
        self._take.once()

    def save(self) -> Any:
        """The instance's state."""
        return self.instance.save()

    def restore(self, state: Any) -> None:
        """Back to a state, from which the end of the run has not been asked for."""
        self.instance.restore(state)
        self._runner.program.buffer.ended[:] = 0
