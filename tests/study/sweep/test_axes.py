"""What may be varied, and what is refused in one line."""

import re

import pytest
from deepsea_cosim.core.display_units import display_units
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.study.sweep.axes import parse_axis, settled
from deepsea_cosim.study.sweep.cases import grid, parse_sample, sample
from deepsea_cosim.study.sweep.request import SweepPlan
from deepsea_cosim.study.sweep.shown import shown_in


def test_lists_steps_and_ranges():
    assert parse_axis("a.b=1,2.5,true,thin").values == (1, 2.5, True, "thin")
    assert parse_axis("depth=0:11000:500").values[-1] == 11000.0
    assert len(parse_axis("depth=0:11000:500").values) == 23
    assert parse_axis("d=0:0.3:0.1").values == (0.0, 0.1, 0.2, 0.3)  # no 0.30000000000000004
    axis = parse_axis("d=-1:2")
    assert (axis.low, axis.high) == (-1.0, 2.0)
    assert axis.is_range


def test_a_list_is_what_the_parameter_is():
    """A text stays as it is written; a colon in it makes no range."""
    text = settled(parse_axis("a=007,1e3,true,C:/data.csv"), lambda name, text: text)
    assert text.values == ("007", "1e3", "true", "C:/data.csv")
    assert settled(parse_axis("a=1,2"), lambda name, text: float(text)).values == (1.0, 2.0)
    with pytest.raises(UsageError, match="a value is there twice"):
        settled(parse_axis("a=1,true"), lambda name, text: True)


@pytest.mark.parametrize("text", ["a", "a=", "=1", "a=1,,2", "a=2:1", "a=1:2:0", "a=1:2:3:4", "a=1:x", "a=1,1",
                                  "a=0:1:1e-9", "a=0:inf"])  # fmt: skip
def test_nonsense_is_refused(text):
    with pytest.raises(UsageError):
        parse_axis(text)


def test_a_grid_has_every_combination_the_last_fastest():
    cases = grid([parse_axis("a=1,2"), parse_axis("b=x,y,z")])
    assert len(cases) == 6
    assert cases[1] == {"a": 1, "b": "y"}


def test_a_grid_needs_steps_and_different_names():
    with pytest.raises(UsageError, match="step"):
        grid([parse_axis("a=1:2")])
    with pytest.raises(UsageError, match="twice"):
        grid([parse_axis("a=1"), parse_axis("a=2")])
    with pytest.raises(UsageError, match="nothing"):
        grid([])
    with pytest.raises(UsageError, match="more than"):
        grid([parse_axis("a=0:1:0.001"), parse_axis("b=0:1:0.001")])


@pytest.mark.parametrize("kind", ["sobol", "lhs"])
def test_a_sample_fills_its_ranges_evenly_and_repeats(kind):
    axes = [parse_axis("a=2:4"), parse_axis("b=x,y")]
    cases = sample(axes, kind, 64, seed=3)
    assert cases == sample(axes, kind, 64, seed=3)
    assert cases != sample(axes, kind, 64, seed=4)
    a = sorted(c["a"] for c in cases)
    assert all(2 + k / 32 <= v < 2 + (k + 1) / 32 for k, v in enumerate(a))  # one in each of 64 strata
    assert sum(c["b"] == "x" for c in cases) == 32


def test_a_sobol_sample_need_not_be_a_power_of_two():
    assert len(sample([parse_axis("a=0:1")], "sobol", 37)) == 37


@pytest.mark.parametrize("text", ["sobol", "sobol:0", "sobol:-3", "dice:9", "sobol:1.5", ":9"])
def test_samples_that_do_not_exist(text):
    with pytest.raises(UsageError):
        parse_sample(text)


def test_saltelli_needs_a_power_of_two():
    with pytest.raises(UsageError, match="power of two"):
        sample([parse_axis("a=0:1")], "saltelli", 100)


def in_metres(_name, text):
    """What 'm' takes a number with a unit for."""
    number, unit = re.fullmatch(r"([-\d.]+) *(mm|cm|)", text).groups()
    return float(number) * {"mm": 1e-3, "cm": 1e-2, "": 1.0}[unit]


@pytest.mark.parametrize("written", ["3mm:5mm:1mm", "3:5:1mm", "3 mm : 5 : 1 mm"])
def test_units_of_a_range(written):
    assert settled(parse_axis(f"d={written}"), in_metres).values == (0.003, 0.004, 0.005)


def test_units_of_the_ends_of_a_sample():
    axis = settled(parse_axis("d=3:5mm"), in_metres)
    assert (axis.low, axis.high, axis.is_range) == (0.003, 0.005, True)
    with pytest.raises(UsageError, match="in one unit or in none"):
        parse_axis("d=3mm:5:1")


def test_the_step_of_a_unit_with_an_offset():
    axis = settled(parse_axis("T=0:10:5degC"), lambda _name, text: float(text.removesuffix("degC")) + 273.15)
    assert axis.values == (273.15, 278.15, 283.15)


def test_what_is_shown_has_the_units_that_are_asked_for():
    """Lengths in mm, a temperature as it is, for what was measured may be a difference; axes and rows stay one."""
    axes = [parse_axis("d=0.003,0.0041"), parse_axis("on=true,false")]
    plan = SweepPlan(axes, "", [], None, {"d": "m", "T": "K", "p": "Pa"})
    rows = [{"case": k, "d": d, "on": on, "T": 300.0, "p": None, "failed": ""}
            for k, (d, on) in enumerate((d, on) for d in axes[0].values for on in (True, False))]  # fmt: skip
    shown = shown_in(plan, rows, display_units("mm,degC,bar"))
    assert (shown.units["d"], shown.units["T"]) == ("mm", "K")
    assert shown.axes[0].values == (3.0, 4.1)
    assert [row["d"] for row in shown.table] == [3.0, 3.0, 4.1, 4.1]
    assert [row["on"] for row in shown.table] == [True, False, True, False]
    assert {row["p"] for row in shown.table} == {None}
