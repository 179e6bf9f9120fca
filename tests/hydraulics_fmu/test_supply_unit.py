"""The supply apart: closed forms, another solver, conservation, and the valves that it feeds."""

import numpy as np
import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.fmus.supply import DeepseaSupply
from deepsea_cosim.hydraulics_fmu.supply_unit import equations, stepping
from deepsea_cosim.hydraulics_fmu.supply_unit.variables import SUPPLY
from scipy.integrate import solve_ivp

from .test_circuit import Rig


class Unit:
    """The supply on its own."""

    def __init__(self, Q_p=0.0, **changes):
        p = SUPPLY.parameters({"depth": 0.0, **{name.replace("__", "."): value for name, value in changes.items()}})
        self.row = stepping.initial_row(p, Q_p)
        self.values = np.zeros(len(SUPPLY))
        self.c = equations.by_name.py_func(self.row[: stepping.STATE])
        self.y = self.row[stepping.STATE : stepping.SCRATCH]
        self.at = (self.values.ctypes.data, len(self.values), self.row.ctypes.data, len(self.row))

    def step(self, t, h, Q_p=0.0, Q_t=None):
        self.values[stepping.FIRST_TAKEN] = Q_p
        self.values[stepping.FIRST_GIVEN] = Q_p if Q_t is None else Q_t
        return stepping.advance(*self.at, t, h)

    def __getitem__(self, name):
        return self.values[SUPPLY.index(name)]


@pytest.mark.parametrize("changes", [
    {}, {"filter__dp": 4e5}, {"pump__compensated": True, "filter__dp": 4e5},
], ids=["relief", "relief and filter", "compensated"])  # fmt: skip
def test_it_rests_while_the_valves_take_a_steady_flow(changes):
    unit = Unit(1e-4, **changes)
    before = unit.y.copy()
    for k in range(200):
        assert unit.step(k * 1e-3, 1e-3, 1e-4) == stepping.DONE
    assert unit.y == pytest.approx(before, rel=1e-6, abs=1e-9)


def test_the_relief_valve_is_a_straight_characteristic():
    unit = Unit(1e-4)
    unit.step(0.0, 1e-3, 1e-4)
    pump = 12e-6 * 1450 / 60
    assert unit["Q_rv"] == pytest.approx(pump - 1e-4, rel=1e-6)
    assert unit["P_s"] - unit["P_r"] == pytest.approx(20e6 * (1 + 0.02 * (1 - 1e-4 / pump)), rel=1e-6)


def test_a_compensated_pump_droops_and_a_filter_takes_its_share():
    unit = Unit(1e-4, pump__compensated=True, filter__dp=4e5)
    unit.step(0.0, 1e-3, 1e-4)
    pump = 12e-6 * 1450 / 60
    assert unit["Q_pump"] == pytest.approx(1e-4, rel=1e-6)
    assert unit["P_pump"] - unit["P_r"] == pytest.approx(20e6 * (1 - 0.05 * 1e-4 / pump), rel=1e-6)
    thicker = np.exp(2.2e-8 * (0.1013e6 + 1e7))
    assert unit["P_pump"] - unit["P_s"] == pytest.approx(4e5 * thicker * 1e-4 / pump, rel=1e-6)


@pytest.mark.parametrize("Q_p", [0.0, 1e-4, 2.5e-4])
def test_what_the_relief_valve_spills_does_not_go_through_the_filter(Q_p):
    """As in the circuit's own supply: P_s = P_r + p_crack + R Q_rv - F Q_p."""
    unit = Unit(Q_p, filter__dp=1e6, depth=3000.0)
    unit.step(0.0, 1e-3, Q_p)
    pump, thicker = 12e-6 * 1450 / 60, np.exp(2.2e-8 * 4e7)
    assert unit["Q_rv"] == pytest.approx(pump - Q_p, rel=1e-6)
    assert unit["P_pump"] - unit["P_r"] == pytest.approx(20e6 * (1 + 0.02 * (1 - Q_p / pump)), rel=1e-6)
    assert unit["P_pump"] - unit["P_s"] == pytest.approx(1e6 * thicker * Q_p / pump, rel=1e-6, abs=1.0)


def test_a_compensated_pump_that_stands_still_holds_its_pressure_while_nothing_is_taken():
    unit = Unit(pump__compensated=True, pump__speed=0.0)
    assert unit.step(0.0, 1e-3) == stepping.DONE
    assert unit["Q_pump"] == pytest.approx(0.0, abs=1e-20)
    assert unit["P_s"] - unit["P_r"] == pytest.approx(20e6, rel=1e-6)


