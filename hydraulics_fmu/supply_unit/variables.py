"""The variable table of the supply; what it has in common with the hydraulics is that table's."""

from __future__ import annotations

from ...core.variables import VariableTable, parameter, signal_in, signal_out, switch
from ..variables import HYDRAULICS

AXES = 4
"""Valves that it can feed."""

_TAKEN = tuple(f"Qp[{i}]" for i in range(1, AXES + 1))

_COMPENSATOR = ("m_c", "B_c", "k_c", "precompression", "diameter", "length")

SUPPLY = VariableTable(
    (
        *(signal_in(name, 0.0, "m3/s", -1.0, 1.0, 1e-4, f"flow that valve {i} takes") for i, name in
          enumerate(_TAKEN, 1)),
        *(signal_in(f"Qt[{i}]", 0.0, "m3/s", -1.0, 1.0, 1e-4, f"flow that valve {i} gives back")
          for i in range(1, AXES + 1)),
        signal_out("P_s", "Pa", 1e8, "pressure of the supply", (), _TAKEN),
        signal_out("P_r", "Pa", 1e8, "pressure of the tank", (), ()),
        signal_out("P_pump", "Pa", 1e8, "pressure at the pump, before the filter", (), _TAKEN),
        signal_out("Q_pump", "m3/s", 1e-4, "flow of the pump", (), _TAKEN),
        signal_out("Q_rv", "m3/s", 1e-4, "flow through the relief valve", (), _TAKEN),
        signal_out("V_acc", "m3", 1e-3, "oil in the accumulator", (), _TAKEN),
        *(HYDRAULICS[name] for name in ("depth", "oil.nu0", "oil.alpha", "oil.beta", "pump.speed")),
        parameter("pump.displacement", 12e-6, "m3", 1e-8, 1e-2, "pump displacement per revolution", 1e-6),
        parameter("pump.slip", 0.0, "1", 0.0, 0.9, "share of its flow that slips at the relief pressure, 0 km"),
        switch("pump.compensated", False, "the pump swivels back at its pressure instead of giving all to the relief "
               "valve"),
        parameter("pump.p_set", 20e6, "Pa", 1e5, 1e9, "pressure above the tank at which a compensated pump stops", 1e7),
        parameter("pump.droop", 0.05, "1", 1e-3, 0.5, "share by which that pressure falls from no flow to all"),
        parameter("pump.T", 0.05, "s", 1e-4, 5.0, "lag of a compensated pump"),
        parameter("relief.p_crack", 20e6, "Pa", 1e5, 1e9, "pressure above the tank that opens the relief valve", 1e7),
        parameter("relief.override", 0.02, "1", 1e-3, 1.0, "share by which its pressure rises to the pump's flow"),
        parameter("filter.dp", 0.0, "Pa", 0.0, 1e8, "loss of the filter behind the pump at its flow, at the surface"),
        parameter("manifold.volume", 1e-3, "m3", 1e-5, 10.0, "oil between pump and valves"),
        parameter("accumulator.volume", 0.0, "m3", 0.0, 10.0, "gas in the accumulator at its precharge; 0 = none"),
        parameter("accumulator.precharge", 12e6, "Pa", 1e4, 1e9, "its precharge above the sea's pressure", 1e7),
        parameter("accumulator.polytropic", 1.3, "1", 1.0, 1.67, "polytropic exponent of the gas"),
        HYDRAULICS["tank.volume"],
        *(HYDRAULICS[f"compensator.{name}"] for name in _COMPENSATOR),
    )
)  # fmt: skip
