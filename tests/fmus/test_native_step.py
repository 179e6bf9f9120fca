"""Steps that the front library makes by itself: bitwise what Python does, and Python where something is to be said."""

from __future__ import annotations

import json
import sys
from collections import Counter

import numpy as np
import pytest
from deepsea_cosim.hydraulics_fmu import states, stepping
from deepsea_cosim.hydraulics_fmu.constants import SIZE, by_name
from deepsea_cosim.hydraulics_fmu.supply_unit import stepping as unit

from .test_fmus import MODELS, Instance, fails, instance, set_moving_inputs  # noqa: F401

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the front library is for Linux")

PYTHON = "python"
"""Name of an instance that is to step in Python."""


@pytest.fixture
def make(instance, monkeypatch, tmp_path):  # noqa: F811
    """Maker of instances; `make.calls` counts the Python calls by instance and method."""
    calls: Counter[tuple[str, str]] = Counter()
    known = set()

    def counted(method):
        def call(self, *arguments):
            calls[self.instance_name, method.__name__] += 1
            return method(self, *arguments)

        return call

    def made(model: str, name: str = "native", **kwargs) -> Instance:
        it = instance(model, name=name, **kwargs)
        script = (tmp_path / model / "resources" / "slavemodule.txt").read_text().strip()
        base = sys.modules[f"deepsea_cosim_{script.rpartition('_')[2]}.fmus.instance"].Instance
        if model not in known:
            known.add(model)
            tell = base._tell_step
            monkeypatch.setattr(base, "_tell_step", lambda self: self.instance_name == PYTHON or tell(self))
            for method in ("do_step", "_refresh"):
                monkeypatch.setattr(base, method, counted(getattr(base, method)))
        return it

    made.calls = calls
    return made


def moved(it: Instance, model: str, first: int, count: int) -> list[list[float]]:
    """Outputs before and after some pairs of steps of different lengths, with inputs that move."""
    rows = []
    for k in range(first, first + count):
        set_moving_inputs(it, model, k)
        rows.append(it.all_outputs())
        it.doStep(1e-3 * k, 2.5e-4)
        it.doStep(1e-3 * k + 2.5e-4, 7.5e-4)
        rows.append(it.all_outputs())
    return rows


@pytest.mark.parametrize("model", MODELS)
def test_python_is_not_called(make, model):
    it = make(model).start()
    make.calls.clear()
    moved(it, model, 0, 20)
    assert not make.calls
    state = it.getFMUstate()
    moved(it, model, 20, 2)
    it.setFMUstate(state)
    moved(it, model, 20, 2)
    it.freeFMUstate(state)
    it.reset()
    it.start()
    make.calls.clear()
    moved(it, model, 0, 20)
    assert not make.calls


@pytest.mark.parametrize("model", MODELS)
def test_both_ways_are_bitwise_the_same(make, model):
    """Also after going back and after a reset; and a state of either goes on in the other."""
    pair = [make(model), make(model, PYTHON)]
    rows, states, data = [], [], []
    for it in pair:
        it.start()
        rows.append(moved(it, model, 0, 20))
        states.append(it.getFMUstate())
        data.append(it.serializeFMUstate(states[-1]))
        rows[-1] += moved(it, model, 20, 10)
    for it, state, other in zip(pair, states, reversed(data), strict=True):
        it.setFMUstate(state)
        assert moved(it, model, 20, 10) == rows[0][-20:]
        it.freeFMUstate(state)
        state = it.deSerializeFMUstate(other)
        it.setFMUstate(state)
        assert moved(it, model, 20, 10) == rows[0][-20:]
        it.freeFMUstate(state)
        it.reset()
        it.start()
        assert moved(it, model, 0, 20) == rows[0][:40]
    assert rows[0] == rows[1]
    assert [bool(make.calls[it, "do_step"]) for it in ("native", PYTHON)] == [False, True]


@pytest.mark.parametrize("model", MODELS)
def test_instances_in_turn(make, model):
    names = ("native", "native too", PYTHON)
    made = [make(model, name).start() for name in names]
    rows = [[row for it in made for row in moved(it, model, k, 1)] for k in range(10)]
    assert all(row[0:2] == row[2:4] == row[4:6] for row in rows)


