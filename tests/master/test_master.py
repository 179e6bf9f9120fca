"""The master on toy FMUs whose coupling has closed-form answers, and on packages that are wrong."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError, PackageError, SimulationError, UnknownNameError, UsageError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.options import parse_change
from deepsea_cosim.master.simulation.run import Options, run

from .. import packages as xml
from ..toys import package

OSCILLATOR = ("spring.F -> mass.F", "mass.x -> spring.x", "mass.v -> spring.v")
OMEGA = 10.0


def read_csv(folder):
    with (folder / "results.csv").open() as file:
        names = next(csv.reader(file))
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    return {name: table[:, i] for i, name in enumerate(names)}


@pytest.fixture
def oscillator(toys, tmp_path):
    """A mass on a spring of angular frequency 10/s, started 1 m out: x = cos(10 t)."""
    fmus = {"spring": toys / "Spring.fmu", "mass": toys / "Mass.fmu"}
    return package(tmp_path / "osc.ssp", fmus, OSCILLATOR, {"spring.k": OMEGA**2, "mass.m": 1.0}, stop=2.0)


def growth(columns, h):
    """Numerical damping ratio from the energy's mean growth."""
    energy = 0.5 * columns["mass.v"] ** 2 + 0.5 * (columns["spring.F"] / OMEGA) ** 2
    t = columns["time"]
    keep = t > 10 * h
    slope = np.polyfit(t[keep], np.log(energy[keep]), 1)[0]
    return -slope / (2 * OMEGA)


@pytest.mark.parametrize(("method", "order"), [("gauss-seidel", 2.0), ("jacobi", 1.0)])
def test_displacement_converges_to_the_closed_form(oscillator, tmp_path, method, order):
    errors = []
    for i, h in enumerate((4e-3, 2e-3, 1e-3)):
        folder = tmp_path / str(i)
        run(oscillator, folder, Options(step=h, method=method))
        columns = read_csv(folder)
        errors.append(np.abs(columns["mass.x"] - np.cos(OMEGA * columns["time"])).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(order, abs=0.15)


def test_numerical_damping_of_both_methods(oscillator, tmp_path):
    """Gauss-Seidel of a rate-form spring is symplectic: no damping. Jacobi injects energy: ratio -omega h/2."""
    h = 2e-3
    for method, expected in (("gauss-seidel", 0.0), ("jacobi", -0.5 * OMEGA * h)):
        run(oscillator, tmp_path / method, Options(step=h, method=method, stop_time=5.0))
        assert growth(read_csv(tmp_path / method), h) == pytest.approx(expected, abs=0.1 * OMEGA * h)


def test_no_units_no_bonds(oscillator, tmp_path):
    assert run(oscillator, tmp_path / "out", Options(step=1e-2)).summary["coupling"] == []


def test_time_labels_and_rows(toys, tmp_path):
    """x of the bomb is the end of its step: the row labelled t must hold x = t, from first to last, without drift."""
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    result = run(pack, tmp_path / "out", Options(step=1e-3))
    columns = read_csv(tmp_path / "out")
    assert len(columns["time"]) == 1001
    assert columns["time"][0] == 0.0
    assert columns["time"][-1] == 1.0
    assert np.array_equal(columns["time"], np.append(np.arange(1000) * 1e-3, 1.0))
    assert columns["b.x"] == pytest.approx(columns["time"], abs=1e-15)
    assert result.summary["steps"] == 1000


def test_last_step_is_shortened(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    run(pack, tmp_path / "out", Options(step=0.3))
    columns = read_csv(tmp_path / "out")
    assert columns["time"] == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0])
    assert columns["b.x"] == pytest.approx(columns["time"])


def test_inputs_are_recorded_as_they_were_given(oscillator, tmp_path):
    """Row k holds what was held from t_k on: Gauss-Seidel hands the mass the force of t_(k+1), Jacobi that of t_k."""
    for method, shift in (("gauss-seidel", 1), ("jacobi", 0)):
        run(oscillator, tmp_path / method, Options(step=1e-2, method=method))
        c = read_csv(tmp_path / method)
        n = len(c["time"])
        assert np.array_equal(c["mass.F"][: n - 1], c["spring.F"][shift : n - 1 + shift])
        assert np.array_equal(c["spring.v"][: n - 1], c["mass.v"][: n - 1])


