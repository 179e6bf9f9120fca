"""The set of calibrations on made-up machines whose times are known formulas of the linkage."""

from __future__ import annotations

import csv
import json
from math import hypot

import numpy as np
import pytest
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.mechanics.linkage import linkage as kinematics
from deepsea_cosim.study import calibrate
from deepsea_cosim.study.calibration import buildable, machine, search
from deepsea_cosim.study.calibration.local import fit
from deepsea_cosim.study.calibration.report import Row, depending, markdown
from deepsea_cosim.study.paper.cases import T_DOWN, T_START, TARGET

FREE = np.ones(6, dtype=bool)


def test_every_point_of_the_cube_is_a_buildable_linkage():
    for u in np.random.default_rng(1).random((200, 6)):
        of = buildable.linkage(u)
        place = of.rod_eye_radius, of.base_x, of.base_y
        length, lever, *_ = kinematics.py_func(of.theta0, *place)
        assert of.length == pytest.approx(length)
        assert lever > 0.0  # to extend is to raise the beam
        assert buildable.is_buildable(of)
        np.testing.assert_allclose(buildable.point(of), u, atol=1e-6)
        assert 0.44 - 1e-9 <= length <= 0.53 + 1e-9
        assert of.rod_eye_radius + hypot(*place[1:]) - length >= 0.255 - 1e-9
        angles = np.linspace(of.theta0, of.theta0 + 3.2, 3000)
        assert max(kinematics.py_func(a, *place)[0] for a in angles) - length == pytest.approx(of.reach, abs=1e-6)


def test_the_shipped_linkage_is_in_the_cube_but_for_its_rounding():
    u = buildable.point(buildable.shipped(1000.0))
    assert (u > -1e-3).all()
    assert (u < 1.0).all()
    base_above = buildable.Linkage(1.6, 0.21, 0.4, 0.36, 0.6, 1000.0)
    assert not buildable.is_buildable(base_above)


def curved(u):
    """Four residuals [%] of six numbers, zero on a surface that goes through the middle of the cube."""
    v = u - 0.5
    return 100.0 * np.array([v[0] + v[1] ** 2, v[1] - 0.3 * v[2], v[3] + 0.5 * v[4] * v[5], v[4] + v[0]])


@pytest.mark.parametrize("seed", range(4))
def test_a_fit_ends_on_the_surface_near_its_start(seed):
    start = np.random.default_rng(seed).uniform(0.3, 0.7, 6)
    end, worst = fit(curved, start, FREE, 0.01)
    assert worst == np.abs(curved(end)).max() <= 0.01
    assert np.abs(end - start).max() < 0.45


def test_a_fit_stays_in_the_cube_holds_what_is_held_and_knows_when_nothing_comes():
    end, worst = fit(lambda u: np.array([100.0 * (u[0] + 0.2)]), np.full(6, 0.5), FREE, 0.01)
    assert end[0] == pytest.approx(0.0, abs=1e-6)
    assert worst == pytest.approx(20.0, abs=1e-3)
    held = np.array([True] * 5 + [False])
    end, worst = fit(curved, np.full(6, 0.6), held, 0.01)
    assert (end[5], worst <= 0.01) == (0.6, True)
    assert fit(lambda u: None, np.full(6, 0.5), FREE, 0.01)[1] == np.inf
    broken = fit(lambda u: curved(u) if u[0] > 0.45 else None, np.full(6, 0.65), FREE, 0.01)
    assert broken[1] < 15.0  # goes as far as there is something


class Made:
    """A session whose displacement is straight lines with the times of a formula; counts its runs."""

    runs = 0

    def run(self, record, stop, step, changes, method):
        Made.runs += 1
        if changes["arm.beam_length"] > 2.5:
            raise SimulationError("too heavy")
        t = np.arange(round(stop / 0.01) + 1) * 0.01
        heavy, lam = changes["arm.beam_length"] / 1.6 - 1.0, changes["hydraulics.valve.lam_crit"] / 1100.0 - 1.0
        variable = changes["hydraulics.line.variable_viscosity"]
        out, back = calibrate.PUBLISHED[:2] if variable else calibrate.PUBLISHED[2:]
        slower = 0.2 * lam if variable else 0.19 * lam
        whole = TARGET / (TARGET - 1e-3)  # a motion is over 1 mm before its end
        out, back = out * whole * (1.0 + slower + heavy), back * whole * (1.0 + slower - 0.3 * heavy)
        x = TARGET * np.where(t < T_DOWN, (t - T_START) / out, 1.0 - (t - T_DOWN) / back)
        return t, np.clip(x, 0.0, TARGET)[:, None]


