"""What has to be settled first begins the headline."""

from types import SimpleNamespace

from deepsea_cosim.gap.result.headline import _to_settle


def test_mistakes_of_runs():
    assert _to_settle(SimpleNamespace(run_mistakes=())) == ""
    told = _to_settle(SimpleNamespace(run_mistakes=("run1: is it?", "run2: is it?")))
    assert told == "To be settled first: run1: is it? And 1 more like that, which cosim-gap check tells."
