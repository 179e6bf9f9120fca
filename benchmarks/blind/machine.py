"""Parameters of the blind benchmark's machine: the plain machine, and what a real one has beyond it.

The plant is a monolithic ordinary differential equation, grown from the equations of Wu et al. (2022), J. Mar. Sci.
Eng. 10(3), 362; it shares no code with the project. SI units throughout; pressures are absolute. Every effect is
exactly absent at its default value.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import exp, log, pi

import numpy as np

ATMOSPHERE = 101300.0
"""Pressure at the surface, and the least ambient pressure (Pa)."""

VOGEL_C = 178.15
VOGEL_B = log(22.0 / 4.3) / (1.0 / (313.15 - VOGEL_C) - 1.0 / (373.15 - VOGEL_C))
"""Constants (K) of Vogel's viscosity law nu = A exp(B/(T - C)) through 22 cSt at 40 C and 4.3 cSt at 100 C."""


@dataclass(frozen=True)
class Machine:
    """The machine of one run: plain parameters first, then the effects; the defaults are the plain machine."""

    depth: float = 0.0  # m

    # Oil, Eq. 1
    rho: float = 850.0  # kg/m3
    nu0: float = 22e-6  # m2/s
    alpha: float = 2.2e-8  # 1/Pa
    beta: float = 1.4e9  # Pa
    vapour_pressure: float = 3000.0  # Pa

    # Tank and compensator, Eqs. 2, 3
    tank_volume: float = 0.1  # m3
    compensator_diameter: float = 0.25  # m
    compensator_length: float = 0.25  # m
    compensator_mass: float = 1.0  # kg
    compensator_damping: float = 1000.0  # N s/m
    compensator_stiffness: float = 3000.0  # N/m
    compensator_precompression: float = 0.3  # m

    # Pump and relief valve, Eqs. 4-7
    pump_displacement: float = 6e-6  # m3/rev
    pump_speed: float = 1450.0 / 60.0  # rev/s
    relief_pressure: float = 20e6  # Pa
    supply_volume: float = 60e-6  # m3, only with relief override

    # Servo valve, Eqs. 8-12
    rated_flow: float = 5e-3 / 60.0  # m3/s through one land
    rated_drop: float = 3.5e6  # Pa, of one land
    rated_current: float = 10.0  # mA
    discharge_coefficient: float = 0.7
    lam_crit: float = 1000.0  # flow number of the laminar-turbulent transition of the plain machine

    # Lines, Eqs. 13-22
    line_length: float = 4.0  # m
    line_diameter: float = 4e-3  # m

    # Cylinder, Eqs. 23-27
    bore: float = 0.045  # m
    rod_diameter: float = 0.025  # m
    stroke: float = 0.25  # m
    dead_volume: float = 20e-6  # m3, each chamber
    leakage: float = 5e-12  # m3/s/Pa
    cylinder_damping: float = 1000.0  # N s/m
    stop_clearance: float = 1e-3  # m, beyond either end of the stroke
    stop_stiffness: float = 2e7  # N/m
    stop_damping: float = 1e5  # N s/m
    stop_damping_depth: float = 1e-4  # m, penetration of full damping

    # Controller and command
    sensor_gain: float = 1000.0  # 1/m
    gain_p: float = 2.5  # mA
    gain_i: float = 0.001  # mA/s
    gain_d: float = 0.001  # mA s
    target: float = 0.2  # m
    t_start: float = 2.0  # s
    ramp_time: float = 5.0  # s
    hold_time: float = 5.0  # s

    # Linkage
    gravity: float = 9.81  # m/s2
    beam_length: float = 1.605  # m
    beam_diameter: float = 0.10  # m
    beam_mass: float = 50.0  # kg
    load_weight: float = 800.0  # N
    eye_radius: float = 0.212  # m, rod eye on the beam axis
    base_x: float = 0.36  # m, cylinder base hinge
    base_y: float = -0.322  # m
    theta0: float = np.deg2rad(23.8)  # rad, beam angle at x_h = 0
    barrel_mass: float = 6.0  # kg
    barrel_length: float = 0.38  # m, from the base hinge
    barrel_diameter: float = 0.060  # m
    rod_mass: float = 2.0  # kg
    rod_length: float = 0.40  # m, from the eye backwards
    piston_mass: float = 5.0  # kg, at the rod's inner end

    # Sea water, Eqs. 28-31
    rho_sea: float = 1025.0  # kg/m3
    drag_coefficient: float = 1.2
    inertia_coefficient: float = 2.0
    current: float = 0.5  # m/s along +x

    # Effects that the catalogue knows; see `forms` for the equations
    coulomb: float = 0.0  # N
    stribeck: float = 0.0  # N, static less Coulomb friction
    stribeck_velocity: float = 0.02  # m/s
    seal_friction: float = 0.0  # m2, friction per pressure difference over the piston
    friction_velocity: float = 1.5e-3  # m/s, over which friction turns its sign
    viscous_scale: float = 1.0
    air: float = 0.0  # share of free air at atmospheric pressure
    hose: float = 0.0  # 1/Pa, compliance of the lines' walls at 10 MPa above ambient
    spool_time: float = 0.0  # s, inverse natural angular frequency
    spool_damping: float = 0.8
    spool_rate: float = 60.0  # 1/s, greatest speed of the spool in strokes
    delay: float = 0.0  # s
    overlap: float = 0.0  # share of the stroke
    null_shift: float = 0.0  # share of the stroke
    valve_leak: float = 0.0  # m3/s/Pa, each land, spool in the middle
    flow_gain: float = 1.0
    lam_shift: float = 1000.0  # flow number of the transition of the real lands
    leakage_scale: float = 1.0
    temperature: float = 313.15  # K
    override: float = 0.0  # Pa s/m3
    droop: float = 0.0  # share of the relief pressure
    slip: float = 0.0  # share of the pump's flow that slips at the relief pressure with the oil of the surface
    minor_loss: float = 0.0  # loss coefficient of each line
    diameter_scale: float = 1.0
    joint_friction: float = 0.0  # N m
    payload_scale: float = 1.0
    buoyancy: float = 0.0  # N upwards at the beam's middle
    growth: float = 0.0  # m, thickness
    drag_scale: float = 1.0
    current_offset: float = 0.0  # m/s
    swing_amplitude: float = 0.0  # m/s
    swing_frequency: float = 0.1  # Hz
    swing_phase: float = 0.0  # rad
    ambient_scale: float = 1.0
    sampling: float = 0.0  # s
    roelands: float = 0.0  # 0: Barus, 1: Roelands with the same slope at no pressure

    # Other forms of these effects; at the defaults each effect has its plain form, see `effect_forms`
    friction_uneven: float = 0.0  # share by which friction is greater extending and less retracting
    stribeck_exponent: float = 2.0
    presliding: float = 0.0  # m, deflection of the bristles (LuGre) at full Coulomb, Stribeck or seal friction
    presliding_time: float = 3e-3  # s, damping of the bristles near rest over their stiffness
    viscous_power: float = 1.0  # exponent of the velocity in the wrong viscous friction
    joint_uneven: float = 0.0  # share by which the pivot's friction is greater upwards and less downwards
    air_exponent: float = 1.1  # polytropic exponent of the bubbles
    air_half: float = 40e6  # Pa above atmospheric, at which half of the air is dissolved
    hose_fade: float = 0.2  # compliance that a full hose has lost, share of that at 10 MPa
    overlap_pa: float = 1.0  # overlap of each land relative to `overlap`; negative: underlap, returns only
    overlap_at: float = 1.0
    overlap_pb: float = 1.0
    overlap_bt: float = 1.0
    leak_pa: float = 1.0  # leakage of each land relative to `valve_leak`
    leak_at: float = 1.0
    leak_pb: float = 1.0
    leak_bt: float = 1.0
    leak_turbulent: float = 0.0  # share of the valve's leakage, at 10 MPa, that is turbulent
    gain_retract: float = 1.0  # share of the flow gain's deviation that retraction has
    notch: float = 1.0  # opening up to which the flow gain deviates; its slope is right beyond
    piston_turbulent: float = 0.0  # share of the piston's further leakage, at 10 MPa, that is turbulent
    piston_opening: float = 0.0  # growth of the piston's further leakage over 10 MPa
    slip_turbulent: float = 0.0  # share of the slip, at the relief pressure, that is turbulent
    override_bend: float = 0.08  # bend of the relief valve's characteristic
    droop_time: float = 0.0  # s, in which the supply droops after the start
    minor_b: float = 1.0  # minor losses of line b relative to line a
    minor_back: float = 1.0  # minor losses of flow towards the tank relative to flow from the pump
    line_share: float = 1.0  # share of the oil's temperature error that the lines' oil has
    load_place: float = 1.0  # place of what the load is too much, share of the beam's length
    outer_from: float = 0.0  # place on the beam beyond which growth and wrong drag are, share of its length
    current_shear: float = 0.0  # how much more of the current's error there is at the beam's end than in its middle
    swing_harmonic: float = 0.1  # second harmonic of the swinging current

    # Effects that the catalogue does not know
    scoring: float = 0.0  # N, friction of a scored place of the barrel
    scoring_place: float = 0.08  # m
    scoring_width: float = 0.012  # m
    warming: float = 0.0  # K, rise of the oil's temperature in a long run
    warming_time: float = 8.0  # s
    tether: float = 0.0  # N/m, spring at the load, slack below tether_angle
    tether_angle: float = 0.8  # rad
    impact: float = 0.0  # N, blows on the load
    impact_start: float = 3.3  # s
    impact_period: float = 4.1  # s
    impact_time: float = 0.06  # s, of one blow
    flexibility: float = 0.0  # rad/(N m), bending of the beam under the load
    play: float = 0.0  # share of the stroke, half-width of the spool's hysteresis
    one_way: float = 0.0  # loss coefficient of a stuck check valve in line b-2, while extending
    viv: float = 0.0  # N m, vortex-induced torque on the beam with a current of 0.5 m/s
    viv_strouhal: float = 0.2
    hunting: float = 0.0  # share of the relief pressure that swings
    hunting_frequency: float = 2.5  # Hz
    dip: float = 0.0  # share by which the supply pressure falls for a while
    dip_time: float = 6.0  # s, middle
    dip_width: float = 0.6  # s
    cushion: float = 0.0  # loss coefficient of chamber 1's outlet at the very end of the stroke
    cushion_length: float = 0.03  # m
    gas_pocket: float = 0.0  # m3, gas in the middle of line a-1 at 5 MPa above ambient
    external_leak: float = 0.0  # m3/s/Pa, chamber 1 to the sea at low pressure
    stiffening: float = 0.0  # growth of the bulk modulus per pressure
    bristle: float = 0.0  # N, LuGre friction with soft bristles
    bristle_length: float = 1.5e-3  # m, deflection at full friction

    play_rate: float = 300.0  # 1/s, at which the spool follows beyond its play

    # Effects of the catalogue that are drawn since edition 3
    silt: float = 0.0  # share of the stroke that a silted spool withstands
    silt_time: float = 10.0  # s
    clearance: float = 0.0  # m, of the rod in its eye
    density: float = 0.0  # share of the density's growth with pressure
    water: float = 0.0  # share of water in the oil
    turbulence: float = 0.0  # share of turbulent friction in the lines
    roughness: float = 0.0  # of the lines' walls, share of the diameter
    history: float = 0.0  # share of unsteady laminar friction in the lines
    line_cooling: float = 0.0  # K, by which the lines' oil is colder, in the mean
    hold_set: float = 0.0  # Pa, of a counterbalance valve at the piston side
    hold_ratio: float = 4.0  # of its pilot
    filter: float = 0.0  # Pa, loss of a filter at the pump's flow with the oil of the surface at 40 C
    pump_time: float = 0.0  # s, of a pressure-compensated pump
    pump_band: float = 0.05  # share of the pressure over which it comes back
    hose_length: float = 0.0  # m, between pump and valve
    hose_diameter: float = 12e-3  # m
    tank_air: float = 0.0  # m3 at the surface, trapped in the compensator
    short_travel: float = 0.0  # share of the way that the compensator lacks
    heave: float = 0.0  # m, amplitude of the base
    heave_frequency: float = 0.12  # Hz
    heave_phase: float = 0.0  # rad
    pitch_per_heave: float = 0.0  # rad/m

    # What else differs since edition 3
    oil_varies: float = 0.0  # 1: temperature moves all that it moves, not the viscosity alone
    null_shows: float = 0.0  # 1: the controller's integral starts without knowing of the valve's null shift
    leak_at_rod: float = 0.0  # 1: the external leakage is the rod seal's

    @property
    def ambient_pressure(self) -> float:
        """Pressure of the sea (Pa): 10 kPa per m, at least one atmosphere."""
        return max(1e4 * self.depth, ATMOSPHERE) * self.ambient_scale

    @property
    def corners(self) -> np.ndarray:
        """Times (s) at which the slope of the command jumps."""
        up = self.t_start + self.ramp_time
        return np.array([self.t_start, up, up + self.hold_time, up + self.hold_time + self.ramp_time])


