"""How long something will take is told once, as soon as that is known, where it is long."""

import pytest
from deepsea_cosim.master import terminal
from deepsea_cosim.master.terminal import Estimate


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(terminal, "perf_counter", lambda: now[0])
    return now


def test_a_long_one_is_told_once_after_three_seconds(clock):
    told = []
    estimate = Estimate(told.append, text="{} FMUs will be loaded in about {}")
    for done in range(0, 1000, 10):
        clock[0] = 0.25 * done
        estimate(done, 1000)
    assert told == ["1000 FMUs will be loaded in about 4 minutes"]


def test_a_short_one_is_not_told(clock):
    told = []
    estimate = Estimate(told.append)
    for done in range(100):
        clock[0] = 0.3 * done
        estimate(done, 100)
    assert told == []


def test_a_large_record_is_told_with_the_space_there_is(clock, tmp_path, monkeypatch):
    told, file = [], tmp_path / "results.csv"
    file.write_bytes(b"0" * 1000)
    monkeypatch.setattr(terminal, "disk_usage", lambda _: type("Usage", (), {"free": 5e8}))
    estimate = Estimate(told.append, file)
    for done, now in ((0, 0.0), (1, 4.0)):
        clock[0] = now
        estimate(done, 2_000_000)
    assert told[0].startswith("2000000 steps will take about 93 days more, its record about 2 GB")
    assert "only 0.5 GB are free" in told[1]
