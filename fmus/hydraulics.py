"""DeepseaHydraulics: the hydraulic circuit as an FMU."""

from __future__ import annotations

from typing import Any

from ..core.errors import SimulationError
from ..hydraulics_fmu import stepping
from ..hydraulics_fmu.own_supply import in_vain, passed_over
from ..hydraulics_fmu.variables import HYDRAULICS
from .slave import Slave

UNUSED = (
    (in_vain, "supply.from_outside is true, so this does nothing: ",
     "; what gives P_s and P_r has such parameters of its own"),
    (passed_over, "with effect.umbilical_supply or effect.pump_dynamics the supply has no override and no filter "
     "before the valve, so this does nothing there: ", ""),
)  # fmt: skip
"""What finds parameters that are set and do nothing, and what is told before and behind their names."""


class DeepseaHydraulics(Slave):
    """x_h and x_ref are taken at the start of a step: x_h moves on with v_h, x_ref with the slope of its last change.

    That v_h is the rate of x_h stands in the model description (FMI: `derivative`), for masters that average inputs.
    """

    table = HYDRAULICS
    step = staticmethod(stepping.advance)

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Deep-sea valve-controlled hydraulic cylinder: oil, lines, servo valve, compensator, PID"
        self.warned_of: float | None = None
        self.told_unused: dict[Any, tuple[str, ...]] = {}
        self.told_unfed = False

    def build(self, parameters: dict[str, float]) -> None:
        inputs = ("F_hold", "P_s", "P_r", "x_h")
        force, P_s, P_r, x_h = (self.values.item(HYDRAULICS.index(name)) for name in inputs)
        self.row, held = stepping.initial_row(parameters, force, P_s, P_r, x_h)
        if not held and self.warned_of != force:
            self.warned_of = force
            self.warn(
                f"the supply cannot hold F_hold = {force:g} N against the leakage: the run starts with the valve shut "
                "and the machine will move"
            )
        self._tell_unused(parameters, P_s, P_r)

    def _tell_unused(self, parameters: dict[str, float], P_s: float, P_r: float) -> None:
        """Warn, once each, of what is set or given and does nothing; P_s, P_r: pressures [Pa] of the inputs."""
        fed = [v.name for v, given in ((HYDRAULICS["P_s"], P_s), (HYDRAULICS["P_r"], P_r)) if given != v.start]
        if fed and not parameters["supply.from_outside"] and not self.told_unfed:
            self.told_unfed = True
            self.warn(
                f"supply.from_outside is false, so what {' and '.join(fed)} are given is not used: pump, relief valve "
                "and tank are the circuit's own"
            )
        for find, before, behind in UNUSED:
            names = find(parameters)
            if names and names != self.told_unused.get(find):
                self.warn(before + ", ".join(names) + behind)
            self.told_unused[find] = names

    def heed(self, code: int, t: float, h: float) -> bool:
        if code == stepping.NOT_FOLLOWED:
            self.warn("the input x_ref changes but is not followed: command.use_input is false")
        elif code == stepping.CAVITATES:
            pressures = {name: self.values.item(HYDRAULICS.index(name)) for name in stepping.WETTED}
            lowest = min(pressures, key=pressures.__getitem__)
            self.warn(
                f"the oil cavitates at t = {t:g} s: {lowest} has fallen below its vapour pressure (voids are reckoned "
                "with, their collapse is not)"
            )
        else:
            raise SimulationError(f"{stepping.FAULTS[code]} at t = {t:g} s, step {h:g} s", t)
        return True

    def get_model_state(self) -> dict[str, Any]:
        return {"row": self.row.copy()}

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.row[:] = state["row"]
