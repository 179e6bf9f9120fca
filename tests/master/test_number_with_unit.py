"""Values with a unit behind them, and names by their ends, as a person writes them."""

import json

import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.core.unit_names import named
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.system.number_with_unit import in_unit_of
from deepsea_cosim.master.system.value_conversion import Quantity

from ..commands import code


def length(unit="m", type="Real", relative=False):
    return Quantity(type, named(unit) if unit else None, None, "'c.x'", relative)


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [("200mm", "m", 0.2), ("200 mm", "m", 0.2), ("11km", "m", 11e3), ("-.5e1cm", "m", -0.05), ("210bar", "Pa", 21e6),
     ("3 gpm", "m3/s", 3 * 3.785411784e-3 / 60), ("90°", "rad", 1.5707963267948966), ("5%", "1", 0.05),
     ("4 degC", "K", 277.15), ("2 1/min", "1/s", 2 / 60), ("1kN/mm", "N/m", 1e6), ("0.2", "m", "0.2"),
     ("1_0mm", "m", "1_0mm"), ("nan", "m", "nan"), ("1e-3", "mm", "1e-3")],
)  # fmt: skip
def test_it_is_the_number_in_the_unit_of_what_takes_it(text, unit, number):
    """What has no unit behind stays a text, to be read as ever."""
    found = in_unit_of(text, length(unit), False, "")
    assert found == (number if isinstance(number, str) else pytest.approx(number, rel=1e-14))


def test_of_a_difference_the_offset_does_not_count():
    assert in_unit_of("4degC", length("K", relative=True), False, "") == 4.0


def test_each_of_an_array_may_have_one():
    assert in_unit_of("1mm, 2 3cm", length(), True, "") == (1e-3, "2", 0.03)
    assert in_unit_of(("1mm", 2.0), length(), False, "") == (1e-3, 2.0)


@pytest.mark.parametrize("type", ["Integer", "Boolean", "String", "Enumeration"])
def test_what_is_no_real_stays_as_it_is(type):
    assert in_unit_of("3mm", length(type=type), False, "") == "3mm"


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [("3mmm", "m", "unknown unit 'mmm'; did you mean 'mm'?"), ("3kn", "N", "unknown unit 'kn'; did you mean 'kN'?"),
     ("3bar", "m", "cannot convert 'bar' to 'm'"), ("3mm", None, "'c.x' has no unit; give a number alone")],
)  # fmt: skip
def test_another_unit_is_told(text, unit, words):
    with pytest.raises(ParameterError, match=r"^--set x: ") as caught:
        in_unit_of(text, length(unit), False, "--set x")
    assert words in str(caught.value)


def test_the_machine_takes_them_and_names_by_their_ends(built, tmp_path):
    """In `summary.json` stand SI numbers; an exact name counts before one that ends so."""
    line = [str(built / "deepsea_0km.ssp"), "--stop-time", "0.01", "--no-plot", "--quiet", "--out", str(tmp_path)]
    sets = ["target=200mm", "depth=1km", "arm.load_weight=1kN", "p_crack=210 bar"]
    assert code(main, [*line, *(part for text in sets for part in ("--set", text))]) == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    values = {name: p["value"] for name, p in summary["parameters"].items()}
    assert values["hydraulics.command.target"] == pytest.approx(0.2)
    assert values["hydraulics.depth"] == values["arm.depth"] == 1000.0
    assert values["arm.load_weight"] == 1000.0
    assert values["hydraulics.relief.p_crack"] == pytest.approx(21e6)


def test_an_end_that_several_names_have_is_told(built, tmp_path, capsys):
    line = [str(built / "deepsea_0km.ssp"), "--set", "T=3", "--out", str(tmp_path / "out")]
    assert code(main, line) == 2
    assert "no component has a parameter 'T'; it may be 'hydraulics.effect." in capsys.readouterr().err
