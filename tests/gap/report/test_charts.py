"""What is embedded of the signals: peaks kept, holes open, sizes bounded."""

import base64
import json

import numpy as np
import pytest
from deepsea_cosim.gap.report import charts
from deepsea_cosim.gap.report.section import SHOWN
from deepsea_cosim.gap.report.signals import RunSignals, Signals, Trace

from .made import diagnosis, signals


def read(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def test_decimation_keeps_the_peaks_of_every_line():
    t = np.linspace(0.0, 1.0, 20000)
    lines = [np.zeros_like(t) for _ in range(3)]
    for k, y in enumerate(lines):
        y[[1234 + 500 * k, 17000 + 500 * k]] = 5.0, -3.0
    keep = charts.keep_peaks(t, lines, 1200)
    assert len(keep) < 1300
    assert (keep[0], keep[-1]) == (0, len(t) - 1)
    assert all((y[keep].max(), y[keep].min()) == (5.0, -3.0) for y in lines)
    assert (np.diff(keep) > 0).all()
    assert len(charts.keep_peaks(t[:50], [y[:50] for y in lines], 1200)) == 50


def test_series_come_back_as_they_were():
    made = signals(n=800)
    run = charts.embed(diagnosis(), made)["runs"][0]
    trace = next(t for t in run["traces"] if t["connector"] == "hydraulics.P2")
    known = next(t for t in made.runs[0].traces if t.channel == "hydraulics.P2")
    assert trace["unit"] == "bar"
    assert np.array_equal(read(trace["t"], "<f8"), known.t)
    assert read(trace["measured"], "<f4").astype(float) + trace["middle"] == pytest.approx(known.measured, abs=1e-4)
    assert trace["changes"] == [3.2]
    assert run["inputs"][0]["name"] == "command"


def test_no_line_crosses_a_hole_of_the_measurement():
    run = charts.embed(diagnosis(), signals(n=800))["runs"][1]
    for trace in run["traces"]:
        t, y = read(trace["t"], "<f8"), read(trace["measured"], "<f4")
        assert t[np.isnan(y)] == pytest.approx([9.5], abs=0.1)
        assert (np.diff(t) > 0).all()


def test_the_worst_run_and_channel_come_first():
    made = signals()
    large = made.runs[1].traces[1]
    worse = Trace(large.channel, large.t, large.measured, large.delivered, large.calibrated + 50.0, None, large.noise)
    second = RunSignals("run02", False, 22.0, (), (*made.runs[1].traces[:1], worse, *made.runs[1].traces[2:]))
    found = charts.embed(diagnosis(), Signals(made.system, made.channels, (made.runs[0], second, made.runs[2])))
    assert found["first"] == 1
    assert found["runs"][1]["traces"][0]["connector"] == large.channel
    assert "explained" not in found["runs"][1]["traces"][0]


def test_many_channels_are_bounded_in_size():
    one = signals(runs=1, n=20000)
    many = Signals(one.system, one.channels, tuple(one.runs[0] for _ in range(20)))
    found = charts.embed(diagnosis(), many)
    points = sum(len(read(t["t"], "<f8")) for r in found["runs"] for t in r["traces"])
    assert points <= 1.1 * SHOWN.all_points
    assert len(json.dumps(found)) < 6.5e6


def test_without_series_there_is_no_section():
    assert charts.context(diagnosis(), Signals()) is None
