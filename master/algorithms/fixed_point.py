"""Fixed-point iteration: every step is repeated until inputs and outputs agree, which needs FMUs that can go back.

Held inputs are the mean of what drives them over the step. Aitken's relaxation makes the iteration converge where plain
repetition would not, for one dominant mode. A step that does not settle in `MOST` repetitions ends the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from ...core.errors import CosimError, SimulationError
from ..coupling.loop_solver import at_end, refresh, stale
from ..engine.program import Memory, Program
from ..engine.runner import Runner
from ..engine.values import REAL
from ..system.system import System
from ._coupled import Coupling, Stepper
from .method import Method

MOST = 100
TOLERANCE = 1e-9
"""Relative change of the inputs between two repetitions at which they count as settled."""

SMALL = 1e-4
"""Size of an input, in its nominal value, below which changes are compared with that: at rest it is rounding."""


def takes_back(system: System) -> list[str]:
    """Components whose steps are taken back."""
    return list(system.order)


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    coupling = Coupling(system)
    steppers = [Stepper(system, system.instances[name]) for name in takes_back(system)]
    driven = at_end(system, program, stale(system)[0])
    refresh_program = system.steps.program()
    refresh(system, refresh_program, driven)
    for memory in refresh_program.memories:
        program.remember(memory)
    agree = Runner(refresh_program) if len(refresh_program) else None
    size = last = np.zeros(0)

    def begin() -> None:
        nonlocal size, last
        last = coupling.inputs_from(coupling.outputs)
        size = np.maximum(np.abs(last), SMALL * coupling.nominals())

    def restore(kept: Mapping[str, np.ndarray]) -> None:
        nonlocal size, last
        size, last = kept["size"].copy(), kept["last"].copy()

    def settle(t: float, h: float) -> int:
        states = []
        try:
            for s in steppers:
                states.append(s.save())
            return iterate(t, h, states)
        finally:
            for s, state in zip(steppers, states, strict=False):
                with suppress(CosimError):
                    s.instance.drop(state)

    def iterate(t: float, h: float, states: list[Any]) -> int:
        nonlocal last
        reals = system.buffer.reals
        y = coupling.outputs
        u, relaxation, before = last.copy(), 1.0, None
        for k in range(MOST):
            if k:
                for s, state in zip(steppers, states, strict=True):
                    s.restore(state)
            reals[coupling.targets] = u
            for s in steppers:
                s.step(t, h)
            if agree is not None:
                agree.once()
            residual = coupling.inputs_from(0.5 * (y + coupling.outputs)) - u
            np.maximum(size, np.maximum(np.abs(u), np.abs(residual)), out=size)
            if np.all(np.abs(residual) <= TOLERANCE * size):
                last = u
                return 0
            if before is not None:
                change = (residual - before) / size
                square = float(change @ change)
                if square > 0.0:
                    relaxation *= -float((before / size) @ change) / square
                    relaxation = float(np.clip(relaxation, -2.0, 2.0)) or 1.0
            before = residual
            u = u + relaxation * residual
        worst = int(np.argmax(np.abs(residual) / size))
        names = {s.place + i: s.address for s in system.inputs.values() if s.family == REAL for i in range(s.size)}
        raise SimulationError(
            f"the fixed-point iteration does not settle in {MOST} repetitions at t = {t:g} s; "
            f"'{names[int(coupling.targets[worst])]}' still changes by {residual[worst]:g}", t
        )  # fmt: skip

    program.remember(Memory("fixed point", begin, lambda: {"size": size, "last": last}, restore))
    coupling.pass_others(program)
    program.python(settle)


METHOD = Method(write, order=2, needs_state=takes_back)
