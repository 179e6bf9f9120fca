"""Where effects reach the end of what they describe: a pump that gives nothing, hours of run time, short steps,
parameters that contradict each other."""

import numpy as np
import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.fmus.hydraulics import DeepseaHydraulics
from deepsea_cosim.hydraulics_fmu import march, stepping
from deepsea_cosim.hydraulics_fmu.compensator import gas_softening, oil_volume
from deepsea_cosim.hydraulics_fmu.constants import by_name, constants, warming
from deepsea_cosim.hydraulics_fmu.ports import port_flows
from deepsea_cosim.hydraulics_fmu.supply import port_pressure, pump_flow
from deepsea_cosim.hydraulics_fmu.valve import land
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS

from .test_circuit import border_of
from .test_effects import Effected


def test_a_pump_whose_flow_slips_through_it_delivers_nothing():
    assert pump_flow(2e-4, 0.6, 0.5) == 0.0
    assert pump_flow(2e-4, 0.9, 0.5, 0.2) == 0.0
    warm = Effected(depth=0.0, oil_temperature__T=343.15, pump_slip__slip=0.6, relief_override__R=1e10,
                    relief_override__power=0.5)  # fmt: skip
    assert warm.c.pump.flow == 0.0
    assert port_flows(0.0, 5e6, 5e6, 1e5, np.nan, warm.c)[2] == 0.0
    out = warm.run(0.05)
    assert all(np.isfinite(values).all() for values in out.values())


@pytest.mark.parametrize(("t_0", "period", "h"), [(6000.0, 3e-4, 1e-3), (6000.0, 3e-4, 4e-3), (1e5, 1.5e-3, 4e-3)])
def test_a_controller_goes_on_sampling_after_hours(t_0, period, h, monkeypatch):
    """Once a period, and in slices that pass: in Python, for a compiled loop without end is not interrupted."""
    rig, sampled, slices = Effected(controller_sampling__period=period), [], []

    def told(t_0, s, stop, *_):
        assert stop > s
        assert len(slices) < 1000, "it stands still"
        slices.append(stop - s)
        rig.m.count += 1.0
        if not sampled or rig.m.sampled_at != sampled[-1]:
            sampled.append(rig.m.sampled_at)

    monkeypatch.setattr(march, "told", told)
    monkeypatch.setattr(march, "advance", lambda *_: march.OK)
    for k in range(25):
        arguments = (rig.y, rig.w, rig.m, rig.c, rig.scale, t_0 + k * h, h, 0.0, 0.0, 0.0, 0.0)
        assert march.march.py_func(*arguments) == march.OK
    assert sum(slices) == pytest.approx(25 * h, abs=1e-9)
    assert np.diff(sampled) == pytest.approx(period, abs=1e-9)
    assert len(sampled) == pytest.approx(25 * h / period, abs=1.5)


def test_a_long_delay_acts_in_short_steps():
    """It was cut to 1024 steps."""
    tau, h = 0.2, 1e-4
    ramp = {"command__target": 0.003, "command__t_start": 0.02, "command__ramp_time": 0.1, "controller__kd": 0.0}
    plain, out = (Effected(depth=0.0, command_delay__tau=delay, **ramp).run(0.4, h) for delay in (0.0, tau))
    t = np.arange(1, 4001) * h
    u = np.interp(t - tau, t, plain["u"], left=plain["u"][0])
    assert np.ptp(u) > 5.0
    assert np.abs(out["u"] - u).max() < 0.05  # the rod stands still, so the controller sees the same error


@pytest.mark.parametrize(("scale", "retraction"), [(0.5, 3.0), (2.0, -1.0)])
def test_a_valve_that_would_pass_nothing_back_is_refused(scale, retraction):
    gain = {"effect.valve_flow_gain.scale": scale, "effect.valve_flow_gain.retraction": retraction}
    with pytest.raises(ParameterError, match=r"valve_flow_gain.scale' = .*valve_flow_gain.retraction' = ") as error:
        constants(HYDRAULICS.parameters(gain))
    assert "\n" not in str(error.value)


