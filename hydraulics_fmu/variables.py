"""The variable table of the hydraulics: the only place where its names, units, ranges and defaults stand."""

from __future__ import annotations

from ..core.variables import Variable, VariableTable, count, parameter, signal_in, signal_out, switch
from .curves import knots

_STATE = ("F_hold", "x_h", "v_h")


def _effect(name: str, start: float, unit: str, low: float, high: float, text: str) -> Variable:
    return parameter(f"effect.{name}", start, unit, low, high, text)


EFFECTS = (
    _effect("cylinder_coulomb_friction.F_c", 0.0, "N", 0.0, 1e5, "Coulomb friction of the piston"),
    _effect("cylinder_coulomb_friction.uneven", 0.0, "1", -1.0, 1.0, "share by which it is greater extending"),
    _effect("cylinder_coulomb_friction.v_0", 2e-3, "m/s", 1e-6, 1.0, "velocity over which friction changes its sign"),
    _effect("cylinder_stribeck_friction.F_extra", 0.0, "N", 0.0, 1e5, "friction near standstill beyond Coulomb"),
    _effect("cylinder_stribeck_friction.v_s", 0.02, "m/s", 1e-4, 1.0, "velocity over which the Stribeck part falls"),
    _effect("cylinder_stribeck_friction.uneven", 0.0, "1", -1.0, 1.0, "share by which it is greater extending"),
    _effect("cylinder_stribeck_friction.exponent", 1.0, "1", 0.2, 5.0, "power of the velocity with which it falls"),
    _effect("cylinder_friction_curve.v_max", 0.1, "m/s", 1e-4, 10.0, "velocity at the outer knots of the curve"),
    *(_effect(f"cylinder_friction_curve.y{k}", 0.0, "N", -1e5, 1e5, f"friction against the motion at {x:g} of v_max, "
              "beyond all other") for k, x in enumerate(knots(), 1)),
    _effect("seal_pressure_friction.k_p", 0.0, "m2", 0.0, 1e-2, "friction per pressure difference over the piston"),
    _effect("seal_pressure_friction.uneven", 0.0, "1", -1.0, 1.0, "share by which it is greater extending"),
    _effect("cylinder_viscous_error.scale", 1.0, "1", 0.0, 1e3, "factor on the viscous friction of the piston"),
    _effect("entrained_air.fraction", 0.0, "1", 0.0, 0.2, "share of free air in the oil at atmospheric pressure"),
    _effect("entrained_air.polytropic", 1.2, "1", 1.0, 1.67, "polytropic exponent of the air"),
    _effect("hose_compliance.compliance", 0.0, "1/Pa", 0.0, 1e-7, "inverse bulk modulus of the lines' walls"),
    _effect("valve_dynamics.T", 0.0, "s", 0.0, 0.2, "inverse natural angular frequency of the spool; 0 = at once"),
    _effect("valve_dynamics.damping", 0.8, "1", 0.05, 5.0, "damping ratio of the spool"),
    _effect("valve_dynamics.stroke_time", 0.0, "s", 0.0, 10.0, "shortest time for a stroke of the spool; 0 = no limit"),
    _effect("command_delay.tau", 0.0, "s", 0.0, 0.2, "delay of the controller's output"),
    _effect("valve_dead_zone.overlap", 0.0, "1", 0.0, 0.9, "share of the stroke that opens nothing"),
    *(_effect(f"valve_dead_zone.{land}", 1.0, "1", low, 10.0, f"overlap of the land {text}, as a share of that; "
              "negative: underlap") for land, text, low in (("pa", "p-a", 0.0), ("at", "a-t", -10.0),
                                                            ("pb", "p-b", 0.0), ("bt", "b-t", -10.0))),
    _effect("valve_null_shift.shift", 0.0, "1", -0.5, 0.5, "offset of the spool, share of the stroke"),
    _effect("valve_leakage.c", 0.0, "m3/(s.Pa)", 0.0, 1e-9, "laminar leakage of each land"),
    *(_effect(f"valve_leakage.{land}", 1.0, "1", 0.0, 10.0, f"leakage of the land {text}, as a share of that")
      for land, text in (("pa", "p-a"), ("at", "a-t"), ("pb", "p-b"), ("bt", "b-t"))),
    _effect("valve_leakage.turbulent", 0.0, "1", 0.0, 1.0, "share of the leakage that is turbulent, at 10 MPa"),
    _effect("valve_flow_gain.scale", 1.0, "1", 0.05, 10.0, "factor on the valve's rated flow"),
    _effect("valve_flow_gain.retraction", 1.0, "1", -2.0, 3.0, "share of its error that retraction has"),
    _effect("valve_flow_gain.notch", 1.0, "1", 0.01, 1.0, "opening up to which it is wrong, its slope right beyond"),
    *(_effect(f"valve_metering_curve.y{k}", 0.0, "1", -1.0, 1.0, f"what the lands open further with the spool at "
              f"{x:g} of its stroke") for k, x in enumerate(knots(), 1)),
    _effect("piston_leakage.scale", 1.0, "1", 0.0, 1e3, "factor on the piston's leakage"),
    _effect("piston_leakage.turbulent", 0.0, "1", 0.0, 1.0, "share of the further leakage that is turbulent"),
    _effect("oil_temperature.T", 313.15, "K", 263.15, 393.15, "temperature of the oil"),
    _effect("viscosity_law.share", 0.0, "1", 0.0, 1.5, "viscosity against pressure: 0 after Barus, 1 after Roelands"),
    _effect("pump_slip.slip", 0.0, "1", 0.0, 0.9, "share of the pump's flow that slips at the relief pressure, 0 km"),
    _effect("relief_override.R", 0.0, "Pa.s/m3", 0.0, 1e12, "rise of the relief pressure with its flow"),
    _effect("supply_droop.droop", 0.0, "1", 0.0, 0.9, "share by which the relief pressure is lowered"),
    _effect("line_minor_losses.K", 0.0, "1", 0.0, 1e4, "loss coefficient of the fittings of each line"),
    _effect("line_diameter_error.scale", 1.0, "1", 0.2, 5.0, "factor on the lines' inner diameter"),
    _effect("ambient_pressure_error.scale", 1.0, "1", 0.1, 10.0, "factor on the ambient pressure"),
    _effect("controller_sampling.period", 0.0, "s", 0.0, 0.2, "period at which the controller samples; 0 = continuous"),
)  # fmt: skip
"""What a real machine may have and the plain model has not; exactly absent at the start values (ssp effects.toml)."""

