"""Which effects are named, and so which set of effects is reported."""

from types import SimpleNamespace

from deepsea_cosim.gap.pipeline.state import Inclusion, State
from deepsea_cosim.gap.settings import DEFAULT

GROUPS = {"delay": "timing", "lag": "timing", "friction": "force", "spring": "force"}


def named(effects, groups):
    inclusion = Inclusion({id: effects.get(id, 0.0) for id in GROUPS}, groups, GROUPS)
    state = SimpleNamespace(problem=SimpleNamespace(settings=DEFAULT), inclusion=inclusion)
    return {id for id in GROUPS if State.is_named(state, id)}


def test_what_cannot_be_told_apart_is_named_as_its_group():
    assert named({"delay": 0.45, "lag": 0.4, "friction": 0.9}, {"timing": 0.8, "force": 0.9}) == {
        "delay", "lag", "friction"
    }  # fmt: skip


def test_beside_one_that_is_named_itself_a_member_of_its_group_has_to_be_sure_itself():
    assert named({"friction": 0.54, "spring": 0.04}, {"timing": 0.0, "force": 0.54}) == {"friction"}
    assert named({"friction": 0.54, "spring": 0.51}, {"timing": 0.0, "force": 0.7}) == {"friction", "spring"}


def test_nothing_is_named_below_even_odds():
    assert named({"friction": 0.49, "lag": 0.3}, {"timing": 0.3, "force": 0.49}) == set()
