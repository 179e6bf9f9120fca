"""Large packages: what they cost grows as they do, and what is done at once gives what is done one by one."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.coupling.single_changes import SingleChanges
from deepsea_cosim.master.engine.runner import Runner
from deepsea_cosim.master.simulation import recording
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native
from benchmarks.scale import package

needs_compiler = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def coupled():
    """What comes round of seven inputs of three components: each output answers to the inputs of its own component."""
    takers = ["a", "b", "a", "c", "b", "a", "c"]
    givers = ["b", "c", "a", "b", "a", "c", "c"]
    random = np.random.default_rng(3)
    weights = random.normal(size=(7, 7)) * [[giver == taker for taker in takers] for giver in givers]

    def came(x):
        return np.sin(weights @ x) + 0.1 * weights @ x

    return came, givers, takers, weights


def test_inputs_changed_in_groups_are_inputs_changed_one_by_one():
    came, givers, takers, _ = coupled()
    calls = []
    single = SingleChanges(lambda x: calls.append(x) or came(x), givers, takers)
    x = np.linspace(-1.0, 1.0, 7)
    changed = x + 1e-3 * np.arange(1, 8)
    made = single.residuals(x, came(x), changed, lambda left, _: left)
    for j in range(7):
        there = x.copy()
        there[j] = changed[j]
        assert made[:, j].tobytes() == (came(there) - there).tobytes()
    assert len(calls) == 3  # as many as component a has inputs


def test_a_loop_is_told_from_a_chain():
    came, givers, takers, weights = coupled()
    x = np.ones(7)
    assert SingleChanges(came, givers, takers).go_round(x, x + 1e-3)
    later = np.triu(weights, 1)  # none answers to one before it
    assert not SingleChanges(lambda x: later @ x, givers, takers).go_round(x, x + 1e-3)
    itself = np.diag(np.diag(weights))
    assert itself.any()
    assert SingleChanges(lambda x: itself @ x, givers, takers).go_round(x, x + 1e-3)


@needs_compiler
@pytest.mark.parametrize("method", ["gauss-seidel", "nepce"])
def test_a_package_three_times_as_large_takes_three_times_as_many_calls(tmp_path, monkeypatch, method):
    calls = []
    own = Runner.run
    monkeypatch.setattr(Runner, "run", lambda self, *a, **k: calls.append(1) or own(self, *a, **k))
    counts = []
    for size in (10, 30):
        calls.clear()
        run(package(tmp_path / str(size), size, 5), tmp_path / str(size) / "out", Options(results="", method=method))
        counts.append(len(calls))
    assert counts[1] < 3.2 * counts[0]


@needs_compiler
def test_blocks_of_many_columns_have_fewer_rows_and_the_same_content(tmp_path, monkeypatch):
    path = package(tmp_path, 4, 300)
    whole = run(path, tmp_path / "whole", Options())
    monkeypatch.setattr(recording, "BLOCK_BYTES", 8 * 7 * 140)
    small = []
    own = recording.Recording.flush
    monkeypatch.setattr(recording.Recording, "flush", lambda self: small.append(self._filled) or own(self))
    parted = run(path, tmp_path / "parted", Options())
    assert max(small) <= 8
    assert (tmp_path / "parted" / "results.csv").read_bytes() == (tmp_path / "whole" / "results.csv").read_bytes()
    assert parted.extremes.tobytes() == whole.extremes.tobytes()


def test_the_sample_of_many_columns_has_fewer_points():
    assert recording.sample_stride(1_000_000, 1000) == 250
    points = 1_000_000 / recording.sample_stride(1_000_000, 100_000)
    assert points * 8 * 100_000 < 2 * recording.SAMPLE_BYTES