def test_chain_is_initialised_and_stepped_in_the_order_of_the_data(toys, tmp_path):
    """c after b after a although listed backwards: y = 2 u + 1 runs through the chain within one point in time."""
    bomb = toys / "Bomb.fmu"
    pack = package(
        tmp_path / "p.ssp",
        {"c": bomb, "b": bomb, "a": bomb},
        ("a.x -> b.u", "b.y -> c.u"),
        stop=1.0,
    )
    result = run(pack, tmp_path / "out", Options(step=0.1))
    assert result.summary["order"] == ["a", "b", "c"]
    c = read_csv(tmp_path / "out")
    assert c["c.y"] == pytest.approx(4.0 * c["time"] + 3.0)


def test_unconnected_inputs_keep_their_start_or_set_value(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=1.0)
    run(pack, tmp_path / "out", Options(step=0.1, changes=(("b.u", "1.5"),)))
    assert read_csv(tmp_path / "out")["b.y"] == pytest.approx(np.full(11, 4.0))


def test_parameters_of_the_package_and_of_the_command_line(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"}, (), {"m.x0": 3.0})
    run(pack, tmp_path / "a", Options(step=0.5))
    assert read_csv(tmp_path / "a")["m.x"][0] == 3.0
    run(pack, tmp_path / "b", Options(step=0.5, changes=(("m.x0", "4"),)))
    assert read_csv(tmp_path / "b")["m.x"][0] == 4.0


def test_bare_name_is_set_wherever_it_exists(toys, tmp_path):
    mass = toys / "Mass.fmu"
    pack = package(tmp_path / "p.ssp", {"a": mass, "b": mass, "s": toys / "Spring.fmu"})
    run(pack, tmp_path / "out", Options(step=0.5, changes=(("x0", "7"),)))
    c = read_csv(tmp_path / "out")
    assert c["a.x"][0] == c["b.x"][0] == 7.0


@pytest.mark.parametrize("how", [1, 2, 3], ids=["nan", "refused step", "exception"])
def test_what_was_recorded_is_kept_when_an_fmu_fails(toys, tmp_path, how):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=10.0)
    changes = (("b.how", str(how)), ("b.t_bomb", "5.0"))
    with pytest.raises(SimulationError) as error:
        run(pack, tmp_path / "out", Options(step=1e-3, changes=changes))
    text = str(error.value)
    assert "b" in text
    assert "t = 5" in text
    assert "\n" not in text
    c = read_csv(tmp_path / "out")
    assert c["time"][-1] == pytest.approx(5.0, abs=1e-9)  # up to the last point before the fault
    assert np.isfinite(c["b.x"]).all()
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert summary["error"] == text


def test_ctrl_c_keeps_what_was_recorded(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=1e5)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(pack), "--out", str(tmp_path / "out"), "--no-plot"]
    process = subprocess.Popen([*command, "--step", "1e-3"], stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "out" / "results.csv").exists() or (tmp_path / "out" / "results.csv").stat().st_size < 1e5:
        time.sleep(0.05)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20)
    assert process.returncode == 130
    assert error.count("\n") == 1
    assert "interrupted at t =" in error
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "interrupted"
    assert read_csv(tmp_path / "out")["time"][-1] == pytest.approx(summary["stop_time_s"], abs=2e-3)


def test_what_follows_a_loop_comes_after_it(toys, tmp_path):
    fmus = {"c": toys / "Bomb.fmu", "spring": toys / "Spring.fmu", "mass": toys / "Mass.fmu"}
    pack = package(tmp_path / "p.ssp", fmus, (*OSCILLATOR, "spring.F -> c.u"))
    assert run(pack, tmp_path / "out", Options(step=0.1)).summary["order"] == ["spring", "mass", "c"]


def test_extremes_are_those_of_all_points(oscillator, tmp_path):
    result = run(oscillator, tmp_path / "out", Options(step=1e-4))  # more points than the sample holds
    c = read_csv(tmp_path / "out")
    for i, name in enumerate(result.names):
        column = c[name]
        assert result.extremes[:, i] == pytest.approx([column[0], column.min(), column.max(), column[-1]])
    assert len(result.sample) < 6000
    assert result.sample[-1, 0] == c["time"][-1]


def test_units_of_parameter_values(built, tmp_path):
    """A value in another unit than the FMU's is converted, one of another quantity refused."""
    folder = tmp_path / "p"
    with zipfile.ZipFile(built / "deepsea_6km.ssp") as archive:
        archive.extractall(folder)
    values = folder / "resources" / "parameters.ssv"
    original = values.read_text()
    for text, outcome in (('value="6" unit="km"', 60e6), ('value="6" unit="kg"', None)):
        values.write_text(original.replace('value="6000" unit="m"', text))
        pack = tmp_path / "p.ssp"
        with zipfile.ZipFile(pack, "w") as archive:
            for path in folder.rglob("*"):
                if path.is_file():
                    archive.write(path, path.relative_to(folder))
        if outcome is None:
            with pytest.raises(CosimError, match="different quantities"):
                run(pack, tmp_path / "out", Options(stop_time=1e-3))
        else:
            run(pack, tmp_path / "out", Options(stop_time=1e-3))
            assert read_csv(tmp_path / "out")["arm.P_am"][0] == outcome


