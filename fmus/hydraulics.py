"""DeepseaHydraulics: the hydraulic circuit as an FMU."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import SimulationError
from ..hydraulics_fmu import circuit, integrator
from ..hydraulics_fmu.march import MEMORY, step
from ..hydraulics_fmu.steady import steady_state
from ..hydraulics_fmu.variables import HYDRAULICS
from .slave import Slave

JUMP_RATE = 1.0
"""A commanded displacement that changes faster [m/s] from step to step is a jump and not continued as a slope."""

_FAULTS = {
    integrator.TOO_SMALL: "the integration step fell below what time resolves",
    integrator.TOO_MANY: "the integration needs too many steps",
}


class DeepseaHydraulics(Slave):
    """x_h and x_ref are taken at the start of a step: x_h moves on with v_h, x_ref with the slope of its last change.

    That v_h is the rate of x_h stands in the model description (FMI: `derivative`), for masters that average inputs.
    """

    table = HYDRAULICS

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Deep-sea valve-controlled hydraulic cylinder: oil, lines, servo valve, compensator, PID"
        self.warned_of: float | None = None
        self._x, self._v, self._ref, self._hold = (HYDRAULICS.index(n) for n in ("x_h", "v_h", "x_ref", "F_hold"))

    def build(self, parameters: dict[str, float]) -> None:
        self.c = circuit.constants(parameters)
        self.scale = circuit.state_scales(self.c)
        force = float(self.values[self._hold])
        self.y, held = steady_state(self.c, force)
        if not held and self.warned_of != force:
            self.warned_of = force
            self.warn(
                f"the supply cannot hold F_hold = {force:g} N against the leakage: the run starts with the valve shut "
                "and the machine will move"
            )
        self.w = integrator.new_workspace(int(parameters["line.segments"]))
        self.memory = np.zeros(MEMORY)
        self.last_ref: tuple[float, float] | None = None
        self.ref_rate = 0.0
        self.unused = not parameters["command.use_input"]

    def advance(self, t: float, h: float) -> None:
        values = self.values
        x, v, ref = values.item(self._x), values.item(self._v), values.item(self._ref)
        rate = 0.0
        if self.last_ref is not None and self.last_ref[0] < t:
            rate = (ref - self.last_ref[1]) / (t - self.last_ref[0])
            if self.unused and ref != self.last_ref[1]:
                self.unused = False
                self.warn("the input x_ref changes but is not followed: command.use_input is false")
            if abs(rate) > JUMP_RATE:
                rate = 0.0
        fault = step(self.y, self.w, self.memory, self.c, self.scale, t, h, x, v, ref, rate, self.out)
        if fault:
            raise SimulationError(f"{_FAULTS[fault]} at t = {t:g} s, step {h:g} s", t)
        self.last_ref, self.ref_rate = (t, ref), rate

    def outputs(self) -> None:
        values = self.values
        x, v, ref = values.item(self._x), values.item(self._v), values.item(self._ref)
        step(self.y, self.w, self.memory, self.c, self.scale, self.time, 0.0, x, v, ref, self.ref_rate, self.out)

    def get_model_state(self) -> dict[str, Any]:
        return {
            "y": self.y.copy(),
            "w": self.w.copy(),
            "memory": self.memory.copy(),
            "last_ref": self.last_ref,
            "ref_rate": self.ref_rate,
        }

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.y[:], self.w[:], self.memory[:] = state["y"], state["w"], state["memory"]
        self.last_ref = tuple(state["last_ref"]) if state["last_ref"] else None
        self.ref_rate = state["ref_rate"]
