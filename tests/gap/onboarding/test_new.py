"""A campaign from a package and files: what is guessed is right, what is not is asked, nothing is overwritten."""

import sys
import tomllib

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.cli import main

USUAL = [(0, 1.0), (1, 1.0), (2, 1e3)]
"""Time in s, force in N, position in mm."""


def new(package, files, out, *more):
    return main(["new", str(package), *map(str, files), "--out", str(out), *more])


def campaign(out):
    return tomllib.loads((out / "campaign.toml").read_text(encoding="utf-8"))


def by_column(data):
    return {c["column"]: c for c in data["channel"]}


def same_readings(path, rig, run=0):
    """Whether the first run of a campaign has the readings of the rig's, in SI on the model's clock."""
    series = read(path).runs[0].series
    t, x = next(s for c, s in series.items() if c.endswith("x"))
    expected = np.interp(t, rig.runs[run][:, 0], rig.runs[run][:, 2])
    return np.allclose(x, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("head", "columns", "options"),
    [
        ("time,u,x_mm", USUAL, {}),
        ("time [s],u [N],x [mm]", USUAL, {}),
        ("Time [ms];Force [N];Position [mm]", [(0, 1e3), (1, 1.0), (2, 1e3)], {"delimiter": ";", "decimal": ","}),
        ("time\tu\tx\ns\tN\tmm", USUAL, {"delimiter": "\t"}),
        ("Weg [mm];Kraft [N];Zeit [s]", [(2, 1e3), (1, 1.0), (0, 1.0)],
         {"delimiter": ";", "decimal": ",", "encoding": "cp1252", "above": "Prüfstand 3\nAm 1. Mai\n\n"}),
        ("t x_mm u", [(0, 1.0), (2, 1e3), (1, 1.0)], {"delimiter": " "}),
        ("time,u,x_mm", USUAL, {"encoding": "utf-16"}),
    ],
)  # fmt: skip
def test_ways_to_write_a_run(rig, written, tmp_path, head, columns, options):
    file = written("run.csv", head, columns, **options)
    assert new(rig.packed, [file], tmp_path / "out", "--quiet") == 0
    data = campaign(tmp_path / "out")
    channels = {c["connector"]: c for c in data["channel"]}
    assert set(channels) == {"o.u", "o.x"}
    assert channels["o.u"]["role"] == "input"
    assert channels["o.x"]["unit"] == "mm"
    assert same_readings(tmp_path / "out" / "campaign.toml", rig)


def test_a_clock_in_ms_without_a_word_of_it(rig, written, tmp_path, capsys):
    file = written("run.csv", "time,u,x_mm", [(0, 1e3), (1, 1.0), (2, 1e3)])
    assert new(rig.packed, [file], tmp_path / "out") == 0
    assert campaign(tmp_path / "out")["run"][0]["time_unit"] == "ms"
    assert "is time in ms?" in capsys.readouterr().out
    assert same_readings(tmp_path / "out" / "campaign.toml", rig)


def test_a_date_and_a_clock_time(rig, written, tmp_path, capsys):
    file = written("run.csv", "Force [N];x [mm]", [(1, 1.0), (2, 1e3)], delimiter=";", decimal=",")
    head, *rows = file.read_text().splitlines()
    stamps = (f"01.02.2024;12:59:{k // 50 + 45:02d},{k % 50 * 20:03d}" for k in range(len(rows)))
    lines = [f"Datum;Uhrzeit;{head}", *(f"{stamp};{row}" for stamp, row in zip(stamps, rows, strict=True))]
    file.write_text("\n".join(lines) + "\n")
    assert new(rig.packed, [file], tmp_path / "out") == 0
    assert "12:59:45,000, is taken as 0 s" in capsys.readouterr().out
    assert same_readings(tmp_path / "out" / "campaign.toml", rig)


def test_a_clock_that_starts_late(rig, written, tmp_path):
    file = written("run.csv", "time,u,x_mm", USUAL, change=lambda table: table + np.array([100.0, 0.0, 0.0]))
    assert new(rig.packed, [file], tmp_path / "out", "--quiet") == 0
    assert campaign(tmp_path / "out")["run"][0]["start"] == "first"
    assert same_readings(tmp_path / "out" / "campaign.toml", rig)