def test_full_disk_is_a_clean_end(toys, tmp_path, capsys, monkeypatch):
    """Whole rows up to the fault, one line, code 1, and the summary says how far it came."""
    import deepsea_cosim.master.results.formats.csv as module

    class Full(io.FileIO):
        def write(self, data):
            if self.tell() + len(data) > 50_000:
                super().write(data[: max(0, 50_000 - self.tell())])
                raise OSError(28, "No space left on device")
            return super().write(data)

    plain = module.Path.open

    def opened(path, *args, **kwargs):
        return Full(path, "w") if path.name == "results.csv" else plain(path, *args, **kwargs)

    monkeypatch.setattr(module.Path, "open", opened)
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, stop=100.0)
    code = main([str(pack), "--out", str(tmp_path / "out"), "--step", "1e-2", "--no-plot"])
    error = capsys.readouterr().err
    monkeypatch.undo()
    assert code == 1
    assert error.count("\n") == 1
    assert "No space left" in error
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"
    c = read_csv(tmp_path / "out")
    assert len(c["time"]) > 100
    assert np.diff(c["time"]) == pytest.approx(0.01)  # whole rows only
    assert f"it holds the rows up to t = {c['time'][-1]:g} s" in error


def test_a_failing_repetition_does_not_spoil_the_run(toys, tmp_path, capsys):
    """--check-step with an FMU that refuses half the step: the run and its plot are there, and it says what failed."""
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    out = tmp_path / "out"
    bomb = "--set", "b.how=4", "--set", "b.t_bomb=0"
    assert main([str(pack), "--out", str(out), "--step", "0.1", "--check-step", *bomb]) == 1
    told = capsys.readouterr()
    assert "the run is complete; its repetition with half the step, 0.05 s, failed: component 'b'" in told.err
    assert "greatest" in told.out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "ok"
    assert summary["step_check"]["status"] == "failed"
    assert (out / "overview.png").exists()


def test_an_fmu_that_changes_the_working_folder(toys, tmp_path, monkeypatch):
    """Everything goes to where it was said, and the caller stays where he was."""
    monkeypatch.chdir(tmp_path)
    package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    bomb = "--set", "b.how=5", "--set", "b.t_bomb=0"
    assert main(["p.ssp", "--step", "0.1", "--out", "out", "--check-step", *bomb]) == 0
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "results.csv", "summary.json", "manifest.json", "overview.png"}  # fmt: skip
    assert Path.cwd() == tmp_path


def test_a_working_folder_that_is_gone_is_told(toys, tmp_path, capsys, monkeypatch):
    pack = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"})
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert main([str(pack), "--out", "out"]) == 2
    assert "the folder this runs in does not exist any more" in capsys.readouterr().err


def test_dotted_component_names(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"g.2": toys / "Mass.fmu", "g": toys / "Mass.fmu"}, (), {"g.2.x0": 3.0})
    run(pack, tmp_path / "out", Options(step=0.5, changes=(("g.x0", "5"),)))
    c = read_csv(tmp_path / "out")
    assert c["g.2.x"][0] == 3.0
    assert c["g.x"][0] == 5.0


def test_columns_with_commas_are_quoted(toys, tmp_path):
    pack = package(tmp_path / "p.ssp", {"a,1": toys / "Mass.fmu"})
    run(pack, tmp_path / "out", Options(step=0.5))
    assert "a,1.x" in read_csv(tmp_path / "out")


def test_a_run_not_to_be_trusted_says_so(built, tmp_path, capsys):
    arguments = [str(built / "deepsea_11km.ssp"), "--out", str(tmp_path), "--no-plot", "--method", "jacobi"]
    assert main([*arguments, "--step", "0.02"]) == 0
    assert "do not trust this run" in capsys.readouterr().err
    assert any("do not trust" in w for w in json.loads((tmp_path / "summary.json").read_text())["warnings"])
    assert main([*arguments, "--step", "0.001", "--stop-time", "1"]) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["warnings"] == []