_DERIVED = (
    "p_am", "eta0", "comp_area", "q_pump", "k_q", "land_diameter", "area1", "area2", "line_area", "segment",
    "segment_loss", "half_volume", "length0", "velocity_head", "vogel0", "roelands_z", "beam_d", "barrel_d",
    "drag_factor", "load", "flex_k", "flex_d", "inner_drag", "load_moved", "line_thinner", "lands_apart", "leaks_apart",
    "moving", "pipe_diameter", "hose_area", "travel", "stated_eta",
)  # fmt: skip
RECORD = np.dtype([(f.name, np.float64) for f in fields(Machine)] + [(name, np.float64) for name in _DERIVED])
SEGMENTS = 5
"""Segments of each line."""


def vogel(T: float) -> float:
    """Viscosity at T (K) relative to that at 40 C, by Vogel's law."""
    return exp(VOGEL_B / (T - VOGEL_C) - VOGEL_B / (313.15 - VOGEL_C))


def heated(m: Machine) -> Machine:
    """The machine with what its oil's temperature moves beside the viscosity: density by 7e-4 per kelvin, modulus by
    0.55 %, and the pressure index with a power of what is left to the glass (Vogel's C)."""
    dT = m.temperature - 313.15
    if m.oil_varies == 0.0 or dT == 0.0:
        return m
    index = ((313.15 - VOGEL_C) / (m.temperature - VOGEL_C)) ** 0.6
    return replace(m, rho=m.rho * (1.0 - 7e-4 * dT), beta=m.beta * (1.0 - 5.5e-3 * dT), alpha=m.alpha * index)