@pytest.fixture
def made(monkeypatch, tmp_path):
    """The file of a package whose machine is made up, its claims too."""
    monkeypatch.setattr(machine, "session", lambda package: Made())
    monkeypatch.setattr(machine.Machine, "claims",
                        lambda self, of: {"a: always": True, "b: not with much": of.lam_crit < 1090})  # fmt: skip
    Made.runs = 0
    package = tmp_path / "machine.ssp"
    package.write_bytes(b"made up")
    return package


def test_the_times_are_kept_and_a_machine_that_cannot_be_run_has_none(made, tmp_path):
    of = buildable.shipped(1100.0)
    heavy = buildable.Linkage(2.6, *list(buildable.as_values(of).values())[1:])
    with machine.Machine(made, tmp_path / "out") as m:
        first = m.times(of)
        assert m.times(heavy) is None
        assert m.simulated == 3
    with machine.Machine(made, tmp_path / "out") as m:
        assert (m.times(of) == first).all()
        assert m.times(heavy) is None
        assert m.simulated == 0
        m.times(of, machine.EXACT)
        assert m.simulated == 2
    made.write_bytes(b"another")
    with machine.Machine(made, tmp_path / "out") as m:
        m.times(of)
        assert m.simulated == 2


def test_the_command_finds_the_set_and_goes_on_where_it_was_stopped(made, tmp_path, capsys, monkeypatch):
    command = ["--global", "--package", str(made), "--out", str(tmp_path / "out"), "--samples", "16", "--fits", "4"]
    tried = search.fitted
    monkeypatch.setattr(search, "fitted", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    assert calibrate.main(command) == 130
    assert "goes on" in capsys.readouterr().err
    monkeypatch.setattr(search, "fitted", tried)
    half = Made.runs
    assert calibrate.main(command) == 0
    told = capsys.readouterr().out
    whole = Made.runs
    assert whole > half > 16
    assert calibrate.main([*command, "--quiet"]) == 0
    assert Made.runs == whole
    content = json.loads((tmp_path / "out" / "calibrations.json").read_text())
    found = content["calibrations"][1:]
    assert len(found) > 3
    assert max(abs(e) for c in found for e in c["errors"].values()) <= search.WITHIN
    lam = [c["lam_crit"] for c in found]
    assert lam == sorted(lam)
    assert 1050 < lam[0] < lam[-1] < 1150  # 1 % of a time is 5 % of it
    assert list(content["depending"]) == ["b: not with much"]
    assert "b: not with much" in told
    assert "1 to 2 claims hold" in told
    with (tmp_path / "out" / "calibrations.csv").open() as file:
        assert len(list(csv.reader(file))) == len(found) + 2


def calibration(*u):
    return search.Calibration(np.array(u), buildable.linkage(np.array(u)), np.full(4, 0.1))


def test_only_what_differs_is_taken_and_the_furthest_first():
    base = (0.5,) * 5
    near, far, middle = (calibration(*base, x) for x in (0.52, 0.9, 0.7))
    first = calibration(*base, 0.5)
    taken = search.distinct([near, middle, far], [first], 9)
    assert [c.u[5] for c in taken] == [0.5, 0.9, 0.7]
    assert len(search.distinct([near, middle, far], [first], 2)) == 2


def test_the_table_says_what_depends_on_the_choice():
    c = calibration(*(0.5,) * 6)
    rows = [Row("1", c, {"x": True, "y": False}), Row("2", c, {"x": True, "y": True}), Row("3", c, None)]
    assert depending(rows) == {"y": ["2"]}
    lines = markdown(rows).splitlines()
    assert lines[2].startswith("| 1 | 1000 |")
    assert lines[3].endswith("| 2 of 2 |")
    assert lines[4].endswith("| - |")


def test_the_claims_are_judged_once(monkeypatch, tmp_path):
    package = tmp_path / "machine.ssp"
    package.write_bytes(b"made up")
    asked = []

    def study(runner, fixed):
        asked.append(fixed)
        raise SimulationError("cannot")

    monkeypatch.setattr(machine, "table", list)
    monkeypatch.setattr(machine, "responses", lambda: None)
    monkeypatch.setattr(machine.runs, "simulate", study)
    for _ in range(2):
        with machine.Machine(package, tmp_path / "out") as m:
            assert m.claims(buildable.shipped(1100.0)) is None
    assert len(asked) == 1
    assert asked[0]["hydraulics.valve.lam_crit"] == 1100.0
    assert asked[0]["arm.beam_length"] == 1.605