def test_names_that_say_nothing_are_told_by_the_model(rig, written, tmp_path, capsys):
    file = written("run.csv", "time,ch1,ch2", [(0, 1.0), (2, 1.0), (1, 1.0)])
    assert new(rig.packed, [file], tmp_path / "out") == 0
    channels = by_column(campaign(tmp_path / "out"))
    assert (channels["ch2"]["connector"], channels["ch2"]["role"]) == ("o.u", "input")
    assert channels["ch1"]["connector"] == "o.x"
    assert "is it o.x? Its name does not say so" in capsys.readouterr().out


def test_without_times(rig, written, tmp_path, capsys):
    file = written("run.csv", "u,x_mm", [(1, 1.0), (2, 1e3)])
    assert new(rig.packed, [file], tmp_path / "a") == 0
    assert "how far are its readings apart?" in capsys.readouterr().out  # as long as the scenario
    assert same_readings(tmp_path / "a" / "campaign.toml", rig)
    assert new(rig.packed, [file], tmp_path / "b", "--rate", "50") == 0
    assert "apart?" not in capsys.readouterr().out
    assert same_readings(tmp_path / "b" / "campaign.toml", rig)


def test_conditions_in_names_and_columns(rig, written, tmp_path, capsys):
    more = [*USUAL, (0, 0.0)]
    first = written("run_m=2.5.csv", "time,u,x_mm,k", more)
    text = first.read_text().replace(",0\n", ",85\n")
    first.write_text(text)
    second = written("run_3bar.csv", "time,u,x_mm,k", more, run=1)
    second.write_text(second.read_text().replace(",0\n", ",80\n"))
    assert new(rig.packed, [first, second], tmp_path / "out") == 0
    runs = campaign(tmp_path / "out")["run"]
    assert runs[0]["parameters"] == {"o.m": 2.5, "o.k": 85.0}
    assert runs[1]["parameters"] == {"o.k": 80.0}
    assert "'3bar' in the file's name: which parameter" in capsys.readouterr().out


def test_what_is_kept_to_test_the_others(rig, written, tmp_path):
    files = [written("a.csv", "time,u,x_mm", USUAL), written("a_validation.csv", "time,u,x_mm", USUAL, run=1)]
    assert new(rig.packed, files, tmp_path / "out", "--quiet") == 0
    assert [r.get("use") for r in campaign(tmp_path / "out")["run"]] == [None, "holdout"]


def test_runs_side_by_side(rig, tmp_path):
    a, b = rig.runs
    table = np.column_stack([a[:, 1], b[:, 1], 1e3 * a[:, 2], 1e3 * b[:, 2]])
    file = tmp_path / "both.csv"
    np.savetxt(file, table, "%.6g", ",", header="uEst,uVal,xEst,xVal,Ts", comments="", footer="")
    lines = file.read_text().splitlines()
    file.write_text("\n".join([lines[0] + ",", lines[1] + ",0.02,", *(x + ",," for x in lines[2:])]) + "\n")
    assert new(rig.packed, [file], tmp_path / "out", "--quiet") == 0
    made = read(tmp_path / "out" / "campaign.toml")
    assert [(r.name, r.use, round(r.stop, 6)) for r in made.runs] == [
        ("both_Est", None, 12.0), ("both_Val", "holdout", 12.0),
    ]  # fmt: skip


def test_a_column_that_is_nothing_is_asked_about(rig, written, tmp_path, capsys):
    def with_noise(table):
        rng = np.random.default_rng(0)
        return np.column_stack([table, rng.normal(size=len(table))])

    file = written("run.csv", "time,u,x_mm,oil_temp [degC]", [*USUAL, (3, 1.0)], change=with_noise)
    assert new(rig.packed, [file], tmp_path / "out") == 0
    assert "column 'oil_temp [degC]'" in capsys.readouterr().out
    assert '# column = "oil_temp [degC]"' in (tmp_path / "out" / "campaign.toml").read_text()
    assert set(by_column(campaign(tmp_path / "out"))) == {"u", "x_mm"}