def mixed(m: Machine) -> Machine:
    """The machine with water in its oil: viscosity by Richardson's exponent, density and compliance by volume."""
    if m.water == 0.0:
        return m
    w = m.water
    rho = (1.0 - w) * m.rho + w * 1000.0
    beta = 1.0 / ((1.0 - w) / m.beta + w / 2.15e9)
    return replace(m, rho=rho, beta=beta, nu0=m.nu0 * m.rho / rho * exp(2.8 * w))


def constants(m: Machine) -> np.void:
    """Parameters and derived constants in the form the compiled functions read."""
    plain, m = m, mixed(heated(m))
    c = np.zeros(1, RECORD)[0]
    for f in fields(Machine):
        c[f.name] = getattr(m, f.name)
    c["p_am"] = m.ambient_pressure
    c["eta0"] = m.rho * m.nu0 * vogel(m.temperature)  # Pa s
    c["vogel0"] = VOGEL_B / (m.temperature - VOGEL_C)
    # Roelands: eta = eta0 exp((ln eta0 + 9.67) ((1 + 5.1e-9 P)^Z - 1)), Z from the Barus slope at P = 0
    c["roelands_z"] = m.alpha / (5.1e-9 * (log(c["eta0"]) + 9.67))
    c["comp_area"] = pi * m.compensator_diameter**2 / 4
    c["q_pump"] = m.pump_displacement * m.pump_speed  # Eq. 4
    c["k_q"] = m.flow_gain * m.rated_flow / np.sqrt(m.rated_drop)
    full_area = m.flow_gain * m.rated_flow / (m.discharge_coefficient * np.sqrt(2 * m.rated_drop / m.rho))
    c["land_diameter"] = np.sqrt(4 * full_area / pi)
    c["area1"] = pi * m.bore**2 / 4  # Eq. 25
    c["area2"] = pi * (m.bore**2 - m.rod_diameter**2) / 4
    diameter = m.line_diameter * m.diameter_scale
    c["line_area"] = pi * diameter**2 / 4
    c["segment"] = m.line_length / SEGMENTS
    c["segment_loss"] = 128 * c["segment"] / (pi * diameter**4)  # loss / (viscosity * flow), Eq. 21
    c["half_volume"] = c["line_area"] * c["segment"] / 2
    c["velocity_head"] = m.rho / (2 * c["line_area"] ** 2)  # Pa s2/m6
    c["length0"] = np.hypot(m.eye_radius * np.cos(m.theta0) - m.base_x, m.eye_radius * np.sin(m.theta0) - m.base_y)
    c["beam_d"], c["barrel_d"] = m.beam_diameter + 2 * m.growth, m.barrel_diameter + 2 * m.growth
    rough = 1.0 + 0.2 * (1.0 - exp(-m.growth / 0.02))  # growth is rough: more drag than a smooth thicker cylinder
    c["drag_factor"] = m.drag_coefficient * m.drag_scale * rough
    c["load"] = m.load_weight * m.payload_scale
    c["load_moved"] = c["load"]
    if m.load_place != 1.0:
        more = m.load_weight * (m.payload_scale - 1.0)
        c["load"], c["load_moved"] = m.load_weight + more * m.load_place, m.load_weight + more * m.load_place**2
    # of the beam's inner part, without growth: diameter times drag coefficient, relative to `drag_factor`
    c["inner_drag"] = m.beam_diameter * m.drag_coefficient / c["drag_factor"]
    # a form of an effect that is not there is nothing
    if not (m.coulomb or m.stribeck or m.seal_friction):
        c["presliding"] = 0.0
    if m.growth == 0.0 and m.drag_scale == 1.0:
        c["outer_from"] = 0.0
    if m.current_offset == 0.0:
        c["current_shear"] = 0.0
    if m.flow_gain == 1.0:
        c["notch"] = 1.0
    c["line_thinner"] = 1.0
    if m.line_share != 1.0:
        c["line_thinner"] = vogel(313.15 + m.line_share * (m.temperature - 313.15)) / vogel(m.temperature)
    lands = (m.overlap_pa, m.overlap_at, m.overlap_pb, m.overlap_bt)
    c["lands_apart"] = float(m.overlap != 0.0 and lands != (1.0, 1.0, 1.0, 1.0))
    leaks = (m.leak_pa, m.leak_at, m.leak_pb, m.leak_bt, 1.0 + m.leak_turbulent)
    c["leaks_apart"] = float(leaks != (1.0, 1.0, 1.0, 1.0, 1.0))
    c["moving"] = float(m.override > 0.0 or m.filter > 0.0 or m.pump_time > 0.0 or m.hose_length > 0.0)
    c["pipe_diameter"], c["hose_area"] = diameter, pi * m.hose_diameter**2 / 4
    c["stated_eta"] = plain.rho * plain.nu0
    c["travel"] = (1.0 - m.short_travel) * (c["area1"] - c["area2"]) * m.stroke / c["comp_area"]
    if m.flexibility > 0.0:  # damping ratio 3 % of the load against a held beam
        c["flex_k"] = 1.0 / m.flexibility
        c["flex_d"] = 2 * 0.03 * np.sqrt(c["flex_k"] * c["load"] / m.gravity) * m.beam_length
    return c