@pytest.mark.parametrize("model", MODELS)
def test_a_refused_step_leaves_no_trace(make, model):
    it, other = make(model).start(), make(model, "undisturbed").start()
    first = moved(it, model, 0, 5)
    for t, h, words in (
        (6e-3, 1e-3, "the FMU is at t = 0.005 s"),
        (float("nan"), 1e-3, "the FMU is at t = 0.005 s"),
        (5e-3, 0.0, "has to be positive"),
        (5e-3, -1e-3, "has to be positive"),
        (5e-3, float("inf"), "has to be positive"),
    ):
        with fails(it, words):
            it.doStep(t, h)
    make.calls.clear()
    second = moved(it, model, 5, 5)
    assert not make.calls
    assert first + second == moved(other, model, 0, 10)
    it.terminate()
    with fails(it, "after terminate"):
        it.doStep(1e-2, 1e-3)


def test_too_long_a_step_is_not_begun(make):
    it, other = make("DeepseaArm").start(), make("DeepseaArm", "undisturbed").start()
    with fails(it, "the arm takes at most 40000 s"):
        it.doStep(0.0, 1e6)
    assert moved(it, "DeepseaArm", 0, 5) == moved(other, "DeepseaArm", 0, 5)


@pytest.mark.parametrize("model", MODELS)
def test_what_goes_wrong_is_told_in_the_same_words(make, model):
    """A state that is no number: read after an input has changed, and stepped; then a good state goes on."""
    told = []
    for name in ("native", PYTHON):
        it = make(model, name).start()
        it.doStep(0.0, 1e-3)
        good = it.getFMUstate()
        content = json.loads(it.serializeFMUstate(good).rstrip(b"\0"))
        if model == "DeepseaArm":
            content["model"]["arm"][0] = float("nan")
        elif model == "DeepseaSupply":
            content["model"]["row"][unit.STATE] = float("nan")
        else:
            row = content["model"]["row"]
            chain = states.chain_length(by_name(np.array(row[stepping.CONSTANTS : stepping.CONSTANTS + SIZE])))
            row[stepping.CONSTANTS + SIZE + chain + states.STATES.names.index("p_1")] = float("nan")
        bad = it.deSerializeFMUstate(json.dumps(content).encode())
        it.setFMUstate(bad)
        it.set({"DeepseaArm": "F_h", "DeepseaSupply": "Qp[1]"}.get(model, "v_h"), 0.01)
        with fails(it, "not finite at t = 0.001 s: "):
            it.all_outputs()
        with fails(it):
            it.doStep(1e-3, 1e-3)
        it.setFMUstate(good)
        told.append((it.log, moved(it, model, 1, 5)))
        it.freeFMUstate(good)
        it.freeFMUstate(bad)
    assert told[0] == told[1]
    assert make.calls["native", "do_step"] == 1


def test_the_arm_turns_over_and_tells_it_once(make):
    """Also when the step in which it happens is repeated."""
    found = []
    for name in ("native", PYTHON):
        it = make("DeepseaArm", name).start()
        it.set("F_h", 20000.0)
        rows = []
        for k in range(400):
            state = it.getFMUstate()
            it.doStep(k * 5e-3, 5e-3)
            first = it.all_outputs()
            it.setFMUstate(state)
            it.doStep(k * 5e-3, 5e-3)
            it.freeFMUstate(state)
            rows.append(it.all_outputs())
            assert rows[-1] == first
        found.append((it.log, rows))
    assert found[0] == found[1]
    [(status, text)] = found[0][0]
    assert status == 1
    assert "dead centre" in text
    assert make.calls["native", "do_step"] == 1


def test_a_command_that_is_not_followed_is_told_once(make):
    found = []
    for name in ("native", PYTHON):
        it = make("DeepseaHydraulics", name).start()
        rows = []
        for k in range(10):
            it.set("x_ref", 1e-4 * k)
            it.doStep(k * 1e-3, 1e-3)
            rows.append(it.all_outputs())
        found.append((it.log, rows))
    assert found[0] == found[1]
    assert [status for status, _ in found[0][0]] == [1]
    assert make.calls["native", "do_step"] == 1
