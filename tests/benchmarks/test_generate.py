"""Blind cases: reproducible, readable by the diagnosis, in the mix and with the sizes that were asked for."""

import json
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim import ssp
from deepsea_cosim.gap.campaign.read import read

from benchmarks.blind import effect_forms
from benchmarks.blind.case import BASE
from benchmarks.blind.draw import COUNT, KINDS_OF_CASE, draw, plan
from benchmarks.blind.effects import CATALOGUE, SENSORS, alike, known, unknown
from benchmarks.blind.generate import write_again, write_case
from benchmarks.blind.measure import KINDS, Channel, ideal, lagged, measured
from benchmarks.blind.records import load
from benchmarks.blind.ruler import Ruler
from benchmarks.blind.system import KEYS

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

SHIPPED = tomllib.loads((Path(ssp.__file__).parent / "scenarios" / "deepsea" / "effects.toml").read_text())
RECORDS = Path(effect_forms.__file__).parent / "records"
SINGLE, NONE, PAIR, UNKNOWN_CASE, CLEAR = 2, 3, 10, 13, 112
"""Small cases of seed 1, by kind, and one of a single effect that is as large as was wanted."""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    path = tmp_path_factory.mktemp("package") / "deepsea.ssp"
    path.write_bytes(b"")
    return path


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("index", [SINGLE, NONE, PAIR, UNKNOWN_CASE])
def test_a_case_is_reproducible_and_readable(index, package, tmp_path):
    answer = write_case(1, index, tmp_path / "a", package, refit=False, edition=1)
    if index == PAIR:
        write_case(1, index, tmp_path / "b", package, refit=False, edition=1)
        assert contents(tmp_path / "a") == contents(tmp_path / "b")
        write_again(answer, tmp_path / "c", package)
        assert contents(tmp_path / "a") == contents(tmp_path / "c")
    folder = tmp_path / "a" / f"case_{index:04d}"
    campaign = read(folder / "campaign.toml")
    assert not campaign.warnings
    assert campaign.outputs[0].connector == "arm.x_h"
    assert len(campaign.runs) == len(answer["runs"])
    assert all("depth" in run.parameters for run in campaign.runs)
    known = " ".join(p.read_text() for p in folder.glob("*.toml"))
    assert not any(e["id"] in known for e in answer["effects"])
    assert (len(campaign.base) > 0) == (answer["tolerance"] == 0.1)
    sealed = json.loads((tmp_path / "a" / "answers" / f"case_{index:04d}.json").read_text())
    assert sealed == answer
    assert all(e["size"] >= 0.27 for e in answer["effects"])
    assert [c.noise_std is not None for c in campaign.outputs] == [answer["noise_stated"]] * len(campaign.outputs)


@pytest.mark.parametrize("edition", list(KINDS_OF_CASE))
def test_plans_have_the_mix_that_was_asked_for(edition):
    cases = [plan(5, k, edition)[0] for k in range(400)]
    kinds = Counter(c.kind for c in cases)
    assert sum(KINDS_OF_CASE[edition].values()) == pytest.approx(1.0)
    assert kinds.keys() <= COUNT.keys()
    for kind, share in KINDS_OF_CASE[edition].items():
        assert kinds[kind] == pytest.approx(400 * share, abs=3.5 * np.sqrt(400 * share * (1.0 - share)))
    assert sum(len(c.channels) <= 2 for c in cases) == pytest.approx(100, abs=30)
    assert all(c.channels[0].kind.key == "x_h" and len(c.channels) not in (3,) for c in cases)
    assert sum(c.tolerance == 0.05 for c in cases) == pytest.approx(280, abs=35)
    assert sum(c.noise_stated for c in cases) == pytest.approx(200, abs=40)
    for c in cases:
        assert all(abs(f - 1.0) <= c.tolerance for f in c.factors.values())
        for run in c.runs:
            assert 18.0 <= run.stop <= 24.0
            assert run.t_start + 2 * run.ramp_time + run.hold_time < run.stop
            assert 0.0 <= run.depth <= 11000.0


@pytest.mark.parametrize("index", [28, 25])
def test_the_first_edition_still_gives_the_recorded_cases(index):
    """Those of a record, whose numbers are rounded; a single effect with a value of the library's."""
    recorded = next(r for r in load(RECORDS / "seed-20261126.jsonl") if r.answer["case"] == index).answer
    case = draw(recorded["seed"], index, refit=False, edition=1)
    assert [w.effect.id for w in case.wrong] == [e["id"] for e in recorded["effects"]]
    for w, e in zip(case.wrong, recorded["effects"], strict=True):
        assert w.form is None
        assert w.effect.library(w.plant) == pytest.approx(e["library"], rel=1e-4)


def test_effects_of_the_second_edition_come_in_other_forms():
    rng = np.random.default_rng(3)
    pool = (*CATALOGUE, *SENSORS)
    drawn = [effect_forms.draw(rng, e, e.draw_sign(rng)) for e in pool for _ in range(40)]
    assert sum(form is not None for form in drawn) / len(drawn) == pytest.approx(1.0 / 3.0, abs=0.05)


