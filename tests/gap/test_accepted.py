"""An effect that is known to be there (`accept` in the campaign) is part of the calibration; an earlier diagnosis is
gone on from (`--resume`)."""

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.report.page import render
from deepsea_cosim.gap.report.signals import without_signals
from deepsea_cosim.gap.result.document import document
from deepsea_cosim.gap.result.parameter_set import parameter_set
from deepsea_cosim.gap.result.read import DiagnosisError, load_earlier
from deepsea_cosim.gap.result.write import write

from .oscillator import campaign, measure


def rubbing():
    """Two runs of a machine that rubs and whose spring hardens."""
    return [measure(seed, lambda t, x, v: -0.5 * np.tanh(v / 0.01) - 400.0 * x**3) for seed in (1, 2)]


@pytest.fixture(scope="module")
def known_friction(toys, tmp_path_factory):
    """That machine, with its friction known."""
    path = campaign(tmp_path_factory.mktemp("known"), toys, rubbing(), 'accept = ["friction"]\n')
    d = diagnose(read(path), processes=1)
    return d, document(d)


def test_it_is_refitted_and_counts_as_calibration(known_friction):
    _, data = known_friction
    friction = data["calibration"]["accepted"]["friction"]
    assert friction["parameters"]["o.F_c"]["value"] == pytest.approx(0.5, rel=0.1)
    assert "friction" not in data["effects"]
    assert data["budget"]["calibrated"] < 0.5 * data["budget"]["delivered"]
    assert data["headline"].count("friction taken as known") == 1


def test_the_search_goes_on_from_it(known_friction):
    _, data = known_friction
    assert data["hypotheses"][0]["effects"] == ["cubic_spring"]
    assert data["budget"]["explained"] < 1.2
    shares = {tuple(p.get("effects", ())): p["share"] for p in data["budget"]["parts"]}
    assert shares[("cubic_spring",)] > 0.9


def test_it_is_simulated_with_and_told_in_the_report(known_friction):
    d, data = known_friction
    assert 'name="o.F_c"' in parameter_set(d)
    page = render(data, without_signals(data))
    assert "is taken as known" in page


@pytest.fixture(scope="module")
def resumed(toys, tmp_path_factory):
    """A diagnosis, the one that goes on from it with friction accepted, and one with that from the beginning."""
    folder = tmp_path_factory.mktemp("resumed")
    path = campaign(folder, toys, rubbing())
    first = diagnose(read(path), processes=1)
    write(first, folder / "out")
    path.write_text('accept = ["friction"]\n' + path.read_text())
    again = diagnose(read(path), processes=1, earlier=load_earlier(folder / "out"))
    return first, again, folder


def test_an_earlier_diagnosis_is_gone_on_from(resumed, known_friction):
    first, again, _ = resumed
    assert document(first)["hypotheses"][0]["effects"] == ["cubic_spring", "friction"]
    data, afresh = document(again), known_friction[1]
    assert data["hypotheses"][0]["effects"] == ["cubic_spring"]
    assert again.simulations < 0.9 * known_friction[0].simulations
    assert data["budget"]["calibrated"] == pytest.approx(afresh["budget"]["calibrated"], rel=0.02)
    assert data["budget"]["explained"] == pytest.approx(afresh["budget"]["explained"], rel=0.02)


def test_what_has_changed_since_is_simulated_anew(resumed, toys):
    """The same sets on a campaign of a machine that does not rub: the earlier answer is no longer one."""
    _, _, folder = resumed
    path = campaign(folder, toys, [measure(seed, lambda t, x, v: -400.0 * x**3) for seed in (3, 4)])
    data = document(diagnose(read(path), processes=1, earlier=load_earlier(folder / "out")))
    assert data["hypotheses"][0]["effects"] == ["cubic_spring"]
    assert data["effects"]["friction"]["inclusion_probability"] < 0.3


def test_a_diagnosis_that_tells_no_sets(tmp_path):
    (tmp_path / "diagnosis.json").write_text('{"schema": 2}')
    with pytest.raises(DiagnosisError, match="tells no sets to go on from"):
        load_earlier(tmp_path)
    with pytest.raises(DiagnosisError, match="cannot be read"):
        load_earlier(tmp_path / "elsewhere")
