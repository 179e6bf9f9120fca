import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.core.units import UNITS, convert


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (20.0, "MPa", "Pa", 2e7),
        (5.0, "L/min", "m3/s", 5e-3 / 60),
        (22.0, "cSt", "m2/s", 22e-6),
        (40.0, "degC", "K", 313.15),
        (313.15, "K", "degC", 40.0),
        (180.0, "deg", "rad", 3.141592653589793),
        (1.0, "bar", "kPa", 100.0),
    ],
)
def test_conversion(value, source, target, expected):
    assert convert(value, source, target) == pytest.approx(expected, rel=1e-15)


def test_there_and_back_for_every_pair_of_one_dimension():
    for a in UNITS.values():
        for b in UNITS.values():
            if a.same_dimension(b):
                assert convert(convert(3.7, a.name, b.name), b.name, a.name) == pytest.approx(3.7, rel=1e-12)


def test_unknown_unit_names_the_nearest():
    with pytest.raises(UsageError, match="unknown unit 'MPA'; did you mean 'MPa'"):
        convert(1.0, "MPA", "Pa")


def test_other_quantity_is_refused():
    with pytest.raises(UsageError, match="different quantities"):
        convert(1.0, "N", "Pa")


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (10.0, "in", "mm", 254.0),
        (1.0, "inch", "in", 1.0),
        (3.0, "ft", "in", 36.0),
        (1.0, "ft/s", "in/s", 12.0),
        (60.0, "in/min", "mm/s", 25.4),
        (3000.0, "psi", "bar", 206.84271879504),
        (1.0, "ksi", "psi", 1000.0),
        (1.0, "gal/min", "L/min", 3.785411784),
        (1.0, "gpm", "gal/min", 1.0),
        (231.0, "in3", "gal", 1.0),
        (231.0, "in3/min", "gpm", 1.0),
        (1.0, "in3/s", "cm3/s", 16.387064),
        (1.0, "in3/rev", "cm3/rev", 16.387064),
        (1.0, "lbf", "N", 4.4482216152605),
        (1.0, "lbf.ft", "N.m", 1.3558179483314004),
        (12.0, "lbf.in", "ft.lbf", 1.0),
        (1.0, "lb", "kg", 0.45359237),
        (1.0, "hp", "W", 745.6998715822702),
        (212.0, "degF", "degC", 100.0),
        (-40.0, "degF", "degC", -40.0),
        (0.0, "degF", "K", 255.3722222222222),
        (1.0, "lbf/in", "N/m", 175.12683524647636),
        (3.6, "m3/h", "L/s", 1.0),
    ],
)
def test_inch_pound_units(value, source, target, expected):
    """Expected values from NIST Special Publication 811, appendix B."""
    assert convert(value, source, target) == pytest.approx(expected, rel=1e-13, abs=1e-11)


def test_pound_and_inch_pressures_agree():
    assert UNITS["psi"].factor == pytest.approx(UNITS["lbf"].factor / UNITS["in2"].factor, rel=1e-14)