def test_size_is_the_one_wanted():
    case = draw(1, CLEAR, edition=1)
    (w,) = case.wrong
    assert 0.27 <= w.size_linear <= 33.0
    assert w.size_linear == pytest.approx(w.wanted, rel=0.15)
    assert Ruler(case).sizes(case.wrong)[0] == pytest.approx(w.size_linear, rel=1e-6)
    assert w.size > 0.27


def test_size_is_what_ridge_regression_leaves():
    columns = np.array([[1e6], [0.0]])
    assert Ruler.beyond(np.array([3.0, 4.0]), columns) == pytest.approx(4.0 / np.sqrt(2.0))
    assert Ruler.beyond(np.array([3.0, 4.0]), 0.0 * columns) == pytest.approx(5.0 / np.sqrt(2.0))


def test_names_are_those_of_the_shipped_catalogue():
    groups = {e["id"]: e["group"] for e in SHIPPED["effect"]}
    groups |= {s["id"]: s["group"] for s in SHIPPED["sensor"]}
    assert {e.id: e.group for e in known(3)} == groups  # the plant has an equation of its own for every row
    assert {e.id: groups.get(e.id) for e in known(2)} == {e.id: e.group for e in known(2)}
    assert not {e.id for e in unknown(3)} & {*groups}
    assert list(BASE) == [b["parameter"] for b in SHIPPED["base"]]
    bounds = {p["address"]: p["bounds"] for e in SHIPPED["effect"] for p in e["parameter"]}
    for e in known(3):
        for address in [e.address, *e.also.values()]:
            assert address is None or address in bounds
        if e.address:
            for sign in (1.0, -1.0):
                value = e.convert(e.plant(sign, e.most(sign), {})[e.knob])
                assert bounds[e.address][0] <= value <= bounds[e.address][1], e.id


def test_the_third_edition_counts_what_the_catalogue_has_learnt_as_known():
    """Only effects that are not in it are unknown there, and the cases of the second stay what they were."""
    assert alike("valve_hysteresis", 3) == [
        "silt_lock", "valve_dead_zone", "valve_hysteresis", "valve_null_shift",
    ]  # fmt: skip
    assert alike("valve_dead_zone") == ["valve_dead_zone", "valve_null_shift"]
    assert {"local_scoring", "gas_pocket", "sensor_wave"} < {e.id for e in unknown(3)} < {"sensor_wave"} | {
        e.id for e in unknown(2)
    }
    third = draw(5, 1, refit=False, edition=3)
    assert third.edition == 3
    assert all(w.size_linear > 0.0 for w in third.wrong)


def test_alike():
    assert alike("buoyancy_error") == ["buoyancy_error", "payload_error"]
    assert "sensor_delay" in alike("command_delay")
    assert "viscosity_law" in alike("oil_temperature")


def test_readings():
    grid = np.arange(0.0, 2.0, 1e-3)
    signals = np.zeros((grid.size, len(KEYS)))
    signals[:, 0] = 0.1 * grid
    at = np.array([0.5, 1.0])
    channel = Channel(KINDS[0], 1e-4, 0.0, {"scale": 2.0, "bias": 0.01, "delay": 0.1, "lag": 0.05})
    assert ideal(channel, grid, signals, at, 0.01) == pytest.approx(2 * 0.1 * (at - 0.16) + 0.01, abs=1e-5)
    assert lagged(grid, np.where(grid > 0.0, 1.0, 0.0), 0.1)[1000] == pytest.approx(1.0 - np.exp(-10.0), abs=1e-3)
    y = measured(Channel(KINDS[0], 1e-4, 0.002), np.full(20000, 0.1), np.random.default_rng(0))
    assert np.isnan(y).mean() == pytest.approx(0.01, abs=0.003)
    assert np.nanmean(y) == pytest.approx(0.102, abs=1e-5)
    assert np.nanstd(y) == pytest.approx(Channel(KINDS[0], 1e-4, 0.0).std, rel=0.03)
    steps = y[np.isfinite(y)] / Channel(KINDS[0], 1e-4, 0.0).step
    assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_a_drift_is_what_it_is_after_20_seconds_and_a_bow_bends_half_a_wave():
    grid = np.arange(0.0, 30.0, 1e-3)
    signals = np.zeros((grid.size, len(KEYS)))
    signals[:, 0] = 0.01 * grid
    at = np.array([0.0, 20.0])
    drifting = Channel(KINDS[0], 1e-4, 0.0, {"drift": 0.003, "drift_time": 15.0})
    assert ideal(drifting, grid, signals, at) == pytest.approx([0.0, 0.2 + 0.003])
    bent = Channel(KINDS[0], 1e-4, 0.0, {"bow": 0.002, "bow_span": 0.2, "bow_phase": 0.0})
    assert ideal(bent, grid, signals, np.array([0.0, 10.0, 20.0])) == pytest.approx([0.0, 0.1 + 0.002, 0.2])
