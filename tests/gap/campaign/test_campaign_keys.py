"""The keys of campaign.toml that real campaigns asked for, and what is told where they are wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.campaign import FactorTolerance
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.cli import main

CAMPAIGN = """
name = "pool"
system = "s.ssp"
[[channel]]
column = "x"
connector = "arm.x_h"
unit = "mm"
[[channel]]
column = "P"
connector = "hydraulics.P1"
unit = "bar"
[[run]]
file = "run1.csv"
[[base]]
parameter = "hydraulics.oil.nu0"
tolerance = 0.02
"""

T = np.arange(200) * 0.1
X, P = 50.0 + 40.0 * np.sin(0.7 * T), 100.0 + 20.0 * np.cos(0.9 * T)

Written = Callable[..., Path]


def table(time: np.ndarray = T, x: np.ndarray = X, p: np.ndarray = P) -> str:
    rows = (f"{a:.9g},{b:.9g},{c:.9g}" for a, b, c in zip(time, x, p, strict=True))
    return "\n".join(["time,x,P", *rows]) + "\n"


@pytest.fixture
def written(tmp_path: Path) -> Written:
    (tmp_path / "s.ssp").write_bytes(b"x")

    def write(old: str = "", new: str = "", run: str = table(), head: str = "") -> Path:
        text = CAMPAIGN.replace(old, new, 1) if old else CAMPAIGN
        (tmp_path / "campaign.toml").write_text(head + text)
        (tmp_path / "run1.csv").write_text(run)
        return tmp_path / "campaign.toml"

    return write


def test_nothing_is_stated_by_default(written: Written) -> None:
    c = read(written())
    assert [(x.clock_jitter, x.model_form_scatter, x.keep_faulty) for x in c.channels] == [(None, None, False)] * 2
    assert c.base == {"hydraulics.oil.nu0": 0.02}
    assert c.accept == ()
    assert c.warnings == []


def test_keys_of_a_channel(written: Written) -> None:
    keys = 'unit = "bar"\nclock_jitter = 0.002\nmodel_form_scatter = 1.5'
    x, p = read(written('unit = "bar"', keys)).channels
    assert (p.clock_jitter, p.model_form_scatter) == (0.002, 1.5e5)
    assert (x.clock_jitter, x.model_form_scatter) == (None, None)


def test_a_factor_and_accepted_effects(written: Written) -> None:
    head = 'accept = ["valve_dead_zone", "line_minor_losses"]\n'
    c = read(written("tolerance = 0.02", "tolerance = { factor = 3 }", head=head))
    assert c.base == {"hydraulics.oil.nu0": FactorTolerance(3.0)}
    assert c.accept == ("valve_dead_zone", "line_minor_losses")


@pytest.mark.parametrize(
    ("keys", "time", "kept"),
    [
        ("", T, slice(None)),
        ('time_unit = "ms"', T * 1e3, slice(None)),
        ('time_unit = "min"', T / 60.0, slice(None)),
        ('time_unit = "ms"\nstart = 70.0', T * 1e3 + 7e4, slice(None)),
        ('start = "first"', T + 1e5, slice(None)),
        ("start = 1.0", T, slice(10, None)),
    ],
)
@pytest.mark.parametrize("of_all", [False, True])
def test_time_unit_and_start(written: Written, keys: str, time: np.ndarray, kept: slice, of_all: bool) -> None:
    path = written(head=keys + "\n", run=table(time)) if of_all else written(
        "[[run]]", f"[[run]]\n{keys}", run=table(time)
    )  # fmt: skip
    c = read(path)
    t, x = c.runs[0].series["arm.x_h"]
    assert t == pytest.approx(T[kept] - T[kept][0], abs=1e-3)
    assert x == pytest.approx(1e-3 * X[kept])
    assert c.warnings == []


def test_a_run_has_a_format_of_its_own(written: Written) -> None:
    run = table().replace(",", ";").replace(".", ",")
    keys = '[[run]]\ndelimiter = ";"\ndecimal = ","\ntime_unit = "s"'
    c = read(written("[[run]]", keys, run=run, head='delimiter = "\\t"\ntime_unit = "ms"\n'))
    t, x = c.runs[0].series["arm.x_h"]
    assert t == pytest.approx(T)
    assert x == pytest.approx(1e-3 * X)


def test_a_clock_that_jitters_may_begin_a_little_early(written: Written) -> None:
    early = T - 0.3 * (T[1] - T[0]) * (np.arange(len(T)) == 0)
    run = read(written(run=table(early))).runs[0]
    assert all(times[0] == T[1] for times, _ in run.series.values())


def test_a_clock_that_jitters_is_told(written: Written) -> None:
    """3 % of an interval, either way; and a clock of the converter's resolution is not."""
    jitter = np.random.default_rng(1).uniform(-0.003, 0.003, len(T))
    uneven = table(T + np.abs(jitter[0]) + jitter)
    (warning,) = read(written(run=uneven)).warnings
    assert "jitters" in warning
    assert "'clock_jitter'" in warning
    x = 'unit = "mm"\nclock_jitter = 0.002'
    assert len(read(written('unit = "mm"', x, run=uneven)).warnings) == 1, "not of the other channel"
    path = written('unit = "mm"', x, run=uneven)
    path.write_text(path.read_text().replace('unit = "bar"', 'unit = "bar"\nclock_jitter = 0.002'))
    assert read(path).warnings == [], "where it is stated of all there is nothing to ask for"
    assert read(written(run=table(np.round(T + 0.0004 * np.sin(T), 3)))).warnings == []


