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
