"""The catalogue's entries as parameters to be estimated, and what does not fit the package."""

from dataclasses import replace
from pathlib import Path

import pytest
from deepsea_cosim.core.errors import CosimError, UnknownNameError
from deepsea_cosim.gap.campaign.campaign import Campaign
from deepsea_cosim.gap.campaign.catalogue import Base, Catalogue, Experiment, Measurable
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load, load_from_package
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.candidates import base_parameters, check_catalogue
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.problem.problem import RunConditions
from deepsea_cosim.gap.settings import ParameterSettings
from deepsea_cosim.master.parallel.pool import Pool
from deepsea_cosim.master.simulation.session import Session

from tests.gap.oscillator import campaign, measure


def test_values_that_an_fmu_refuses_are_found_at_once(built):
    package = built / "deepsea_0km.ssp"
    own = load_from_package(package)
    friction = own.effect("cylinder_coulomb_friction")
    wild = replace(friction, parameters=(replace(friction.parameters[0], high=1e12),))
    with Session(package) as session:
        check_catalogue(own, session)
        for wrong, told in (
            ({"experiments": (Experiment("depth", (1e9,)),)}, r"experiment depth: .*depth=1000000000\.0.* range"),
            ({"effects": (wild,)}, r"effect cylinder_coulomb_friction: .* range"),
            ({"measurables": (Measurable("arm.z", 1.0),)}, "measurable arm.z: no connector"),
            ({"experiments": (Experiment("command.use_input", (1.0,)),)}, "is no real number"),
        ):
            with pytest.raises(CosimError, match=told):
                check_catalogue(replace(own, **wrong), session)


def test_an_estimation_setting_that_nobody_has(posed):
    told, catalogue = posed
    with pytest.raises(UnknownNameError, match="estimation: no component has a parameter"):
        build_problem(told, replace(catalogue, estimation={"o.rtol": 1.0}), None)


def test_two_base_entries_of_one_parameter_are_refused():
    """k means that of every component; o.k named as well would be refitted twice."""
    run = RunConditions("run", 1.0, {}, {}, {"o.k": 1.0, "q.k": 2.0})
    catalogue = Catalogue((), (), (), (Base("k", 0.05),))
    campaign = Campaign("c", Path("s.ssp"), None, (), ())
    settings = ParameterSettings()
    found = base_parameters(campaign, catalogue, [run], [], settings)
    assert [x.addresses for x in found] == [("o.k", "q.k")]
    with pytest.raises(CosimError, match=r"two entries mean 'o.k'"):
        base_parameters(replace(campaign, base={"o.k": 0.1}), catalogue, [run], [], settings)


@pytest.mark.parametrize(
    ("u", "h", "step"), [(0.0, 0.5, 0.5), (0.9, 0.5, -0.5), (1.0, 0.1, -0.1), (0.1, 3.0, -1.1), (-0.1, 3.0, 1.1)]
)
def test_a_step_of_a_difference_stays_in_the_range(u, h, step):
    x = EstimatedParameter("x", "base", 1.0, 0.1, -1.0, 1.0, 1.0)
    assert x.step_inside(u, h) == pytest.approx(step)


def test_a_channel_that_reads_the_same_all_the_time_has_no_errors_of_its_sensor(toys, tmp_path):
    """Its span is nothing: a curvature in units of that would be without end."""
    runs = [measure(1, lambda t, x, v: 0.0)]
    path = campaign(tmp_path, toys, runs)
    flat = '[[channel]]\ncolumn = "v"\nconnector = "o.v"\nunit = "m/s"\nnoise_std = 0.02\n'
    path.write_text(path.read_text().replace("[[run]]", flat + "[[run]]", 1))
    run = tmp_path / "run0.csv"
    head, *rows = run.read_text().splitlines()
    run.write_text("\n".join([head + ",v", *(row + ",0.25" for row in rows)]) + "\n")
    told = read(path)
    effects = (tmp_path / told.effects).read_text() if told.effects else ""
    assert "[[sensor]]" in effects
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, load(told.effects), pool)
    sensors = {x.parameters[0].name for x in problem.candidates if x.parameters[0].kind == "sensor"}
    assert sensors
    assert not [name for name in sensors if ".o.v." in name]