def test_a_machine_at_rest_settles_although_its_speed_is_rounding(built, tmp_path):
    """1e-17 m/s come and go with every repetition; compared with themselves they never settle."""
    run(built / "deepsea_11km.ssp", tmp_path, Options(step=8e-3, method="fixed-point", stop_time=0.5))
    assert np.abs(read_csv(tmp_path)["arm.v_h"]).max() < 1e-9


def test_passing_the_dead_centre_is_a_warning(built, tmp_path, capsys):
    arguments = [str(built / "deepsea_0km.ssp"), "--out", str(tmp_path), "--no-plot", "--step", "0.004"]
    assert main([*arguments, "--set", "command.target=0.25"]) == 0
    assert "dead centre" in capsys.readouterr().err


def test_unusual_folders(built, tmp_path):
    folder = tmp_path / "ü p%s#a?b"
    folder.mkdir()
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(built / "deepsea_0km.ssp"), "--quiet", "--no-plot"]
    command += ["--out", str(folder / "out"), "--stop-time", "0.1"]
    done = subprocess.run(command, env={**os.environ, "TMPDIR": str(folder)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not [p for p in folder.iterdir() if p.name != "out"]


@pytest.mark.parametrize("place", ["stdout", "stderr"])
def test_closed_streams_do_no_harm(toys, tmp_path, place):
    pack = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"})
    closed = {"stdout": ">&-", "stderr": "2>&-"}[place]
    line = f"'{sys.executable}' -m deepsea_cosim.master.cli '{pack}' --out '{tmp_path / 'out'}' --no-plot {closed}"
    assert subprocess.run(["sh", "-c", line], capture_output=True).returncode == 0
    assert read_csv(tmp_path / "out")["time"][-1] == 1.0


def test_same_package_twice_is_bitwise_the_same(oscillator, tmp_path):
    for name in "ab":
        run(oscillator, tmp_path / name, Options(step=1e-2))
    assert (tmp_path / "a" / "results.csv").read_bytes() == (tmp_path / "b" / "results.csv").read_bytes()


@pytest.mark.parametrize(
    ("connections", "message"),
    [
        (("nobody.x -> m.F",), "no component 'nobody'"),
        (("m.y -> m.F",), "no variable 'y'"),
        (("m.F -> m.F",), "are the same"),
        (("m.x -> m.v",), "are both outputs"),
        (("m.x -> m.F", "m.v -> m.F"), "already driven"),
    ],
)
def test_wrong_connections(toys, tmp_path, connections, message):
    pack = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"}, connections)
    with pytest.raises(PackageError, match=message):
        run(pack, tmp_path / "out")


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        (Options(step=0.0), UsageError, "positive"),
        (Options(step=float("nan")), UsageError, "positive"),
        (Options(step=9.0), UsageError, "longer than the whole run"),
        (Options(stop_time=-1.0), UsageError, "later than the start"),
        (Options(step=1e-12), UsageError, "steps"),
        (Options(method="euler"), UsageError, "unknown method"),
        (Options(changes=(("m.x00", "1"),)), UnknownNameError, "did you mean 'x0'"),
        (Options(changes=(("nope", "1"),)), UnknownNameError, "no component has"),
        (Options(changes=(("x00", "1"),)), UnknownNameError, "no component has a parameter 'x00'; did you mean 'x0'"),
        (Options(changes=(("m.x", "1"),)), UnknownNameError, "'m.x' cannot be set: its causality is 'output'"),
    ],
)
def test_wrong_options(toys, tmp_path, options, kind, message):
    pack = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"})
    with pytest.raises(kind, match=message):
        run(pack, tmp_path / "out", options)


def test_change_syntax():
    assert parse_change("a.b = 3") == ("a.b", "3")
    for text in ("a.b", "=3", "a="):
        with pytest.raises(UsageError, match="expected component"):
            parse_change(text)


def without_solution(path, bomb):
    """y = 2 u + 1 and u = y / 2: a loop that no number satisfies."""
    parts = [
        xml.component(n, "resources/Bomb.fmu", xml.connector("u", "input"), xml.connector("y", "output")) for n in "ab"
    ]
    half = '<ssc:LinearTransformation factor="0.5"/>'
    root = xml.system("root", *parts, links=(xml.link("a.y", "b.u", half), xml.link("b.y", "a.u", half)))
    return xml.package(path, root, {"resources/Bomb.fmu": bomb})


def test_algebraic_loop_at_the_start_that_has_no_solution(toys, tmp_path):
    with pytest.raises(
        SimulationError, match=r"algebraic loop .* does not settle .* Newton's method finds no solution"
    ):
        run(without_solution(tmp_path / "p.ssp", toys / "Bomb.fmu"), tmp_path / "out")


