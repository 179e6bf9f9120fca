"""DeepseaSupply: the hydraulic power unit as an FMU, for several axes on one supply."""

from __future__ import annotations

from typing import Any

from ..core.errors import ParameterError, SimulationError
from ..hydraulics_fmu.supply_unit import stepping
from ..hydraulics_fmu.supply_unit.variables import AXES, SUPPLY
from .slave import Slave


class DeepseaSupply(Slave):
    """The flows of the valves are held during a step."""

    table = SUPPLY
    step = staticmethod(stepping.advance)

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Hydraulic power unit: pump, accumulator, relief valve, filter, tank and compensator"
        self.told_spills = False

    def build(self, parameters: dict[str, float]) -> None:
        taken = self.values[stepping.FIRST_TAKEN : stepping.FIRST_TAKEN + AXES]
        self.row = stepping.initial_row(parameters, float(taken.sum()))
        p_set, p_crack = parameters["pump.p_set"], parameters["relief.p_crack"]
        if parameters["pump.compensated"] and p_set > p_crack and not self.told_spills:
            self.told_spills = True
            self.warn(
                f"pump.p_set = {p_set:g} Pa is above relief.p_crack = {p_crack:g} Pa: the relief valve spills what the "
                "compensated pump gives, which never swivels back"
            )

    def heed(self, code: int, t: float, h: float) -> bool:
        if code == stepping.TOO_LONG:
            longest = stepping.MOST_STEPS * stepping.LONGEST
            raise ParameterError(f"communication step of {h:g} s: the supply takes at most {longest:g} s")
        raise SimulationError(
            f"the supply is empty at t = {t + h:g} s: the valves take more than the pump gives, or give the tank less "
            "than they take",
            t,
        )

    def get_model_state(self) -> dict[str, Any]:
        return {"row": self.row.copy()}

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.row[:] = state["row"]
