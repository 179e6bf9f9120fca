"""The variable table of a user's arm, from its description."""

from __future__ import annotations

from ...core.variables import Variable, VariableTable, parameter, signal_in, signal_out
from .description import Description

PARAMETERS = (
    parameter("depth", 0.0, "m", 0.0, 12000.0, "depth below the surface; sets the output P_am"),
    parameter("rho_s", 1025.0, "kg/m3", 0.0, 2000.0, "density of sea water", 1000.0),
    parameter("current_speed", 0.0, "m/s", -10.0, 10.0, "current along the model's x axis"),
    parameter("drag", 1.0, "1", 0.0, 100.0, "factor on all drag coefficients"),
    parameter("inertia", 1.0, "1", 0.0, 100.0, "factor on the water that moves along, C_M - 1 of what is "
              "displaced"),
)


def table_of(d: Description) -> VariableTable:
    """Force in, displacement and velocity out for each tendon; angle or place and rate of each joint."""
    forces = [f"{t}.F" for t in d.tendons]
    made: list[Variable] = [
        signal_in(name, 0.0, "N", -1e9, 1e9, 1e4, f"force of the cylinder in tendon {t}, positive extends")
        for t, name in zip(d.tendons, forces, strict=True)
    ]
    for t in d.tendons:
        made += [
            signal_out(f"{t}.x", "m", 0.1, f"displacement of the cylinder in tendon {t}, 0 in the first pose"),
            signal_out(f"{t}.v", "m/s", 0.1, "its velocity, positive extends", rate_of=f"{t}.x"),
            signal_out(f"{t}.length", "m", 1.0, f"length of tendon {t}"),
            signal_out(f"{t}.F_hold", "N", 1e4, "force that holds the arm at rest at t = 0"),
        ]
    for name, unit in d.joints:
        made += [
            signal_out(f"{name}.q", unit, 1.0, f"position of joint {name}"),
            signal_out(f"{name}.w", f"{unit}/s", 0.1, "its rate", rate_of=f"{name}.q"),
        ]
    made.append(signal_out("P_am", "Pa", 1e8, "ambient pressure"))
    return VariableTable([*made, *PARAMETERS])
