"""Steps that the front library makes without Python are those that Python makes, bit for bit."""

from __future__ import annotations

import gc

import pytest
from deepsea_cosim.fmus.arm import DeepseaArm
from deepsea_cosim.fmus.hydraulics import DeepseaHydraulics
from deepsea_cosim.mechanics import stepping
from fmpy.fmi1 import FMICallException

from .test_fmus import instance  # noqa: F401  (a fixture)


def behind(name: str):
    """The Python object behind an instance of an FMU in this process."""
    found = [x for x in gc.get_objects() if type(x).__name__ in ("DeepseaArm", "DeepseaHydraulics")]
    return next(x for x in found if x.instance_name == name and x.has_front)


def inputs(model: str, k: int) -> dict[str, float]:
    """Those of a step."""
    if model == "DeepseaArm":
        return {"F_h": 7000.0 + 100.0 * (k % 7)}
    return {"x_h": 1e-5 * k, "v_h": 0.01, "x_ref": 2e-5 * k}


@pytest.mark.parametrize("kind", [DeepseaHydraulics, DeepseaArm])
def test_steps_without_python_are_the_same(instance, kind):  # noqa: F811
    """Steps of several lengths, with outputs asked for before some of them, from a restored state as well."""
    model = kind.__name__
    native, python = instance(model, name="native"), kind(instance_name="python", resources=None)
    if model == "DeepseaHydraulics":
        for it in (native.setBoolean, python.set_boolean):
            it([native.vr["command.use_input"]], [True])
    native.start()
    python.setup_experiment(0.0)
    python.enter_initialization_mode()
    python.exit_initialization_mode()
    python_steps = []
    behind("native").advance = lambda t, h: python_steps.append(t)
    outputs = [python.table.index(v.name) for v in python.table if v.causality == "output"]

    def go(first: int, t: float) -> float:
        for k in range(first, first + 40):
            h = 6e-3 if k % 4 == 0 else 1e-3
            for name, value in inputs(model, k).items():
                native.set(name, value)
                python.set_real([native.vr[name]], [value])
            if k % 5 == 0:
                assert native.all_outputs() == python.get_real(outputs)
            native.doStep(t, h)
            python.do_step(t, h)
            t += h
            assert native.all_outputs() == python.get_real(outputs)
        return t

    t = go(0, 0.0)
    states = native.getFMUstate(), python._get_fmu_state()
    go(40, t)
    native.setFMUstate(states[0])
    python._set_fmu_state(states[1])
    go(40, t)
    native.freeFMUstate(states[0])
    assert python_steps == []


def test_a_step_that_is_too_long_is_refused_and_harmless(instance):  # noqa: F811
    it = instance("DeepseaArm").start()
    with pytest.raises(FMICallException):
        it.doStep(0.0, 1e6)
    assert it.log[-1][0] == 3
    assert "the arm takes at most 40000 s" in it.log[-1][1]
    it.doStep(0.0, 1e-3)
    assert len(it.log) == 1


def test_outputs_that_are_not_finite_are_told_by_name(instance):  # noqa: F811
    it = instance("DeepseaArm").start()
    behind("it").row[stepping.OMEGA] = float("nan")
    with pytest.raises(FMICallException):
        it.doStep(0.0, 1e-3)
    assert "not finite at t = 0.001 s" in it.log[-1][1]


def test_a_linkage_that_turns_over_is_told_once(instance):  # noqa: F811
    it = instance("DeepseaArm").start()
    it.set("F_h", 3e5)
    for k in range(400):
        it.doStep(k * 1e-3, 1e-3)
    told = [text for status, text in it.log if status == 1]
    assert len(told) == 1
    assert "passed its dead centre" in told[0]
