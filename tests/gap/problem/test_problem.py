"""What a point means for the runs of a campaign."""

from dataclasses import replace

import numpy as np
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.problem import matching
from deepsea_cosim.master.parallel.pool import Pool


def test_a_bare_name_means_every_component():
    values = {"a.depth": 1.0, "b.depth": 1.0, "b.k": 2.0}
    assert matching("depth", values) == ("a.depth", "b.depth")
    assert matching("b.depth", values) == ("b.depth",)
    assert matching("width", values) == ()


def test_estimation_settings_hold_at_longer_steps_only(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        plain = build_problem(told, catalogue, pool).with_discretisation(coarsening=2)
        quick = build_problem(told, replace(catalogue, estimation={"o.d": 30.0}), pool)
        quick = quick.with_discretisation(coarsening=2)
        np.testing.assert_array_equal(quick.exact([{}])[0], plain.exact([{}])[0])
        assert not np.allclose(quick.evaluate([{}])[0], plain.evaluate([{}])[0])
        coarse, exact = quick.evaluate_both([{}], [{}])
        np.testing.assert_array_equal(coarse[0], quick.evaluate([{}])[0])
        np.testing.assert_array_equal(exact[0], plain.exact([{}])[0])


def test_a_step_is_cut_into_parts_where_an_effect_needs_it(posed):
    told, catalogue = posed
    stiff = replace(catalogue.effect("cubic_spring"), longest_step=4e-3)
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, replace(catalogue, effects=(catalogue.effect("friction"), stiff)), pool)
        step, record = 1e-2, ("o.x",)
        assert problem.substeps({"o.k3": 1.0, "o.F_c": 1.0}, step) == 3
        assert problem.substeps({"o.k3": 1.0}, 4e-3) == 1
        assert problem.substeps({"o.F_c": 1.0}, step) == 1
        for name, parts in (("o.k3", 3), ("o.F_c", 1)):
            found = problem.rows([{name: 1.0}], step, record)[0][0]
            finer = problem.rows([{name: 1.0}], step / parts, record)[0][0]
            np.testing.assert_array_equal(found, finer[::parts])
            assert len(found) == len(problem.grid(0, step))
