import pytest
from deepsea_cosim.core.unit_names import named
from deepsea_cosim.core.units import UNITS


@pytest.mark.parametrize(
    ("name", "factor", "exponents"),
    [
        ("W/(m2.K)", 1.0, {"kg": 1, "s": -3, "K": -1}),
        ("kg.m2/s2", 1.0, {"kg": 1, "m": 2, "s": -2}),
        ("kJ/mol", 1e3, {"kg": 1, "m": 2, "s": -2, "mol": -1}),
        ("km/h", 1e3 / 3600.0, {"m": 1, "s": -1}),
        ("Nm", 1.0, {"kg": 1, "m": 2, "s": -2}),
        ("mV", 1e-3, {"kg": 1, "m": 2, "s": -3, "A": -1}),
        ("min", 60.0, {"s": 1}),
        ("mmol", 1e-3, {"mol": 1}),
        ("uH", 1e-6, {"kg": 1, "m": 2, "s": -2, "A": -2}),
        ("1/K", 1.0, {"K": -1}),
        ("m3/(s.Pa)", 1.0, {"kg": -1, "m": 4, "s": 1}),
        ("N.m.s/rad", 1.0, {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("r/min", 1.0 / 60.0, {"s": -1}),
        ("m/s^2", 1.0, {"m": 1, "s": -2}),
        ("-", 1.0, {}),
        ("lbf.ft", 4.4482216152605 * 0.3048, {"kg": 1, "m": 2, "s": -2}),
        ("lbf/in2", 6894.757293168361, {"kg": 1, "m": -1, "s": -2}),
    ],
)
def test_names_say_what_they_measure(name, factor, exponents):
    found = named(name)
    assert found.name == name
    assert found.factor == pytest.approx(factor, rel=1e-15)
    assert found.exponents == exponents


@pytest.mark.parametrize("name", ["furlong", "m//s", "N.m/A.s", "", ".", "m2.", "kkg", "dB", "m10"])
def test_what_is_no_unit_is_none(name):
    assert named(name) is None


def test_the_table_and_the_grammar_agree():
    from deepsea_cosim.core.unit_names import _parse

    for unit in UNITS.values():
        parsed = _parse(unit.name)
        if parsed is not None:
            assert parsed[0] == pytest.approx(unit.factor, rel=1e-12), unit.name
            assert {k: v for k, v in parsed[1].items() if v} == unit.exponents, unit.name