def test_nothing_is_overwritten(rig, written, tmp_path, capsys):
    file, out = written("run.csv", "time,u,x_mm", USUAL), tmp_path / "out"
    out.mkdir()
    (out / "campaign.toml").write_text("mine\n")
    assert new(rig.packed, [file], out) == 2
    error = capsys.readouterr().err
    assert "is there already" in error
    assert error.count("\n") == 1
    assert (out / "campaign.toml").read_text() == "mine\n"
    assert new(rig.packed, [tmp_path / "none.csv"], out, "--force") == 2  # and not before the new one is complete
    assert (out / "campaign.toml").read_text() == "mine\n"
    assert new(rig.packed, [file], out, "--force", "--quiet") == 0
    assert same_readings(out / "campaign.toml", rig)
    assert not list(out.rglob("*.part"))


def test_a_package_without_a_catalogue_gets_one(rig, written, tmp_path, capsys):
    file = written("run.csv", "time,u,x_mm", USUAL)
    assert new(rig.plain, [file], tmp_path / "out") == 0
    assert "which parameters are effects" in capsys.readouterr().out
    text = (tmp_path / "out" / "effects.toml").read_text()
    assert '# address = "o.F_c"' in text
    assert campaign(tmp_path / "out")["effects"] == "effects.toml"
    assert '# parameter = "o.k"' in (tmp_path / "out" / "campaign.toml").read_text()
    assert new(rig.plain, [file], tmp_path / "sure", "--tolerance", "0.1", "--quiet") == 0
    assert {"parameter": "o.k", "tolerance": 0.1} in campaign(tmp_path / "sure")["base"]


def test_an_fmu_alone(toys, written, rig, tmp_path):
    file = written("run.csv", "time,u,x_mm", USUAL)
    assert new(toys / "Oscillator.fmu", [file], tmp_path / "out", "--quiet") == 0
    assert [c["connector"] for c in campaign(tmp_path / "out")["channel"]] == ["u", "Oscillator.x"]
    assert same_readings(tmp_path / "out" / "campaign.toml", rig)


def test_asks_on_a_terminal_only(rig, written, tmp_path, monkeypatch):
    file = written("run.csv", "time,u,x_mm,w", [*USUAL, (2, 0.0)], change=lambda t: t)
    file.write_text("\n".join(line + (f".{k}" if k else "") for k, line in enumerate(file.read_text().splitlines())))

    def never(question):
        raise AssertionError(question)

    monkeypatch.setattr("builtins.input", never)
    assert new(rig.plain, [file], tmp_path / "a", "--ask", "--quiet") == 0
    answers = iter(["nothing", "o.v", "mm/s", "0.04"])
    monkeypatch.setattr("builtins.input", lambda question: next(answers, ""))
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    assert new(rig.plain, [file], tmp_path / "b", "--ask", "--quiet") == 0
    data = campaign(tmp_path / "b")
    assert by_column(data)["w"]["connector"] == "o.v"
    assert by_column(data)["w"]["unit"] == "mm/s"
    assert data["base"] == [{"parameter": "o.m", "tolerance": 0.04}]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.csv", b""),
        ("picture.csv", b"\x89PNG\r\n\x1a\n\0\0\0"),
        ("table.xlsx", b"PK\x03\x04"),
        ("few.csv", b"time,x\n0,1\n"),
    ],
)
def test_a_file_that_is_no_run_is_told_in_a_line(rig, tmp_path, capsys, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    assert new(rig.packed, [path], tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert name in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out" / "campaign.toml").exists()


def test_a_time_in_ms_in_a_file_that_is_copied(rig, written, tmp_path):
    """Remarks above the head are not for the readers, so the run is written anew, with its times as they were."""
    file = written("run.csv", "t;u;x_mm", [(0, 1e3), (1, 1.0), (2, 1e3)], delimiter=";", above="Rig 7\nOperator B\n\n")
    assert new(rig.packed, [file], tmp_path / "out", "--quiet") == 0
    (run,) = read(tmp_path / "out" / "campaign.toml").runs
    assert run.stop == pytest.approx(12.0, abs=0.1)
