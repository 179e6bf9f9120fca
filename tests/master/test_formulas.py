"""Formulas of packages: values against numpy, what does not exist, and what is refused."""

import numpy as np
import pytest
from deepsea_cosim.master.simulation.formulas import Formula, FormulaError, number

T = np.linspace(0.0, 4.0, 401)
KNOWN = {"a.x": T**2, "a.y": np.sin(T), "p": 3.0, "never": None, "b.D[1,1]": 7.0, "sub.a.k": 2.0}


def value(text):
    return number(Formula(text).of(T, KNOWN))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("p * 2 - 1", 5.0),
        ("-p ** 2", -9.0),
        ("sub.a.k / 4", 0.5),
        ("signal('b.D[1,1]') + 1", 8.0),
        ("final(a.x)", 16.0),
        ("max(a.x - 2 * a.x)", 0.0),
        ("at(a.x, 3)", 9.0),
        ("reaches(a.x, 4, 0.0001)", 2.0),
        ("mean(a.x)", 16 / 3),
        ("mean(a.x, 1, 3)", 13 / 3),
        ("mean(a.x, 2)", 28 / 3),
        ("integral(a.y, 0, 3.005)", 1 - np.cos(3.005)),
        ("mean(p)", 3.0),
        ("range(a.x, 1, 2)", 3.0),
        ("abs(-p)", 3.0),
        ("p > 2 and p < 4", 1.0),
        ("not p > 2", 0.0),
        ("p == 3 or never", None),
        ("missing(never)", 1.0),
        ("missing(p)", 0.0),
        ("missing(reaches(a.y, 5, 0.1))", 1.0),
        ("never + 1", None),
        ("mean(a.x, never, 2)", None),
        ("mean(a.x, 3, 2)", None),
        ("mean(a.x, 2, 9)", None),
        ("above(a.x, 4)", 2.0),
    ],
)
def test_values(text, expected):
    found = value(text)
    assert found == (expected if expected is None else pytest.approx(expected, rel=1e-4, abs=1e-12))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a.x", "it is a signal, no number"),
        ("at(a.x, a.y)", "a signal stands where a number should"),
        ("a.z", "there is no signal or parameter 'a.z'; did you mean"),
        ("meen(a.x)", "there is no function 'meen'"),
        ("at(a.x)", "at takes 2 values, not 1"),
        ("mean(a.x, 1, 2, 3)", "mean takes 1 to 3 values, not 4"),
        ("1 +", "is no formula"),
        ("", "is no formula"),
        ("p; p", "is no formula"),
        ("'text'", "is not allowed"),
        ("p.__class__()", "is not allowed"),
        ("[p]", "is not allowed"),
        ("p if p else p", "is not allowed"),
        ("(lambda: p)()", "is not allowed"),
        ("__import__('os')", "there is no function '__import__'"),
        ("mean(a.x, begin=1)", "is not allowed"),
        ("1 < p < 5", "is not allowed"),
        ("p @ p", "is not allowed"),
        ("2 ** 0.5j", "is not allowed"),
        ("(-2) ** 0.5", "cannot be computed"),
        ("10.0 ** 999", "cannot be computed"),
        ("+" * 60 + "p", "nested more than"),
        ("p" * 1001, "too long"),
        ("(a.x + 1).y", "is no address"),
    ],
)
def test_what_is_none_is_told(text, words):
    with pytest.raises(FormulaError) as caught:
        value(text)
    assert words in str(caught.value)


def test_a_division_by_zero_is_no_number_that_is_told():
    with pytest.raises(FormulaError, match="cannot be computed"):
        value("1 / (p - 3)")


def test_its_names_are_the_addresses():
    assert Formula("mean(a.x - sub.a.k, 1) + signal('b.D[1,1]') + a.x").names == ("a.x", "sub.a.k", "b.D[1,1]")