def test_land_and_leakage_take_no_more_than_the_pump_gives():
    c = Effected(valve_leakage__c=1e-12, depth=0.0).c
    Pa = Pb = 1.1e6
    Q_a, Q_b, Q_p, Q_t = port_flows(1.0, Pa, Pb, 1e5, np.nan, c)
    assert Q_p == pytest.approx(c.pump.flow, rel=1e-9)
    assert Q_a - Q_b == pytest.approx(Q_p - Q_t, rel=1e-12)
    P = port_pressure(1.0, Pa, Pb, 1e5, c)
    assert land(1.0, P, Pa, c) + 2e-12 * (P - Pa) == pytest.approx(c.pump.flow, rel=1e-9)
    assert Pa < P < 1e5 + 20e6
    flows = port_flows(1.0, Pa, Pb, 1e5, P, c)
    assert (Q_a, Q_b) == pytest.approx(flows[:2], rel=1e-12)
    assert port_pressure(0.1, Pa, Pb, 1e5, c) == 1e5 + 20e6  # what suffices holds the relief pressure


@pytest.mark.parametrize(("changes", "place"), [
    ({"oil_temperature.T": 263.15, "oil_warm_up.rise": -30.0, "oil_temperature.lines": 3.0}, "lines"),
    ({"oil_temperature.T": 393.15, "oil_temperature.cylinder": 3.0}, "cylinder"),
], ids=["cold", "hot"])  # fmt: skip
def test_an_oil_that_is_no_liquid_is_refused(changes, place):
    p = HYDRAULICS.parameters({f"effect.{name}": value for name, value in changes.items()})
    with pytest.raises(ParameterError, match=f"oil of the {place}"):
        constants(p), warming(p)


def test_a_filter_of_a_pump_that_stands_still():
    rig = Effected(pump__speed=0.0, filter_clogging__dp=1e6, filter_clogging__back=0.5, depth=0.0)
    assert np.isfinite(rig.run(0.02)["F_h"]).all()


@pytest.mark.parametrize("x_h", [0.05, 0.2])
def test_a_loose_rod_starts_where_its_eye_is(x_h):
    """As of a recorded motion that begins anywhere."""
    p = HYDRAULICS.parameters({"effect.joint_clearance.gap": 2e-4, "depth": 0.0})
    row, _ = stepping.initial_row(p, 6632.0, x_h=x_h)
    values = np.zeros(len(HYDRAULICS))
    values[stepping.X_H] = x_h
    assert stepping.advance(values.ctypes.data, len(values), row.ctypes.data, len(row), 0.0, 0.0) == 0
    assert values[HYDRAULICS.index("F_h")] == pytest.approx(6632.0, abs=1.0)
    it = DeepseaHydraulics(instance_name="it", resources="", visible=False, logger=0)
    for name, value in {"x_h": x_h, "F_hold": 6632.0, "effect.joint_clearance.gap": 2e-4, "depth": 0.0}.items():
        it.values[HYDRAULICS.index(name)] = value
    it.setup_experiment(0.0)
    it.enter_initialization_mode()
    assert it.read([HYDRAULICS.index("F_h")])[0] == pytest.approx(6632.0, abs=1.0)


def test_trapped_air_is_beside_all_the_oil_of_tank_and_compensator():
    """dV/dP of both adds up: (V_t + V_c)/beta + p V/(n P^2)."""
    rig, plain = Effected(compensator_trapped_air__volume=2e-3, depth=100.0), Effected(depth=100.0)
    x_c = plain.border.x_c = rig.border.x_c
    plain.border.p_t = P = rig.border.p_t
    for it in (rig, plain):
        it.border.v_c = 0.01
    rates = [border_of(it.rate(), it.c).p_t for it in (rig, plain)]
    area = rig.c.compensator.area
    volume = 0.1 + area * (0.25 - x_c)
    assert oil_volume(x_c, area, 0.1, 0.25) == pytest.approx(volume)
    stiff, soft = 1.4e9 / volume, 1.0 / (volume / 1.4e9 + rig.c.compensator.gas / (1.2 * P * P))
    assert rates[0] / rates[1] == pytest.approx(soft / stiff, rel=1e-3)
    assert gas_softening(P, volume, 1.4e9, rig.c.compensator.gas) == pytest.approx(soft / stiff)
    assert by_name(rig.numbers).tank.volume == 0.1