def test_algebraic_loop_at_the_start_that_sweeps_would_not_find(toys, tmp_path):
    """a = 2 b + 1 and b = 2 a + 1: sweeping runs away, but a = b = -1 does it."""
    bomb = toys / "Bomb.fmu"
    pack = package(tmp_path / "p.ssp", {"a": bomb, "b": bomb}, ("a.y -> b.u", "b.y -> a.u"), step=0.5)
    run(pack, tmp_path / "out", Options(stop_time=0.5))
    columns = read_csv(tmp_path / "out")
    assert [columns["a.y"][0], columns["b.y"][0]] == pytest.approx([-1.0, -1.0])


# the command line


def one_line(capsys, expected_code, arguments):
    code = main([str(a) for a in arguments])
    error = capsys.readouterr().err
    assert code == expected_code
    assert error.count("\n") == 1
    assert error.startswith("cosim-master: ")
    return error


def test_command_line_errors_are_one_line(toys, tmp_path, capsys):
    good = package(tmp_path / "good.ssp", {"m": toys / "Mass.fmu"})
    (tmp_path / "no.ssp").write_text("this is no zip")
    (tmp_path / "cut.ssp").write_bytes(good.read_bytes()[:-200])
    with zipfile.ZipFile(tmp_path / "hole.ssp", "w") as hole, zipfile.ZipFile(good) as whole:
        hole.writestr("SystemStructure.ssd", whole.read("SystemStructure.ssd"))
    out = ("--out", tmp_path / "out", "--no-plot")
    assert "not a zip archive" in one_line(capsys, 2, [tmp_path / "no.ssp", *out])
    assert "not a zip archive" in one_line(capsys, 2, [tmp_path / "cut.ssp", *out])
    assert "no such file" in one_line(capsys, 2, [tmp_path / "missing.ssp", *out])
    assert "missing in the package" in one_line(capsys, 2, [tmp_path / "hole.ssp", *out])
    for wrong in (r"resources\Mass.fmu", "resources/mass.fmu", "Mass.fmu"):
        with zipfile.ZipFile(tmp_path / "near.ssp", "w") as near, zipfile.ZipFile(good) as whole:
            text = whole.read("SystemStructure.ssd").decode().replace('"resources/Mass.fmu"', f'"{wrong}"')
            near.writestr("SystemStructure.ssd", text)
            near.writestr("resources/Mass.fmu", whole.read("resources/Mass.fmu"))
        assert "did you mean 'resources/Mass.fmu'?" in one_line(capsys, 2, [tmp_path / "near.ssp", *out])
    with zipfile.ZipFile(good) as whole:
        whole.extractall(tmp_path / "unpacked")
    (tmp_path / "unpacked" / "resources" / "Mass.fmu").unlink()
    for given in (tmp_path / "unpacked", tmp_path / "unpacked" / "SystemStructure.ssd"):
        assert "missing in the package" in one_line(capsys, 2, [given, *out])
    assert "SystemStructure.ssd is missing" in one_line(capsys, 2, [tmp_path / "unpacked" / "resources", *out])
    assert "x9" in one_line(capsys, 2, [good, "--set", "m.x9=1", *out])
    assert "not a number" in one_line(capsys, 2, [good, "--set", "m.x0=one", *out])
    assert "positive" in one_line(capsys, 2, [good, "--step", "0", *out])
    assert "cannot be written" in one_line(capsys, 2, [good, "--out", tmp_path / "no.ssp", "--no-plot"])
    assert not (tmp_path / "out").exists()


def test_command_line_run(toys, tmp_path, capsys):
    pack = package(tmp_path / "osc.ssp", {"m": toys / "Mass.fmu"})
    assert main([str(pack), "--out", str(tmp_path / "out"), "--step", "0.01"]) == 0
    shown = capsys.readouterr().out
    for name in ("results.csv", "summary.json", "overview.png"):
        assert name in shown
        assert (tmp_path / "out" / name).stat().st_size > 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    for key in ("step_s", "method", "wall_time_s", "real_time_factor", "fmu_time_s", "coupling", "versions"):
        assert key in summary
    assert main([str(pack), "--out", str(tmp_path / "q"), "--no-plot", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_help_names_every_option(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    for option in ("--out", "--step", "--stop-time", "--set", "--method", "--quiet", "--check", "--info", "--variant",
                   "--stimuli", "--record", "--results", "--isolate", "--check-step", "examples"):  # fmt: skip
        assert option in text