def test_an_accumulator_gives_its_gas_law():
    """Without a pump: what the valves take, the gas takes the place of, P V^n staying what it was."""
    unit = Unit(accumulator__volume=4e-3, manifold__volume=1e-5, pump__speed=0.0)
    p_0 = unit.c.sea.p_am + 12e6
    unit.y[0] = 20e6
    V = 4e-3 * (p_0 / 20e6) ** (1 / 1.3)
    for k in range(1000):
        unit.step(k * 1e-3, 1e-3, 4e-4)
    assert unit["V_acc"] == pytest.approx(4e-3 - (V + 4e-4), rel=2e-3)  # the oil of the manifold gives a little
    assert unit["P_s"] == pytest.approx(p_0 * (4e-3 / (V + 4e-4)) ** 1.3, rel=2e-3)


@pytest.mark.parametrize("changes", [
    {}, {"pump__compensated": True, "accumulator__volume": 1e-3},
], ids=["relief", "both"])  # fmt: skip
def test_against_scipy(changes):
    unit, other = Unit(3e-5, **changes), Unit(3e-5, **changes)
    for k in range(300):
        unit.step(k * 1e-3, 1e-3, 1.2e-4, 1.1e-4)

    def rate(_t, y):
        f = np.empty(len(y))
        equations.rates(y.copy(), 1.2e-4, 1.1e-4, other.c, f)
        return f

    scale = np.array([1e7, 1e-4, 1e7, 0.1, 0.1])
    found = solve_ivp(rate, (0.0, 0.3), other.y.copy(), "Radau", rtol=1e-10, atol=1e-10 * scale)
    assert np.abs((unit.y - found.y[:, -1]) / scale).max() < 2e-4


def test_an_empty_supply_says_so():
    unit = Unit(pump__displacement=1e-8)
    codes = [unit.step(k * 1e-2, 1e-2, 5e-4) for k in range(40)]
    assert stepping.EMPTY in codes
    assert unit.step(0.0, 1e9) == stepping.TOO_LONG


def test_a_circuit_that_is_fed_from_outside_has_no_supply_of_its_own():
    """With what its own supply would give it moves the same; its pump's limit and its tank's spring are gone."""
    own, fed = Rig(depth=3000.0, command__t_start=0.0), Rig(depth=3000.0, command__t_start=0.0)
    from deepsea_cosim.hydraulics_fmu.steady import steady_state

    Pt = own.border.p_t
    fed.c.supply.from_outside = 1.0
    fed.y, held = steady_state(fed.numbers, 6632.0, Pt + 20e6, Pt)
    assert held
    assert np.abs((fed.y - own.y) / own.scale).max() < 1e-9
    fed.m.P_s, fed.m.P_r = Pt + 20e6, Pt
    for k in range(300):
        for rig in (own, fed):
            rig.step(k * 1e-3, 1e-3, 0.04e-3 * k, 0.04)
    one, other = own.outputs(0.012, 0.04, 0.012), fed.outputs(0.012, 0.04, 0.012)
    assert other["P1"] == pytest.approx(one["P1"], rel=1e-5)
    assert (other["Pp"], other["Pt"], other["Qrv"]) == (Pt + 20e6, Pt, 0.0)
    assert one["Qp"] == pytest.approx(other["Qp"], rel=1e-4)


def test_a_compensated_pump_that_the_relief_valve_never_lets_swivel_back_is_told():
    for p_set, told_of in ((20e6, []), (25e6, [True])):
        it, told = DeepseaSupply(instance_name="it", resources="", visible=False, logger=0), []
        it._tell = lambda text, status: told.append("pump.p_set = 2.5e+07 Pa is above" in text)  # noqa: B023
        it.values[SUPPLY.index("pump.compensated")], it.values[SUPPLY.index("pump.p_set")] = 1.0, p_set
        it.setup_experiment(0.0)
        it.enter_initialization_mode()
        it.get_real([SUPPLY.index("P_s")])
        it.exit_initialization_mode()
        assert told == told_of


def test_too_long_a_step_is_one_line():
    it = DeepseaSupply(instance_name="it", resources="", visible=False, logger=0)
    it.setup_experiment(0.0)
    it.enter_initialization_mode()
    it.exit_initialization_mode()
    with pytest.raises(ParameterError, match="the supply takes at most 2500 s"):
        it.do_step(0.0, 3000.0)
