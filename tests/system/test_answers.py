"""What the shipped scenarios say after their run, against what their signals and the paper say."""

import pytest
from deepsea_cosim.core.display_units import DisplayUnits
from deepsea_cosim.master.simulation.run import Options, run


@pytest.fixture(scope="module")
def deep(built, tmp_path_factory):
    return run(built / "deepsea_11km.ssp", tmp_path_factory.mktemp("run"), Options(step=2e-3))


def test_the_times_are_the_papers(deep):
    values = {name: value for name, (value, _) in deep.answers.values.items()}
    assert values["out"] == pytest.approx(7.625, rel=0.01)
    assert values["home"] == pytest.approx(7.156, rel=0.01)


def test_the_pressures_add_up_to_the_pumps(deep):
    values = {name: value for name, (value, _) in deep.answers.values.items()}
    parts = [values[name] for name in ("valve", "lines", "load")]
    assert min(parts) > 1e6
    assert sum(parts) == pytest.approx(values["supply"], rel=1e-9)
    assert values["supply"] == pytest.approx(20e6, rel=1e-3)  # the relief valve's


def test_it_is_said(deep):
    stroke, pressures = deep.answers.texts(DisplayUnits())
    assert stroke.startswith("At 11000 m the rod takes 7.6")
    assert "longer than it is told to" in stroke
    assert pressures.startswith("Going out, of the pump's 20.0 MPa the lines take 11.")


def test_in_time_and_not_at_all_is_said(built, tmp_path):
    shallow = run(built / "deepsea_0km.ssp", tmp_path / "a", Options(step=2e-3))
    assert shallow.answers.texts(DisplayUnits())[0].startswith("At 0 m the rod goes out by 200 mm in 5.00 s, as it is")
    short = run(built / "deepsea_11km.ssp", tmp_path / "b", Options(step=2e-3, stop_time=8.0))
    assert short.answers.texts(DisplayUnits()) == ["At 11000 m the rod does not get out by 200 mm within the run."]
