"""Free curves: their shapes, what they add to a model's parameters, and the formula they are drawn beside."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.catalogue import Curve
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.candidates import check_catalogue
from deepsea_cosim.gap.problem.curves import curve_form, formula_over, knots_of, smooth_shapes
from deepsea_cosim.gap.settings import CurveSettings
from deepsea_cosim.master.parallel.pool import Pool
from deepsea_cosim.master.simulation.session import Session

KNOTS = (-1.0, -0.5, -0.1, 0.1, 0.5, 1.0)
SLIDE = (-0.4, -0.25, -0.15, -0.05, 0.05, 0.15, 0.25, 0.4)
SETTINGS = CurveSettings()
RUB = Curve(
    "rub", "rubs", ("friction",), "m/s", "N", KNOTS, tuple(f"o.y{k}" for k in range(6)), 150.0, "o.v_max",
    "F_c + F_e * exp(-abs(x) / 0.1)", {"F_c": "o.F_c", "F_e": "o.F_e"},
)  # fmt: skip


def test_the_smoother_the_fewer_shapes_and_neighbours_move_together():
    shapes = smooth_shapes(np.array(KNOTS), SETTINGS)
    assert len(smooth_shapes(np.array(KNOTS), replace(SETTINGS, length=2.0))) < len(shapes) <= len(KNOTS)
    covariance = shapes.T @ shapes
    assert np.diag(covariance) == pytest.approx(1.0, abs=0.1)
    near, far, mirrored = covariance[4, 5], covariance[3, 5], covariance[0, 5]
    assert near > 2.0 * far > 0.1
    assert mirrored == pytest.approx(SETTINGS.mirror, abs=0.05)


def test_a_form_adds_its_shapes_at_the_knots():
    form = curve_form(RUB, SETTINGS)
    assert {x.addresses for x in form.parameters} == {RUB.parameters}
    point = {x.name: 0.5 for x in form.parameters}
    shapes = smooth_shapes(np.array(KNOTS), SETTINGS)
    assert form.values(point) == pytest.approx(150.0 * 0.5 * shapes.sum(0))
    assert form.values({}) == pytest.approx(0.0)


def test_values_at_the_knots_are_set_in_the_model(posed):
    told, catalogue = posed
    addresses = tuple(f"o.y{k}" for k in range(1, len(SLIDE) + 1))
    curve = replace(RUB, knots=SLIDE, knots_of="", parameters=addresses, names={"F_c": "o.F_c", "F_e": "o.k"})
    with Pool(told.system, None, 1) as pool:
        problem = build_problem(told, replace(catalogue, curves=(curve,)), pool)
    (friction,) = [c for c in problem.candidates if c.id == "friction"]
    (form,) = friction.forms
    point = {x.name: (-1.0) ** k for k, x in enumerate(form.parameters)}
    made = problem.model_values(0, {**point, friction.parameters[0].name: 1.0})
    assert [made[a] for a in addresses] == pytest.approx(form.values(point))
    assert set(made) == {*addresses, "o.F_c"}


@pytest.mark.parametrize(
    ("changes", "told_of"),
    [
        ({"parameters": ("o.y1", "o.y2", "o.y3", "o.y4", "o.y5", "o.y9000")}, "y9000"),
        ({"knots_of": "o.size"}, "o.size"),
        ({"formula": "F_c * size"}, "curve rub: formula .*size"),
        ({"names": {"F_c": "o.F", "F_e": "o.k"}}, "o.F"),
    ],
)
def test_a_curve_that_does_not_fit_the_package(posed, changes, told_of):
    told, catalogue = posed
    addresses = tuple(f"o.y{k}" for k in range(1, len(KNOTS) + 1))
    good = replace(RUB, knots_of="", parameters=addresses, names={"F_c": "o.F_c", "F_e": "o.k"})
    with Session(told.system) as session:
        check_catalogue(replace(catalogue, curves=(good,)), session)
        with pytest.raises(CosimError, match=told_of):
            check_catalogue(replace(catalogue, curves=(replace(good, **changes),)), session)


def test_knots_may_be_shares_of_a_parameter():
    assert knots_of(RUB, {"o.v_max": 0.2}) == pytest.approx(0.2 * np.array(KNOTS))


def test_a_formula_is_computed_from_the_parameters():
    x = np.array([-0.1, 0.0, 0.2])
    made = formula_over(RUB, {"o.F_c": 300.0, "o.F_e": 100.0}, x)
    assert made == pytest.approx(300.0 + 100.0 * np.exp(-np.abs(x) / 0.1))


@pytest.mark.parametrize("formula", ["F_c +", "stranger * x", "1 / x", "open('f')", "sqrt(F_c, 2)"])
def test_a_formula_that_cannot_be_computed(formula):
    with pytest.raises(ValueError, match="at x = 0"):
        formula_over(replace(RUB, formula=formula), {"o.F_c": 1.0, "o.F_e": 1.0}, np.array([0.0]))
