"""Fixed-point iteration: every step is repeated until inputs and outputs agree, which needs FMUs that can go back.

Held inputs are the mean of what drives them over the step. Aitken's relaxation makes the iteration converge where plain
repetition would not, for one dominant mode. A step that does not settle in `MOST` repetitions ends the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np

from ...core.errors import SimulationError
from ..coupling.loop_solver import driven_at_end, outdated_components, refresh
from ..engine.program import Memory, Program
from ..engine.runner import Runner
from ..engine.values import REAL
from ..system.system import System
from ._coupled import AveragedConnections, RepeatableStep
from .method import Method

MOST = 100
TOLERANCE = 1e-9
"""Relative change of the inputs between two repetitions at which they count as settled."""

MIN_SIZE = 1e-4
"""Size of an input, in its nominal value, below which changes are compared with that: at rest it is rounding."""


def takes_back(system: System) -> list[str]:
    """Components whose steps are taken back."""
    return list(system.order)


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    coupling = AveragedConnections(system)
    driven = driven_at_end(system, program, outdated_components(system)[0])
    refresh_program = system.writer.program()
    refresh(system, refresh_program, driven)
    for memory in refresh_program.memories:
        program.remember(memory)
    iteration = _FixedPoint(system, coupling, Runner(refresh_program) if len(refresh_program) else None)
    program.remember(iteration.memory)
    coupling.pass_on_others(program)
    program.python(iteration.settle)


class _FixedPoint:
    """The iteration of a system's steps, and what it remembers from step to step."""

    def __init__(self, system: System, coupling: AveragedConnections, agree: Runner | None):
        """agree: makes outputs that follow from inputs at once agree with these."""
        self._system, self._coupling, self._agree = system, coupling, agree
        self._steppers = [RepeatableStep(system, system.instances[name]) for name in takes_back(system)]
        self._size = self._last = np.zeros(0)

    @property
    def memory(self) -> Memory:
        """The greatest size of each input so far, and what it settled at last."""
        return Memory("fixed point", self._begin, lambda: {"size": self._size, "last": self._last}, self._restore)

    def _begin(self) -> None:
        self._last = self._coupling.inputs_from(self._coupling.outputs)
        self._size = np.maximum(np.abs(self._last), MIN_SIZE * self._coupling.nominals())

    def _restore(self, kept: Mapping[str, np.ndarray]) -> None:
        self._size, self._last = kept["size"].copy(), kept["last"].copy()

    def settle(self, t: float, h: float) -> int:
        """Take a step from t over h [s]: repeat it from saved states until it agrees; returns the status."""
        states = []
        with ExitStack() as stack:
            for s in self._steppers:
                states.append(s.save())
                stack.enter_context(s.instance.dropping(states[-1]))
            self._iterate(t, h, states)
        return 0

    def _iterate(self, t: float, h: float, states: list[Any]) -> None:
        size, y = self._size, self._coupling.outputs
        u, relaxation, before = self._last.copy(), 1.0, None
        for k in range(MOST):
            self._repeat(t, h, u, states if k else [])
            residual = self._coupling.inputs_from(0.5 * (y + self._coupling.outputs)) - u
            np.maximum(size, np.maximum(np.abs(u), np.abs(residual)), out=size)
            if np.all(np.abs(residual) <= TOLERANCE * size):
                self._last = u
                return
            if before is not None:
                relaxation = _aitken(relaxation, before / size, (residual - before) / size)
            before = residual
            u = u + relaxation * residual
        worst = int(np.argmax(np.abs(residual) / size))
        raise SimulationError(
            f"the fixed-point iteration does not settle in {MOST} repetitions at t = {t:g} s; "
            f"'{self._address(worst)}' still changes by {residual[worst]:g}", t
        )  # fmt: skip

    def _repeat(self, t: float, h: float, u: np.ndarray, states: list[Any]) -> None:
        """The step with the inputs u, from these states where there are any."""
        for s, state in zip(self._steppers, states, strict=False):
            s.restore(state)
        self._system.buffer.reals[self._coupling.targets] = u
        for s in self._steppers:
            s.step(t, h)
        if self._agree is not None:
            self._agree.once()

    def _address(self, i: int) -> str:
        inputs = (s for s in self._system.inputs.values() if s.family == REAL)
        return {s.place + k: s.address for s in inputs for k in range(s.size)}[int(self._coupling.targets[i])]


def _aitken(relaxation: float, before: np.ndarray, change: np.ndarray) -> float:
    """The next relaxation, from the residual before and its change since, both as shares of the inputs' sizes."""
    square = float(change @ change)
    if not square > 0.0:  # also true for NaN
        return relaxation
    relaxation *= -float(before @ change) / square
    return float(np.clip(relaxation, -2.0, 2.0)) or 1.0


METHOD = Method(write, order=2, needs_state=takes_back)
