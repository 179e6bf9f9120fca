"""The study's measures and claims on made-up machines whose answers are known; the report in a browser."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.study import table1
from deepsea_cosim.study.cli import main
from deepsea_cosim.study.paper import arm_pictures, figures, runs
from deepsea_cosim.study.paper import claims as c
from deepsea_cosim.study.paper.cases import (
    CONSTANT,
    DEEPEST,
    DEPTHS,
    FIGURES,
    L_MIN,
    RECORD,
    SLOWER,
    T_DOWN,
    T_START,
    Case,
    all_cases,
)
from deepsea_cosim.study.paper.choices import NAMES, OURS, number, others
from deepsea_cosim.study.paper.figures import all_figures
from deepsea_cosim.study.paper.lines import Lines
from deepsea_cosim.study.paper.report import page
from deepsea_cosim.study.paper.runs import Run, Runs

from tests import browser

T = np.arange(22001) * 1e-3


def machine(case, out=5.0, back=5.0, **others):
    """Extends linearly in `out` seconds and comes back in `back`; other signals are constant."""
    goal = float(case.parameters.get("hydraulics.command.target", 0.2))
    x = goal * np.clip((T - T_START) / out, 0.0, 1.0)
    x = np.where(T > T_DOWN, x[T_DOWN == T] * np.clip(1.0 - (T - T_DOWN) / back, 0.0, 1.0), x)
    command = goal * np.interp(T, (T_START, T_START + 5.0, T_DOWN, T_DOWN + 5.0), (0.0, 1.0, 1.0, 0.0))
    signals = {"arm.x_h": x, "arm.v_h": np.gradient(x, T), "hydraulics.x_cmd": command}
    signals |= {next(name for name in RECORD if name.endswith(f".{k}")): v for k, v in others.items()}
    return Run(case, T, np.stack([np.broadcast_to(signals.get(name, 0.0), T.shape) for name in RECORD], axis=1))


def test_times_of_a_straight_motion():
    run = machine(DEEPEST, 7.0, 6.0)
    assert run.extension == pytest.approx(7.0 * 199 / 200)
    assert run.retraction == pytest.approx(6.0 * 199 / 200)
    assert not run.on_time
    assert machine(DEEPEST).on_time


def test_a_motion_that_never_arrives_is_the_later_the_more_is_missing():
    slow, slower = machine(DEEPEST, 12.0), machine(DEEPEST, 20.0)
    assert not slow.arrives
    assert machine(DEEPEST, 9.9).behind < slow.behind < slower.behind


def test_losses_are_over_the_lines_from_the_supply_to_the_return():
    run = machine(DEEPEST, Pa=9e6, P1=5e6, P2=4e6, Pb=3e6)
    assert run.losses == (4e6, 1e6)


def test_responses_are_compared_until_the_oil_tears():
    t = np.linspace(0.0, 0.2, 201)
    constant = np.where(t < 0.05, 1e6, -101e3)
    variable = np.where(t < 0.05, 1.01e6, 5e6)
    lines = Lines({(km, v): (t, variable if v else constant) for km in (0.0, 3.0) for v in (True, False)})
    assert lines.apart(0.0) == pytest.approx(0.01)
    assert lines.apart(3.0) > 1.0


def test_the_overflow_turns_flow_and_pressure_into_heat():
    assert machine(DEEPEST, Qrv=1e-4, Pp=30e6, Pt=10e6).overflow == pytest.approx(1e-4 * 20e6 * 22.0)


def test_every_run_is_made_once_and_the_base_case_serves_many_figures():
    cases = all_cases()
    assert len({case.key for case in cases}) == len(cases)
    assert Case("11 km", {"depth": 11000.0}).key == DEEPEST.key
    assert DEPTHS[11].key == DEEPEST.key
    runs = Runs({case.key: machine(case) for case in cases})
    assert [r.case.label for r in runs.of(FIGURES[14][1])] == ["10 cSt", "15 cSt", "22 cSt", "32 cSt"]


@pytest.fixture(scope="module")
def made():
    """Lines and runs in which everything is as the paper says, in round numbers."""
    depths = (0.0, 3.0, 6.0, 9.0, 11.0)
    gap = dict(zip(depths, (1.0, 1.01, 1.03, 1.05, 1.08), strict=True))
    t = np.array([0.0, 0.04, 0.1, 1.0])
    ends = {(km, v): 6.67e6 * (gap[km] if v else 1.0) for km in depths for v in (True, False)}
    ends |= {(6.0, True): 6.67e6 * 1.035}
    lines = Lines({key: (t, np.array([0.0, end, end, end])) for key, end in ends.items()})
    times = {DEEPEST.key: (7.662, 7.19), CONSTANT.key: (7.214, 6.813), DEPTHS[10].key: (6.1, 6.0), SLOWER.key: (10, 5)}
    late = {13: (5, 5, 6, None, 9), 14: (5, 6, None, 9), 15: (5, 6, None, 9), 16: (20, 12, None, 6, 5),
            17: (12, None, 6, 5.9, 5.8), 18: (9, None, 6, 5.5), 19: (5, 5.7, None, 8.43), 20: (6, 7, None, 9),
            21: (7, 7.2, 7.4, None, 8)}  # fmt: skip
    for figure, outs in late.items():
        for case, out in zip(FIGURES[figure][1], outs, strict=True):
            if out is not None:
                back = 13.0 - out if figure in (20, 21) else min(out, 9.0)
                if figure == 19 and out > 5:  # parallel to 200 mm
                    back = 7.19 * float(case.parameters["hydraulics.command.target"]) / 0.2
                times.setdefault(case.key, (out, 7.19 + 0.5 * (7.662 - out) if figure in (20, 21) else back))
    runs = {}
    for case in all_cases():
        km = case.parameters["depth"] / 1e3
        tank = 1e7 * km
        supply = tank + case.parameters["hydraulics.relief.p_crack"]
        larger = case.parameters["hydraulics.valve.q_rated"] / L_MIN - 5.0
        loss = 1.8 * min(km, 9) + 0.1 * max(km - 9, 0) + 0.05 * max(larger, 0.0)
        spool = 0.6 if case.parameters["hydraulics.command.target"] < 0.15 else 1.0 if km >= 10 else 0.1 * km
        current = abs(case.parameters["arm.current_speed"])
        run = machine(
            case, *times.get(case.key, (5.0, 5.0)), Pa=tank + loss * 1e6, P1=tank, Pp=supply, F_h=5e3, Pt=tank,
            Qrv=1e-4, P2=tank + np.where(T_START < T, loss * 1e6, 0.0), Pb=tank + np.where(T < T_DOWN, 0.0, loss * 1e6),
            x_v=np.where(T < T_DOWN, spool, -spool),
            M_hd=200.0 * current + 2.0,
        )  # fmt: skip
        runs[case.key] = run
    return lines, Runs(runs)


def by_text(found, text):
    return next(x for x in found if text in x.text)


def test_what_is_as_published_holds(made):
    lines, runs = made
    parts = (c._depths, c._cause, c._parameters, c._inputs, c._loads)
    found = [*c._lines(lines), *(claim for part in parts for claim in part(runs))]
    wrong = [x for x in found if not x.holds]
    assert [x.text for x in wrong] == []


def test_what_is_not_does_not(made):
    lines, _ = made
    flat = Lines({key: (t, np.array([0.0, 7e6, 7e6, 7e6])) for key, (t, _) in lines.made.items()})
    assert not by_text(c._lines(flat), "differ from 6 km").holds
    assert not by_text(c._lines(flat), "dynamic responses").holds
    apart = Lines(dict(lines.made) | {(3.0, True): lines.made[9.0, True]})
    assert not by_text(c._lines(apart), "dynamic responses").holds
    early = Runs({case.key: machine(case) for case in all_cases()})
    for text in ("delay from 10 km", "extension at 11 km", "40 mm/s"):
        found = [*c._depths(early), *c._cause(early)]
        assert not by_text(found, text).holds
    late = Runs({case.key: machine(case, 5.09, 5.09) for case in all_cases()})
    assert by_text(c._depths(late), "consistent with the command").holds
    late = Runs({case.key: machine(case, 5.5, 5.5, x_v=1.0) for case in all_cases()})
    claim = by_text(c._depths(late), "consistent with the command")
    assert not claim.holds
    assert "full open for 100 %" in claim.remark
    assert not by_text(c._cause(late), "the spool opens more").holds
    later = "smaller the valve", "little gain", "loss is not less", "lost by"
    for text in ("greater alpha", "longer the lines", *later):
        assert not by_text(c._parameters(early), text).holds
    assert not by_text(c._inputs(early), "no delay for 100 mm").holds
    assert not by_text(c._inputs(early), "full open where it is late").holds
    assert not by_text(c._cause(early), "pump's pressure").holds
    late = Runs({case.key: machine(case, 10.5) for case in all_cases()})
    assert not by_text(c._inputs(late), "changes more slowly").holds
    assert not by_text(c._cause(early), "retraction has the same cause").holds
    assert not by_text(c._parameters(early), "as little as 0.5 mm").holds
    deep = {k.key: 1e4 * k.parameters["depth"] for k in all_cases()}
    unbalanced = Runs({k.key: machine(k, P1=2.0 * deep[k.key], Pt=deep[k.key], M_hd=50.0) for k in all_cases()})
    assert not any(claim.holds for claim in c._loads(unbalanced))


def test_a_claim_names_every_choice_that_can_turn_it(made):
    """With machines of many kinds: where another choice gives another verdict, the claim says that it needs it."""
    lines, runs = made
    rows = [table1.Result(row, row.eq22) for row in table1.ROWS]
    early = Runs({case.key: machine(case, M_hd=50.0) for case in all_cases()})
    kinds = [runs, early]
    for out in (5.08, 5.9):
        spool = 0.995 if out < 5.1 else 0.9995
        kinds.append(Runs({
            k.key: machine(k, out + 1e-5 * k.parameters["depth"], out, x_v=np.where(T_DOWN > T, spool, -spool),
                           v_h=0.0405, M_hd=100.0 * k.parameters["arm.current_speed"] + 12.0, P1=0.02 * out * T)
            for k in all_cases()
        }))  # fmt: skip
    turned = set()
    for kind in kinds:
        ours = c.judged(rows, lines, kind, OURS)
        for name, _, choices in others(NAMES):
            for one, other in zip(ours, c.judged(rows, lines, kind, choices), strict=True):
                assert (one.where, one.text) == (other.where, other.text)
                if one.holds != other.holds:
                    assert name in one.chosen, (name, one.text)
                    turned.add(name)
    assert turned >= {"done", "late", "visible", "follows", "much"}


def test_what_is_assumed_is_told_and_with_what_else_the_verdict_turns(made):
    lines, runs = made
    rows = [table1.Result(row, row.eq22) for row in table1.ROWS]
    found = c.claims(rows, lines, runs)
    assert all(bool(x.assumed) == bool(x.chosen) for x in found)
    assert not any(x.assumed for x in found if x.where.startswith("Table 1"))
    claim = by_text(found, "no delay at 9 km")
    assert claim.assumed == ("delayed is what takes 0.1 s longer than its command; a motion is over within 1 mm of its "
                             "target")  # fmt: skip
    assert claim.otherwise == ""
    late = Runs({case.key: machine(case, 5.2, 5.2, M_hd=50.0) for case in all_cases()})
    claim = by_text(c.claims(rows, lines, late), "no delay at 9 km")
    assert not claim.holds
    assert claim.otherwise == "holds with 0.2 s instead of 0.1 s"
    assert number("full", OURS.full) == "99.9 %"
    held = [x for x in found if x.holds]
    told = f"{len(held)} of {len(found)} claims hold. {sum(bool(x.assumed) for x in held)} of the {len(held)} rest on"
    assert c.summary(found).startswith(told)


def test_misprints_are_told_and_explained():
    rows = [table1.Result(row, row.eq22) for row in table1.ROWS]
    found = [x for x in c._table(rows) if not x.holds]
    assert not next(c._table([replace(rows[0], row=replace(rows[0].row, theoretical=2.3))])).holds
    assert {(x.where, x.text) for x in found} == {
        ("Table 1, alpha 3e-8", "theoretical loss"), ("Table 1, alpha 3e-8", "simulated loss"),
        ("Table 1, D 5 mm", "theoretical loss"),
    }  # fmt: skip
    off = [table1.Result(row, row.eq22 * (1.06 if row.label == "L 5 m" else 1.0)) for row in table1.ROWS]
    assert not by_text(c._table(off), "rows without a misprint").holds
    assert "alpha 3e-8 +10.4 %, D 5 mm -10.1 %" in by_text(c._table(rows), "within 5 %").remark
    assert all("misprint" in x.remark for x in found)


def test_the_page_contains_its_pictures_and_escapes_what_it_is_told(made, tmp_path):
    figures = all_figures(*made)
    assert set(figures) == {"8", "9", *map(str, range(11, 22))}
    from deepsea_cosim.study.paper.figures import save

    save(figures["9"], tmp_path / "9.png")
    claim = c.Claim("Figure 9", "<b>bold</b>", "1", "2", False, "why")
    page(tmp_path / "p.html", "title", "lead", ["text"], [claim, replace(claim, holds=True)], {"9": tmp_path / "9.png"},
         [table1.Result(table1.ROWS[0], 2.2e6)])  # fmt: skip
    text = (tmp_path / "p.html").read_text()
    assert "&lt;b&gt;bold" in text
    assert "no*" not in text
    assert "data:image/png;base64," in text
    assert "http" not in text
    marked = replace(claim, chosen=("late",), assumed="late is <i>", otherwise="holds with 2 s")
    page(tmp_path / "m.html", "title", "lead", [], [marked], {}, [])
    text = (tmp_path / "m.html").read_text()
    assert 'class="no">no*<' in text
    assert "* assumed: late is &lt;i&gt;" in text
    assert "holds with 2 s" in text
    if browser.available:
        shown = browser.pixels(tmp_path / "p.html", tmp_path, 1600).reshape(-1, 3).astype(int)
        assert (np.abs(shown - (0, 112, 78)).max(1) < 30).any()  # the "yes" of the table
        assert (np.abs(shown - (213, 94, 0)).max(1) < 40).sum() > 50  # a curve


def test_the_command_writes_its_pages(built, made, tmp_path, monkeypatch, capsys):
    """With runs that are made up: everything but the simulation."""
    lines, runs_made = made
    monkeypatch.setattr(runs, "simulate", lambda pool, fixed=None: runs_made)
    monkeypatch.setattr("deepsea_cosim.study.paper.lines.responses", lambda: lines)
    monkeypatch.setattr(arm_pictures, "states", lambda geometry, path: path.write_bytes(b"x"))
    monkeypatch.setattr(arm_pictures, "animation", lambda geometry, run, path: path.write_bytes(b"x"))
    package = str(built / "deepsea_11km.ssp")
    assert main(["paper", "--package", package, "--out", str(tmp_path), "--processes", "1"]) == 0
    content = json.loads((tmp_path / "claims.json").read_text())
    told = capsys.readouterr().out
    hold = sum(claim["holds"] for claim in content["claims"])
    assert f"{hold} of {len(content['claims'])} claims hold" in told
    assert f"{sum(x['holds'] and bool(x['assumed']) for x in content['claims'])} of the {hold} rest on" in told
    assert "(marked *)" in (tmp_path / "report.html").read_text()
    assert len(content["as_printed"]) == len(content["claims"]) > 45
    for name in ("report.html", "as_printed.html"):
        text = (tmp_path / name).read_text()
        assert text.count("data:image/png;base64,") >= 13
        assert "Figure 21" in text
    assert (tmp_path / "figures" / "figure_08.png").stat().st_size > 5000
    monkeypatch.setattr(figures, "all_figures", lambda *_: {})  # drawing them takes half a minute
    line = ["paper", "--package", package, "--out", str(tmp_path / "again"), "--processes", "1", "--json"]
    assert main(line) == 0
    assert json.loads(capsys.readouterr().out)["claims"] == content["claims"]


def test_the_base_case_is_the_machine_that_is_shipped(built):
    from deepsea_cosim.master.simulation.session import Session
    from deepsea_cosim.study.paper.cases import BASE, RAMP

    with Session(built / "deepsea_11km.ssp") as session:
        values = session.values()
    assert {name: values[name] for name in BASE} == pytest.approx(dict(BASE))
    assert (values["hydraulics.command.t_start"], values["hydraulics.command.ramp_time"]) == (T_START, RAMP)
    assert T_START + RAMP + values["hydraulics.command.hold_time"] == T_DOWN
