"""The variable table of the arm: with `effects`, the only place where its names, units, ranges and defaults stand."""

from __future__ import annotations

from math import radians

from ..core.variables import VariableTable, parameter, signal_in, signal_out, switch
from .effects import EFFECTS

BEAM_STRIPS = 8

BASE = ("base.heave_rate", "base.heave_acceleration", "base.pitch", "base.pitch_rate", "base.pitch_acceleration")
"""The inputs of a base that moves, in the order of `base`."""


ARM = VariableTable(
    (
        signal_in("F_h", 0.0, "N", -1e8, 1e8, 1e4, "force of the cylinder on the arm, positive extends"),
        signal_in("base.heave_rate", 0.0, "m/s", -50.0, 50.0, 1.0, "upward velocity of the base"),
        signal_in("base.heave_acceleration", 0.0, "m/s2", -1e3, 1e3, 1.0, "its rate", "base.heave_rate"),
        signal_in("base.pitch", 0.0, "rad", -3.2, 3.2, 0.1, "rotation of the base about the pivot, positive raises the "
                  "beam"),
        signal_in("base.pitch_rate", 0.0, "rad/s", -10.0, 10.0, 0.1, "its rate", "base.pitch"),
        signal_in("base.pitch_acceleration", 0.0, "rad/s2", -100.0, 100.0, 0.1, "its second rate", "base.pitch_rate"),
        signal_out("x_h", "m", 0.1, "displacement of the cylinder rod, 0 at theta0"),
        signal_out("v_h", "m/s", 0.1, "velocity of the cylinder rod, positive extends", rate_of="x_h"),
        signal_out("theta", "rad", 1.0, "angle of the beam above the horizontal"),
        signal_out("omega", "rad/s", 0.1, "angular velocity of the beam", rate_of="theta"),
        signal_out("M_hd", "N.m", 100.0, "hydrodynamic torque on the beam about its pivot, drag and inertia (Eq. 31)",
                   ("F_h",)),
        signal_out("M_hd_cylinder", "N.m", 10.0, "hydrodynamic torque on the cylinder about its base hinge", ("F_h",)),
        signal_out("M_g", "N.m", 1000.0, "torque of weight less buoyancy of beam and load about the pivot"),
        signal_out("M_F", "N.m", 1000.0, "torque of the cylinder about the pivot", ("F_h",)),
        signal_out("v_oc", "m/s", 0.5, "velocity of the current, positive towards retraction"),
        signal_out("F_hold", "N", 1e4, "cylinder force that holds the arm at rest at t = 0"),
        signal_out("P_am", "Pa", 1e8, "ambient pressure"),
        *(
            signal_out(f"strip[{i}]", "N", 10.0, f"Morison load on strip {i} of {BEAM_STRIPS} of the beam from the "
                       "pivot, normal to the beam, positive raises it", ("F_h",))
            for i in range(1, BEAM_STRIPS + 1)
        ),
        parameter("depth", 11000.0, "m", 0.0, 12000.0, "depth below the surface; sets the output P_am, the loads do "
                  "not depend on it"),
        parameter("load_weight", 800.0, "N", 0.0, 1e6, "weight of the load at the beam's end, in water"),
        parameter("beam_mass", 50.0, "kg", 0.1, 1e5, "mass of the beam"),
        parameter("beam_length", 1.605, "m", 0.01, 100.0, "length of the beam"),
        parameter("beam_diameter", 0.10, "m", 1e-3, 10.0, "outer diameter of the beam"),
        parameter("theta0", radians(23.8), "rad", -3.2, 3.2, "angle of the beam at x_h = 0"),
        parameter("rod_eye_radius", 0.212, "m", 1e-3, 100.0, "distance of the rod's eye from the pivot"),
        parameter("base_x", 0.36, "m", -100.0, 100.0, "horizontal place of the cylinder's base hinge"),
        parameter("base_y", -0.322, "m", -100.0, 100.0, "vertical place of the cylinder's base hinge"),
        parameter("piston_mass", 5.0, "kg", 0.0, 1e5, "mass of the piston, at the rod's inner end"),
        parameter("barrel_mass", 6.0, "kg", 1e-3, 1e5, "mass of the cylinder barrel"),
        parameter("barrel_length", 0.38, "m", 1e-3, 100.0, "length of the barrel from the base hinge"),
        parameter("barrel_diameter", 0.060, "m", 1e-3, 10.0, "outer diameter of the barrel"),
        parameter("rod_mass", 2.0, "kg", 1e-3, 1e5, "mass of the rod"),
        parameter("rod_length", 0.40, "m", 1e-3, 100.0, "length of the rod from its eye to the piston"),
        parameter("rod_diameter", 0.025, "m", 1e-4, 10.0, "diameter of the rod"),
        parameter("C_D", 1.2, "1", 0.0, 20.0, "drag coefficient"),
        parameter("C_M", 2.0, "1", 0.0, 20.0, "inertia coefficient"),
        switch("drag_as_printed", False, "the drag's torque is the sum of Eqs. 29 and 30 as printed, not that of the "
               "relative velocity"),
        parameter("rho_s", 1025.0, "kg/m3", 0.0, 2000.0, "density of sea water", 1000.0),
        parameter("current_speed", 0.5, "m/s", -10.0, 10.0, "steady part of the current, positive towards retraction"),
        parameter("current_amplitude", 0.0, "m/s", 0.0, 10.0, "amplitude of the sinusoidal part of the current"),
        parameter("current_frequency", 0.1, "1/s", 0.0, 100.0, "frequency of the sinusoidal part of the current"),
        *EFFECTS,
    )
)  # fmt: skip