def test_faulty_readings_are_left_out_and_told(written: Written) -> None:
    x = X.copy()
    x[[40, 90]] = 400.0
    x[120:126] = 0.0
    c = read(written(run=table(x=x)))
    t, left = c.runs[0].series["arm.x_h"]
    faulty = [40, 90, *range(120, 126)]
    assert t == pytest.approx(np.delete(T, faulty))
    assert left == pytest.approx(1e-3 * np.delete(X, faulty))
    assert "8 faulty readings" in c.warnings[0]
    kept = read(written('unit = "mm"', 'unit = "mm"\nfaulty_readings = "keep"', run=table(x=x)))
    assert kept.runs[0].series["arm.x_h"][1] == pytest.approx(1e-3 * x)


WRONG = {
    "jitter": ('unit = "bar"', 'unit = "bar"\nclock_jitter = -1', "", "channel 2 ('P'): clock_jitter"),
    "scatter": ('unit = "bar"', 'unit = "bar"\nmodel_form_scatter = -1', "", "model_form_scatter = -1 bar"),
    "scatter of text": ('unit = "bar"', 'unit = "bar"\nmodel_form_scatter = "1"', "", "model_form_scatter"),
    "faulty": ('unit = "bar"', 'unit = "bar"\nfaulty_readings = "drop"', "", "neither leave_out nor keep"),
    "factor of 1": ("= 0.02", "= { factor = 1 }", "", "base 1: tolerance: factor = 1 has to be above 1"),
    "factor below 1": ("= 0.02", "= { factor = 0.3 }", "", "has to be above 1"),
    "huge factor": ("= 0.02", "= { factor = 1e9 }", "", "1000 at most"),
    "another key": ("= 0.02", "= { facter = 3 }", "", "unknown key 'facter'; did you mean 'factor'"),
    "no factor": ("= 0.02", "= {}", "", "'factor' is missing"),
    "share of 2": ("= 0.02", "= 2", "", "{ factor = 3 }"),
    "accept a string": ("", "", 'accept = "valve_dead_zone"\n', "accept"),
    "accept twice": ("", "", 'accept = ["a", "a"]\n', "accept: 'a' is there twice"),
    "accept nothing": ("", "", 'accept = [" "]\n', "accept: an effect's name is empty"),
    "delimiter": ("", "", 'delimiter = "ab"\n', "delimiter = 'ab' has to be one character"),
    "decimal": ("", "", 'decimal = ";"\n', "decimal = ';' is neither"),
    "time unit": ("", "", 'time_unit = "bar"\n', "time_unit = 'bar' is no unit of time; there are s, ms"),
    "start": ("", "", 'start = "noon"\n', "start = 'noon' is neither seconds"),
    "start after the end": ("", "", "start = 100\n", "before 'start'"),
    "a stamp for numbers": ("", "", "start = 2024-05-31T13:45:00\n", "but the file has times as numbers"),
}


@pytest.mark.parametrize("case", WRONG)
def test_one_line_for_a_wrong_key(
    written: Written, tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    old, new, head, told = WRONG[case]
    path = written(old, new, head=head)
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert str(tmp_path) in error
    assert error.strip().count("\n") == 0


@pytest.mark.parametrize(
    ("time", "key"), [(T + 1e5, "start = 100000"), (T - 5.0, "start = -5"), (T + 30.0, "start = 30")]
)
def test_time_that_starts_elsewhere_is_asked_about(written: Written, time: np.ndarray, key: str) -> None:
    with pytest.raises(CosimError, match=key):
        read(written(run=table(time)))


def test_time_that_starts_late_is_told(written: Written) -> None:
    (warning,) = read(written(run=table(T + 8.0))).warnings
    assert "time starts at 8 s" in warning
    assert read(written(run=table(T + 2.0))).warnings == []


@pytest.mark.parametrize("file", ["/dev/zero", "."])
def test_only_regular_files_are_read(written: Written, file: str) -> None:
    with pytest.raises(CosimError) as error:
        read(written('file = "run1.csv"', f'file = "{file}"'))
    assert "\n" not in str(error.value)
