"""The variable table of the supply: the only place where its names, units, ranges and defaults stand."""

from __future__ import annotations

from ...core.variables import VariableTable, parameter, signal_in, signal_out, switch

AXES = 4
"""Valves that it can feed."""

_TAKEN = tuple(f"Qp[{i}]" for i in range(1, AXES + 1))

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
        parameter("depth", 11000.0, "m", 0.0, 12000.0, "depth below the surface"),
        parameter("oil.nu0", 22e-6, "m2/s", 1e-7, 1e-2, "kinematic viscosity at atmospheric pressure"),
        parameter("oil.alpha", 2.2e-8, "1/Pa", 0.0, 1e-7, "viscosity-pressure index (Barus)", 1e-8),
        parameter("oil.beta", 1.4e9, "Pa", 1e7, 1e11, "bulk modulus", 1e9),
        parameter("pump.displacement", 12e-6, "m3", 1e-8, 1e-2, "pump displacement per revolution", 1e-6),
        parameter("pump.speed", 1450.0 / 60.0, "1/s", 0.0, 1e3, "revolutions of the pump per second"),
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
        parameter("tank.volume", 0.1, "m3", 1e-4, 1e3, "volume of the oil tank"),
        parameter("compensator.m_c", 1.0, "kg", 1e-3, 1e4, "mass of the compensator piston"),
        parameter("compensator.B_c", 1000.0, "N.s/m", 0.0, 1e7, "viscous friction of the compensator piston"),
        parameter("compensator.k_c", 3000.0, "N/m", 0.0, 1e7, "stiffness of the compensator spring"),
        parameter("compensator.precompression", 0.3, "m", 0.0, 10.0, "pre-compression of the compensator spring"),
        parameter("compensator.diameter", 0.25, "m", 0.01, 5.0, "diameter of the compensator piston"),
        parameter("compensator.length", 0.25, "m", 0.01, 10.0, "length of the compensator's oil chamber at t = 0"),
    )
)  # fmt: skip
