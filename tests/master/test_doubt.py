"""What a run says of itself where small errors of its coupling have grown: rests that do not hold, inputs held off."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.accuracy.departure import departures
from deepsea_cosim.master.accuracy.doubt import warning
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import component, connector, description, link, pack, system

T = np.linspace(0.0, 20.0, 4001)


def leaving(after, rate=4.0, small=1e-3):
    """A signal that leaves 0 for 1: x' = rate x (1 - x), from `small` at the time `after` on, where it is put."""
    return np.where(after > T, 0.0, 1.0 / (1.0 + (1.0 / small - 1.0) * np.exp(-rate * (T - after))))


@pytest.mark.parametrize("small", [1e-3, 1e-5])
def test_a_rest_that_does_not_hold(small):
    """The rate grows from `small` to a quarter of the full one."""
    (found,) = departures(T, leaving(2.0, small=small)[:, None])
    assert found.factor == pytest.approx(0.25 / small, rel=0.5)
    assert found.change > 0.9
    assert 2.0 <= found.begin < found.end < 2.0 + np.log(1.0 / small) / 4.0 + 1.0


@pytest.mark.parametrize(
    "driven",
    [
        np.sin(T), 1.0 - np.cos(T), T**2, np.clip(T - 5.0, 0.0, 8.0), np.exp(-T), np.exp(-T) * np.sin(9.0 * T),
        np.where(T > 5.0, 1.0, 0.0), 1.0 - np.exp(-np.maximum(T - 5.0, 0.0)),
        np.clip((T - 4.0) / 10.0, 0.0, 1.0) ** 3 * (10.0 - 15.0 * np.clip((T - 4.0) / 10.0, 0.0, 1.0)),
    ],
)  # fmt: skip
def test_what_is_driven_does_not_leave_by_itself(driven):
    assert departures(T, driven[:, None]) == []


def test_a_component_that_moves_is_not_at_rest():
    """The same signal beside one that is on its way all the time."""
    assert departures(T, np.stack([leaving(2.0), np.sin(T)], axis=1)) == []
    assert len(departures(T, np.stack([leaving(2.0), np.zeros_like(T)], axis=1))) == 1


def test_short_and_empty_records():
    assert departures(T[:20], leaving(0.0)[:20, None]) == []
    assert departures(T, np.empty((len(T), 0))) == []
    assert departures(T, np.full((len(T), 1), np.nan)) == []


def told(off):
    return {"signal": "a.y", "from_s": 2.0, "to_s": 4.0, "growth": 300.0, "input": "a.u", "input_off": 4e-3,
            "signal_off": off}  # fmt: skip


def test_the_line_names_signal_time_and_remedy():
    (line,) = warning(told(0.4), 1, 1e-3)
    for part in ("a.y may be off by 40%", "from t = 2 s", "3e+02-fold by 4 s", "a.u", "nepce or --step 0.0005"):
        assert part in line
    (line,) = warning(told(0.4), 2, 1e-3)
    assert "--method" not in line
    assert warning(told(0.05), 2, 1e-3) == warning(None, 2, 1e-3) == []


@pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")
def test_how_far_inputs_are_off(tmp_path):
    """A mass on a spring swings with omega h = 0.1: Gauss-Seidel holds the input that comes first half a step's change
    off, which is 0.05 of the amplitude and 0.025 of the range."""
    seen = {}

    def look(columns, sample, held):
        seen.update({name: held.worst(name) for name in columns})

    ports = connector("u1", "input"), connector("y1", "output")
    fmus = {f"resources/{n}.fmu": native.linear(tmp_path, 2, n, through=False) for n in ("a", "b")}
    parts = [component(n, f"resources/{n}.fmu", *ports) for n in ("a", "b")]
    text = description(system("root", *parts, links=[link("a.y1", "b.u1"), link("b.y1", "a.u1")]), stop=20.0, step=0.1)
    package = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, **fmus})
    one = {"A": [[0.0]], "C": [[1.0]]}
    matrices = native.values("a", **one, B=[[1.0]], x0=[1.0]) | native.values("b", **one, B=[[-1.0]], x0=[0.0])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("deepsea_cosim.master.simulation.run.doubt", look)
        run(package, tmp_path / "out", Options(changes=tuple(matrices.items())))
    assert set(seen) == {"a", "b"}
    for name, (which, share) in seen.items():
        assert which == f"{name}.u1"
        assert 0.015 < share < 0.026


@pytest.mark.parametrize(("step", "borne_out"), [(0.05, False), (0.5, True)])
def test_a_doubt_that_the_repetition_does_not_bear_out_is_no_warning(fmus, tmp_path, monkeypatch, step, borne_out):
    """x' = y, y' = -x: what Gauss-Seidel does in long steps is off, in short ones it is not."""
    ports = connector("u1", "input"), connector("y1", "output")
    parts = [component(n, "resources/L.fmu", *ports) for n in ("a", "b")]
    root = system("root", *parts, links=[link("a.y1", "b.u1"), link("b.y1", "a.u1")])
    text = description(root, stop=20.0, step=step)
    package = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, "resources/L.fmu": fmus[2]})
    one = {"A": [[0.0]], "C": [[1.0]]}
    matrices = native.values("a", **one, B=[[1.0]], x0=[1.0]) | native.values("b", **one, B=[[-1.0]], x0=[0.0])
    in_doubt = {**told(0.4), "signal": "a.y1"}
    monkeypatch.setattr("deepsea_cosim.master.simulation.run.doubt", lambda *_: in_doubt)
    summary = run(package, tmp_path / "out", Options(changes=tuple(matrices.items()), check_step=True)).summary
    assert (summary["step_check"]["errors"]["a.y1"]["relative"] > 0.1) == borne_out
    assert any("a.y1 may be off by 40%" in text for text in summary["warnings"]) == borne_out
    assert summary["doubt"] == in_doubt
