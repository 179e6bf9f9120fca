"""One-shot interface Jacobian: inputs that agree with the outputs which they will cause, without iterating.

Held inputs u should be the mean of what drives them over the step, u = F (y_0 + y_1) / 2 + offset. The output at its
end is foretold from the last steps and the inputs' changes du. An output is what the state gives, s, and what the
inputs there give at once, T F y (feed-through). An input that changes by du at a step's start makes s change by S du
until the step's end, by E S du in the next step, E^2 S du in the one after that, and so on, with a number E of its own
for each pair of output and input: 1 where it is integrated, 0 where it has settled within the step, as in a stiff
machine. So much of a step's change of s is known, w = E w_-1 + S du, and the rest of it is taken to be what it was:

    s_1 - s_0 = s_0 - s_-1 + (E - 1) w_-1 + S du

(sums over the inputs are meant). With D = (1 - T F)^-1 S and B = (1 - T F)^-1 (E - 1) w_-1 that is one linear system
for u:

    (1 - F D / 2) u = F (1.5 y_0 - 0.5 y_-1 + B / 2) + offset - F D / 2 u_-1

For a mass against a spring it is the implicit midpoint rule: no numerical damping, stable for every step (compare
Sicklinger et al. 2014, who iterate). S and E are measured with steps that are taken back, at the start and every
`EVERY` steps; T is what the FMUs say (directional derivatives), else measured too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.errors import SimulationError
from ..coupling.loop_solver import outdated_components, refresh
from ..coupling.perturbation import perturbed
from ..engine.program import Memory, Program
from ..slaves.base import FmuInstance
from ..system.system import System
from ._coupled import AveragedConnections, RepeatableStep
from .method import Method

EVERY = 500
"""Macro steps after which S, E and T are measured anew."""

PERTURBATION = 1e-4
"""Change of an input to measure them, relative to 1 + its size."""


MATRICES = ("change", "through", "inverse", "half", "lasting", "known")
"""What `_Jacobian` has measured and goes on with."""


def takes_back(system: System) -> list[str]:
    """Components whose steps are taken back: those that take and give."""
    coupling = AveragedConnections(system)
    return sorted(set(coupling.takers) & set(coupling.givers))


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    coupling = AveragedConnections(system)
    repeatable = {n: RepeatableStep(system, system.instances[n]) for n in takes_back(system)}
    jacobian = _Jacobian(coupling, repeatable, set(repeatable) & set(outdated_components(system)[0]))
    before = held = np.zeros(0)
    count, whole = 0, 0.0

    def begin() -> None:
        nonlocal before, held, count, whole
        before = coupling.outputs
        held = coupling.inputs_from(coupling.outputs)
        jacobian.begin()
        count, whole = 0, 0.0

    def read() -> dict[str, np.ndarray]:
        own = {"before": before, "held": held, "count": np.array([count]), "whole": np.array([whole])}
        return {**own, **jacobian.measured()}

    def restore(kept: Mapping[str, np.ndarray]) -> None:
        nonlocal before, held, count, whole
        before, held = kept["before"].copy(), kept["held"].copy()
        count, whole = int(kept["count"][0]), float(kept["whole"][0])
        jacobian.recall(kept)

    program.remember(Memory("interface Jacobian", begin, read, restore))

    def solve(t: float, h: float) -> int:
        nonlocal before, held, count, whole
        y = coupling.outputs
        if count % EVERY == 0:
            system.buffer.reals[coupling.targets] = held
            jacobian.measure(t, h)
            system.buffer.reals[coupling.sources] = y
        count += 1
        whole = max(whole, h)  # the last step may be shorter
        middle = y + 0.5 * (h / whole) * (y - before + jacobian.lasting_change())
        u = jacobian.solve(coupling.inputs_from(middle), held)
        jacobian.remember(u - held)
        before, held = y, u
        system.buffer.reals[coupling.targets] = u
        return 0

    coupling.pass_on_others(program)
    program.python(solve)
    program.advance([system.instances[name] for name in system.order])
    refresh(system, program)


class _Jacobian:
    """How outputs answer to inputs, and the linear system that makes; matrices (outputs, inputs)."""

    def __init__(
        self, coupling: AveragedConnections, repeatable: dict[str, RepeatableStep], with_feedthrough: set[str]
    ):
        """with_feedthrough: instances with direct feedthrough."""
        self.coupling, self.repeatable, self.with_feedthrough = coupling, repeatable, with_feedthrough
        self._change = np.zeros((len(coupling), len(coupling)))  # S
        self._through = np.eye(len(coupling))  # (1 - T F)^-1
        self._inverse: np.ndarray = self._through  # (1 - F D / 2)^-1
        self._half = np.zeros((len(coupling), len(coupling)))  # F D / 2
        self.begin()

    def begin(self) -> None:
        """No input has changed yet, and of none it is known how long that lasts."""
        self._lasting = np.ones((len(self.coupling), len(self.coupling)))  # E
        self._known = np.zeros((len(self.coupling), len(self.coupling)))  # w

    def measured(self) -> dict[str, np.ndarray]:
        """All matrices, by name."""
        return {name: getattr(self, f"_{name}") for name in MATRICES}

    def recall(self, measured: Mapping[str, np.ndarray]) -> None:
        """Go on with what `measured` gave."""
        for name in MATRICES:
            setattr(self, f"_{name}", measured[name].copy())

    def remember(self, change: np.ndarray) -> None:
        """The inputs have changed by that."""
        self._known = self._lasting * self._known + self._change * change

    def lasting_change(self) -> np.ndarray:
        """What earlier changes of inputs do to a step's change of the outputs, less what they did in the last one."""
        change: np.ndarray = self._through @ ((self._lasting - 1.0) * self._known).sum(axis=1)
        return change

    def measure(self, t: float, h: float) -> None:
        """Measure all that over steps from t with the inputs that are in the buffer."""
        c = self.coupling
        S, T = np.zeros((2, len(c), len(c)))
        E = self._lasting.copy()
        steps = 2 if t + 2.5 * h < c.system.stop else 1  # FMUs need not step beyond the end that they were told
        for name, one_step in self.repeatable.items():
            state = one_step.save()
            outputs = [i for i, giver in enumerate(c.givers) if giver == name]
            inputs = [j for j, taker in enumerate(c.takers) if taker == name]
            with one_step.instance.dropping(state):
                base, _ = self._steps(one_step, t, h, steps, outputs)
                for j in inputs if name in self.with_feedthrough else ():
                    slopes = self._declared_slopes(one_step.instance, outputs, j)
                    if slopes is None:
                        if one_step.instance.has_failed:
                            one_step.restore(state)
                            self._steps(one_step, t, h, steps, outputs)
                        with perturbed(c.system, c.ends[j][1], int(c.targets[j]), PERTURBATION) as perturbation:
                            one_step.answer()
                        slopes = (c.outputs[outputs] - base[-1]) / (perturbation or np.inf)
                    T[outputs, j] = slopes
                for j in inputs:
                    one_step.restore(state)
                    perturbed_steps, perturbation = self._steps(one_step, t, h, steps, outputs, j)
                    answers = (np.array(perturbed_steps) - base) / (perturbation or np.inf)
                    S[outputs, j] = answers[0]
                    if steps == 2:
                        E[outputs, j] = _lasting(*answers)
                one_step.restore(state)
        identity = np.eye(len(c))
        try:
            self._through = np.linalg.inv(identity - T * c.factors)
            self._half = 0.5 * c.factors[:, None] * (self._through @ S)
            self._inverse = np.linalg.inv(identity - self._half)
        except np.linalg.LinAlgError:
            raise SimulationError(
                f"--method interface-jacobian: inputs and outputs cannot be made to agree at t = {t:g} s; choose "
                "another method or step", t
            ) from None  # fmt: skip
        self._change, self._lasting = S, E

    def _steps(
        self, one_step: RepeatableStep, t: float, h: float, steps: int, outputs: Sequence[int], j: int | None = None
    ) -> tuple[list[np.ndarray], float]:
        """What the outputs are after each of the steps, with input j perturbed in them; the perturbation."""
        c = self.coupling
        outputs_after, perturbation = [], 0.0
        for k in range(steps):
            if j is None:
                one_step.step(t + k * h, h)
            else:
                with perturbed(c.system, c.ends[j][1], int(c.targets[j]), PERTURBATION) as perturbation:
                    one_step.step(t + k * h, h)
                if one_step.instance.name in self.with_feedthrough:
                    one_step.answer()
            outputs_after.append(c.outputs[outputs])
        return outputs_after, perturbation

    def _declared_slopes(self, instance: FmuInstance, outputs: Sequence[int], j: int) -> list[float] | None:
        """What an FMU says that its scalar outputs answer at once to an input."""
        signals = [self.coupling.ends[i][0] for i in outputs]
        if any(s.size > 1 or s.element is not None for s in (*signals, self.coupling.ends[j][1])):
            return None
        return instance.directional_derivatives([s.reference for s in signals], self.coupling.ends[j][1].reference)

    def solve(self, u_now: np.ndarray, held: np.ndarray) -> np.ndarray:
        """The inputs that agree with the outputs they will cause."""
        u: np.ndarray = self._inverse @ (u_now - self._half @ held)
        return u


def _lasting(once: np.ndarray, twice: np.ndarray) -> np.ndarray:
    """E of outputs from what an input's change does to them until the end of one step and of two."""
    ratio = np.divide(twice - once, once, out=np.ones_like(once), where=once != 0.0)
    limited: np.ndarray = np.clip(np.nan_to_num(ratio, nan=1.0), 0.0, 1.0)
    return limited


METHOD = Method(write, order=2, needs_state=takes_back)
