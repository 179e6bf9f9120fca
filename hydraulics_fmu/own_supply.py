"""What belongs to the circuit's own supply and does nothing where that is from outside (`supply.from_outside`)."""

from __future__ import annotations

from collections.abc import Mapping

from .variables import HYDRAULICS

RETURN_FILTER = ("pump.displacement", "pump.speed", "relief.p_crack", "effect.filter_clogging.dp",
                 "effect.filter_clogging.back")  # fmt: skip
"""What a filter in the return, which stays, goes by: its loss is stated at the pump's flow and pressure."""

PARTS = ("pump", "relief", "tank", "compensator", "effect.pump_slip", "effect.pump_dynamics",
         "effect.umbilical_supply", "effect.relief_override", "effect.supply_droop", "effect.filter_clogging",
         "effect.compensator_trapped_air", "effect.compensator_travel")  # fmt: skip

NAMES = tuple(name for name in HYDRAULICS.parameters({}) if name.rpartition(".")[0] in PARTS)
"""Parameters of the own supply."""


def in_vain(p: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the parameters of the own supply that are set, beside their start values, and do nothing; p: by name."""
    if not p["supply.from_outside"]:
        return ()
    returns = p["effect.filter_clogging.dp"] > 0.0 and p["effect.filter_clogging.back"] > 0.0
    stay = RETURN_FILTER if returns else ()
    return tuple(name for name in NAMES if name not in stay and p[name] != HYDRAULICS[name].start)
