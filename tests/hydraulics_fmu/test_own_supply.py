"""A circuit that is fed from outside says which parameters of its own supply are set in vain."""

import numpy as np
import pytest
from deepsea_cosim.fmus.hydraulics import DeepseaHydraulics
from deepsea_cosim.hydraulics_fmu.own_supply import NAMES, in_vain, passed_over
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS

AT_3_KM = {"depth": 3000.0, "command.t_start": 0.0}
GIVEN = {"P_s": 51e6, "P_r": 31e6}
FED = {**AT_3_KM, **GIVEN, "supply.from_outside": 1.0}


def run(values):
    """Outputs after 0.1 s of the instance, and what it said as warnings."""
    it, told = DeepseaHydraulics(instance_name="it", resources="", visible=False, logger=0), []
    it._tell = lambda text, status: told.append(text) if status is it.statuses.warning else None
    for name, value in values.items():
        it.values[HYDRAULICS.index(name)] = value
    it.setup_experiment(0.0)
    it.enter_initialization_mode()
    it.get_real([HYDRAULICS.index("F_h")])  # a start that is computed twice says it once
    it.exit_initialization_mode()
    for k in range(100):
        it.do_step(k * 1e-3, 1e-3)
    return it.out.copy(), told


def test_what_is_named_does_nothing_and_one_line_says_so():
    """But for the sixth digit: the tolerances of the pressures go by that of the own supply."""
    plain, told = run(FED)
    assert told == []
    for name in NAMES:
        start, most = HYDRAULICS[name].start, HYDRAULICS[name].max
        out, told = run({**FED, name: min(1.5 * start + 0.3, start + 0.3 * (most - start))})
        assert np.abs(out - plain).max() <= 1e-4 * np.abs(plain).max(), name
        assert np.allclose(out, plain, rtol=2e-5, atol=1e-12), name
        assert len(told) == 1
        assert f": {name};" in told[0]
        assert "\n" not in told[0]


def test_without_a_pump_of_its_own_it_is_as_well_fed():
    """Its flow of nothing was what the start had to be exact to, and what tolerances of the flows go by."""
    plain, _ = run(FED)
    out, told = run({**FED, "pump.speed": 0.0})
    assert ["this does nothing: pump.speed;" in text for text in told] == [True]
    assert np.allclose(out, plain, rtol=2e-5, atol=1e-12)


MOVING = {**AT_3_KM, "effect.umbilical_supply.length": 100.0}


@pytest.mark.parametrize(("values", "names"), [
    ({"effect.relief_override.R": 1e10, "effect.relief_override.power": 0.5},
     "effect.relief_override.R, effect.relief_override.power"),
    ({"effect.filter_clogging.dp": 1e6, "effect.filter_clogging.back": 0.5}, "effect.filter_clogging.dp"),
    ({"effect.filter_clogging.dp": 1e6, "effect.filter_clogging.back": 1.0}, ""),
])  # fmt: skip
def test_what_a_supply_that_moves_leaves_out_is_told(values, names):
    _, told = run({**MOVING, **values})
    assert [text.rpartition(": ")[2] for text in told] == ([names] if names else [])
    still = {**AT_3_KM, **values}
    assert passed_over(HYDRAULICS.parameters(still)) == ()


def test_several_are_one_line():
    _, told = run({**FED, "effect.pump_slip.slip": 0.1, "tank.volume": 0.2})
    assert ["tank.volume, effect.pump_slip.slip;" in text for text in told] == [True]


@pytest.mark.parametrize("values", [
    {**AT_3_KM, "effect.pump_slip.slip": 0.1},
    {**FED, "effect.filter_clogging.dp": 1e6, "effect.filter_clogging.back": 1.0, "pump.speed": 30.0},
], ids=["its own supply", "a filter in the return"])  # fmt: skip
def test_what_acts_is_not_named(values):
    assert in_vain(HYDRAULICS.parameters({n: v for n, v in values.items() if n not in ("P_s", "P_r")})) == ()
    _, told = run(values)
    assert told == []


def test_pressures_that_are_given_in_vain_are_told():
    """As when a supply is connected and `supply.from_outside` forgotten."""
    plain, told = run(AT_3_KM)
    assert told == []
    out, told = run({**AT_3_KM, **GIVEN})
    assert np.array_equal(out, plain)
    assert ["P_s and P_r" in text for text in told] == [True]
    _, told = run({**AT_3_KM, "P_r": 31e6})
    assert ["what P_r" in text for text in told] == [True]
