"""What a person sees instead of SI, and what stays."""

import pytest
from deepsea_cosim.core.display_units import DisplayUnits, display_units, user_file
from deepsea_cosim.core.errors import UsageError


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("APPDATA", str(tmp_path))
    user_file().parent.mkdir()
    return user_file()


@pytest.mark.parametrize(
    ("asked", "unit", "largest", "expected"),
    [
        ("metric", "m", 0.2, ("mm", 1e3, 0.0)),
        ("metric", "m", 11000.0, ("m", 1.0, 0.0)),
        ("metric", "bar", 200.0, ("bar", 1.0, 0.0)),
        ("metric", "Pa", 2e7, ("MPa", 1e-6, 0.0)),
        ("metric", "Pa", 5.0, ("Pa", 1.0, 0.0)),
        ("metric", "m3/s", 1e-4, ("L/min", 6e4, 0.0)),
        ("metric", "1", 0.3, ("1", 1.0, 0.0)),
        ("metric", "florins", 3.0, ("florins", 1.0, 0.0)),
        ("metric", "m", 0.0, ("mm", 1e3, 0.0)),
        ("si", "m", 0.2, ("m", 1.0, 0.0)),
        ("us", "Pa", 2e7, ("psi", 1 / 6894.757293168361, 0.0)),
        ("bar,cm", "Pa", 2e7, ("bar", 1e-5, 0.0)),
        ("bar,cm", "MPa", 20.0, ("bar", 10.0, 0.0)),
        ("bar,cm", "m", 0.2, ("cm", 1e2, 0.0)),
        ("bar,cm", "N", 6882.0, ("kN", 1e-3, 0.0)),
        ("degC", "K", 300.0, ("degC", 1.0, -273.15)),
    ],
)
def test_the_unit_that_is_shown(asked, unit, largest, expected):
    name, factor, offset = display_units(asked).of(unit, largest)
    assert (name, factor, offset) == (expected[0], pytest.approx(expected[1]), pytest.approx(expected[2]))


def test_a_user_may_say_it_once(home):
    assert display_units(None) == DisplayUnits()
    home.write_text('units = ["bar", "cm"]')
    assert display_units(None) == display_units("bar,cm")
    assert display_units("si") == DisplayUnits((), ())
    home.write_text('units = "us"')
    assert display_units(None) == display_units("us")


@pytest.mark.parametrize("content", ["units = 3", "unit = []", "units = [", 'units = ["foo"]', 'units = ["mm"]\nx = 1'])
def test_a_file_that_says_something_else_is_one_line_with_its_name(home, content):
    home.write_text(content)
    with pytest.raises(UsageError, match=r"units\.toml: ") as caught:
        display_units(None)
    assert "\n" not in str(caught.value)


def test_an_unknown_unit_is_told():
    with pytest.raises(UsageError, match=r"--units: unknown unit 'mmm'; did you mean 'mm'\?; give metric, si, us, or"):
        display_units("bar,mmm")