HYDRAULICS = VariableTable(
    (
        signal_in("x_h", 0.0, "m", -1.0, 10.0, 0.1, "displacement of the cylinder rod, 0 = retracted"),
        signal_in("v_h", 0.0, "m/s", -50.0, 50.0, 0.1, "velocity of the cylinder rod, positive extends", "x_h"),
        signal_in("x_ref", 0.0, "m", -1.0, 10.0, 0.1, "commanded displacement, used when command.use_input is true"),
        signal_in(
            "F_hold", 6882.6, "N", -1e7, 1e7, 1e4,
            "force that holds the load at rest at t = 0; only the initial pressures depend on it",
        ),
        signal_out("F_h", "N", 1e4, "net force of the cylinder on the arm, positive extends: chambers less ambient, "
                   "friction and end stops", ("v_h", "x_h"), _STATE),
        signal_out("P1", "Pa", 1e8, "pressure in the piston-side chamber", (), _STATE),
        signal_out("P2", "Pa", 1e8, "pressure in the rod-side chamber", (), _STATE),
        signal_out("Pa", "Pa", 1e8, "pressure at valve port a", (), _STATE),
        signal_out("Pb", "Pa", 1e8, "pressure at valve port b", (), _STATE),
        signal_out("Pp", "Pa", 1e8, "supply pressure at valve port p", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("Pt", "Pa", 1e8, "tank pressure at valve port t", (), ()),
        signal_out("Q1", "m3/s", 1e-4, "flow from line a-1 into the piston-side chamber", (), _STATE),
        signal_out("Q2", "m3/s", 1e-4, "flow from the rod-side chamber into line b-2", (), _STATE),
        signal_out("Qa", "m3/s", 1e-4, "flow out of valve port a", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("Qb", "m3/s", 1e-4, "flow into valve port b", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("Qrv", "m3/s", 1e-4, "flow through the relief valve", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("x_v", "1", 1.0, "spool position, -1 to 1", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("u", "mA", 10.0, "controller output", ("x_h", "v_h", "x_ref"), _STATE),
        signal_out("x_cmd", "m", 0.1, "command in force", ("x_ref",), ()),
        parameter("depth", 11000.0, "m", 0.0, 12000.0, "depth below the surface"),
        switch("command.use_input", False, "follow the input x_ref instead of the built-in command"),
        parameter("command.target", 0.2, "m", 0.0, 10.0, "displacement that the built-in command goes to"),
        parameter("command.t_start", 2.0, "s", 0.0, 1e6, "time at which the built-in command starts to rise"),
        parameter("command.ramp_time", 5.0, "s", 1e-3, 1e6, "duration of the rise and of the fall"),
        parameter("command.hold_time", 5.0, "s", 0.0, 1e6, "time at the target between rise and fall"),
        parameter("oil.nu0", 22e-6, "m2/s", 1e-7, 1e-2, "kinematic viscosity at atmospheric pressure"),
        parameter("oil.alpha", 2.2e-8, "1/Pa", 0.0, 1e-7, "viscosity-pressure index (Barus)", 1e-8),
        parameter("oil.beta", 1.4e9, "Pa", 1e7, 1e11, "bulk modulus", 1e9),
        parameter("oil.rho", 850.0, "kg/m3", 100.0, 5000.0, "density"),
        parameter("oil.p_vapour", 3000.0, "Pa", 1.0, 1e5, "pressure below which the oil cavitates"),
        parameter("compensator.m_c", 1.0, "kg", 1e-3, 1e4, "mass of the compensator piston"),
        parameter("compensator.B_c", 1000.0, "N.s/m", 0.0, 1e7, "viscous friction of the compensator piston"),
        parameter("compensator.k_c", 3000.0, "N/m", 0.0, 1e7, "stiffness of the compensator spring"),
        parameter("compensator.precompression", 0.3, "m", 0.0, 10.0, "pre-compression of the compensator spring"),
        parameter("compensator.diameter", 0.25, "m", 0.01, 5.0, "diameter of the compensator piston"),
        parameter("compensator.length", 0.25, "m", 0.01, 10.0, "length of the compensator's oil chamber at t = 0"),
        parameter("tank.volume", 0.1, "m3", 1e-4, 1e3, "volume of the oil tank"),
        parameter("pump.displacement", 6e-6, "m3", 1e-8, 1e-2, "pump displacement per revolution", 1e-6),
        parameter("pump.speed", 1450.0 / 60.0, "1/s", 0.0, 1e3, "revolutions of the pump per second"),
        parameter("relief.p_crack", 20e6, "Pa", 1e5, 1e9, "cracking pressure of the relief valve above the tank", 1e7),
        parameter("valve.q_rated", 5e-3 / 60, "m3/s", 1e-7, 1.0, "rated flow of one land at full opening", 1e-4),
        parameter("valve.dp_rated", 3.5e6, "Pa", 1e3, 1e9, "pressure drop over one land at the rated flow", 1e6),
        parameter("valve.i_rated", 10.0, "mA", 1e-3, 1e5, "current at full opening; the controller saturates there"),
        parameter("valve.lam_crit", 1000.0, "1", 0.0, 1e5, "flow number of the laminar-turbulent transition of the "
                  "lands; 0 = turbulent throughout, as printed in the paper", 1e3),
        parameter("line.length", 4.0, "m", 0.01, 1e4, "length of each slender line"),
        parameter("line.diameter", 4e-3, "m", 1e-4, 1.0, "inner diameter of each slender line"),
        parameter("line.beta_wall", 1e18, "Pa", 1e7, 1e30, "bulk modulus of the line's wall; 1e18 = stiff", 1e9),
        switch("line.variable_viscosity", True, "loss by Eq. 22 (true) or by Eq. 21 at the outlet viscosity (false)"),
        count("line.segments", 5, 5, 100, "segments of each line"),
        parameter("cylinder.D_h", 0.045, "m", 1e-3, 5.0, "piston diameter"),
        parameter("cylinder.d_h", 0.025, "m", 1e-4, 5.0, "rod diameter"),
        parameter("cylinder.B_h", 1000.0, "N.s/m", 0.0, 1e8, "viscous friction of the piston"),
        parameter("cylinder.c_l", 5e-12, "m3/(s.Pa)", 0.0, 1e-6, "internal leakage coefficient", 1e-12),
        parameter("cylinder.stroke", 0.25, "m", 1e-3, 10.0, "stroke between the end stops"),
        parameter("cylinder.dead_volume", 20e-6, "m3", 1e-9, 1.0, "dead volume of each chamber less the line", 1e-5),
        parameter("cylinder.stop_clearance", 1e-3, "m", 0.0, 1.0, "travel beyond 0 and beyond the stroke before the "
                  "piston meets the stop"),
        parameter("cylinder.stop_stiffness", 2e7, "N/m", 1e3, 1e12, "stiffness of the end stops"),
        parameter("cylinder.stop_damping", 1e5, "N.s/m", 0.0, 1e10, "damping of the end stops while in contact"),
        parameter("sensor.gain", 1000.0, "1/m", 1e-3, 1e9, "gain of the displacement sensor"),
        parameter("controller.kp", 2.5, "mA", 0.0, 1e6, "proportional gain, per unit of the sensor"),
        parameter("controller.ki", 0.001, "mA/s", 0.0, 1e6, "integral gain, per unit of the sensor"),
        parameter("controller.kd", 0.001, "mA.s", 0.0, 1e6, "derivative gain, per unit of the sensor"),
        parameter("controller.integral_start", 0.0, "mA", -1e5, 1e5, "integral part at t = 0 beyond what replaces the "
                  "piston's leakage at rest: 0 = switched on at rest; -i_rated times the valve's null shift = at work "
                  "for long", 10.0),
        parameter("solver.rtol", 1e-5, "1", 1e-10, 1e-2, "relative tolerance of the integration in each step"),
        *EFFECTS,
    )
)  # fmt: skip
