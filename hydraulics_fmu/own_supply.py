"""What belongs to the circuit's own supply and does nothing: all of it where that is from outside
(`supply.from_outside`), some of relief valve and filter where it moves (`moving_supply`)."""

from __future__ import annotations

from collections.abc import Mapping

from .variables import HYDRAULICS

RETURN_FILTER = ("pump.displacement", "pump.speed", "relief.p_crack", "effect.filter_clogging.dp",
                 "effect.filter_clogging.back")  # fmt: skip
"""What a filter in the return, which stays, goes by: its loss is stated at the pump's flow and pressure."""

PARTS = ("pump", "relief", "tank", "compensator", "effect.pump_slip", "effect.pump_dynamics",
         "effect.umbilical_supply", "effect.relief_override", "effect.supply_droop", "effect.filter_clogging",
         "effect.compensator_trapped_air", "effect.compensator_travel")  # fmt: skip

STILL = ("effect.relief_override.R", "effect.relief_override.power", "effect.filter_clogging.dp")
"""What only a supply has that holds its pressure at once; of the filter's loss, its share in the supply."""

NAMES = tuple(name for name in HYDRAULICS.parameters({}) if name.rpartition(".")[0] in PARTS)
"""Parameters of the own supply."""


def in_vain(p: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the parameters of the own supply that are set, beside their start values, and do nothing; p: by name."""
    if not p["supply.from_outside"]:
        return ()
    returns = p["effect.filter_clogging.dp"] > 0.0 and p["effect.filter_clogging.back"] > 0.0
    stay = RETURN_FILTER if returns else ()
    return tuple(name for name in NAMES if name not in stay and p[name] != HYDRAULICS[name].start)


def passed_over(p: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the parameters of relief valve and filter that are set and that a supply with a hose or a compensated
    pump (`moving_supply`) leaves out; p: by name."""
    moves = p["effect.umbilical_supply.length"] > 0.0 or p["effect.pump_dynamics.T"] > 0.0
    if not moves or p["supply.from_outside"]:
        return ()
    acts = {
        "effect.relief_override.R": p["effect.relief_override.R"] != 0.0,
        "effect.relief_override.power": p["effect.relief_override.power"] != 1.0,
        "effect.filter_clogging.dp": p["effect.filter_clogging.dp"] > 0.0 and p["effect.filter_clogging.back"] < 1.0,
    }
    return tuple(name for name in STILL if acts[name])
