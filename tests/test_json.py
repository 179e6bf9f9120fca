"""With --json every command prints one object on standard output, whether it worked or not."""

from __future__ import annotations

import argparse
import json
from importlib import import_module

import numpy as np
import pytest
from deepsea_cosim.core.console import json_text

from tests.gap.oscillator import EFFECTS, measure
from tests.toys import package


def commands():
    """(name, parser) of all commands and of what they have below them."""
    for name in ("master.cli", "master.page.command", "master.comparison.command", "master.replay_cli", "fmus.cli",
                 "gap.cli", "study.cli"):  # fmt: skip
        top = import_module(f"deepsea_cosim.{name}").parser()
        below = [a for a in top._actions if isinstance(a, argparse._SubParsersAction)]
        yield from ((f"{name} {word}", p) for a in below for word, p in a.choices.items())
        if not below:
            yield name, top


@pytest.mark.parametrize(("name", "parser"), [pytest.param(*c, id=c[0]) for c in commands()])
def test_every_command_has_it(name, parser):
    assert "--json" in parser._option_string_actions


def test_json_is_strict():
    value = {"x": np.array([1.0, np.nan]), "n": np.int64(3), "y": (float("inf"), None, True), 2: "ü"}
    assert json.loads(json_text(value)) == {"x": [1.0, None], "n": 3, "y": [None, None, True], "2": "ü"}


@pytest.fixture(scope="module")
def toy(toys, tmp_path_factory):
    import zipfile

    path = package(tmp_path_factory.mktemp("json") / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=0.5, step=4e-3)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("resources/effects.toml", EFFECTS)
    return path


@pytest.fixture
def told(capsys):
    """What a command says: calls it, checks its exit code, reads its output."""

    def of(command, *arguments, code=0):
        main = import_module(f"deepsea_cosim.{command}.cli").main
        capsys.readouterr()
        assert main([*map(str, arguments), "--json"]) == code
        return json.loads(capsys.readouterr().out)

    return of


def test_a_run_and_what_is_looked_at_of_it(toy, told, tmp_path):
    runs = [tmp_path / name for name in "ab"]
    for run, force in zip(runs, (1, 2), strict=True):
        content = told("master", toy, "--out", run, "--set", f"o.u={force}", "--no-plot", "--html")
        assert content["summary"] == json.loads((run / "summary.json").read_text())
        assert content["files"] == ["results.csv", "summary.json", "manifest.json", "results.html"]
        assert content["trust"].startswith("Trust: ")
    assert told("master", "open", runs[0], "--no-browser") == {"page": str(runs[0] / "results.html")}
    found = told("master", "compare", *runs, "--no-html", code=1)
    assert found["differs"]
    (pair,) = found["pairs"]
    assert (pair["a"], pair["b"]) == ("a", "b")
    assert {s["name"] for s in pair["signals"] if s["differs"]} >= {"o.x"}


def test_a_package(toy, built, told):
    looked = told("master", built / "deepsea_11km.ssp", "--check", "--info", "--parameters")
    assert looked["errors"] == []
    assert [(c["name"], c["fmi"]) for c in looked["system"]["components"]] == [("hydraulics", "2.0"), ("arm", "2.0")]
    assert {"from": "hydraulics.F_h", "to": "arm.F_h"} in looked["system"]["connections"]
    assert looked["parameters"]["hydraulics.depth"]["value"] == 11000
    failed = told("master", toy.with_name("foe.ssp"), code=2)
    assert failed == {"error": f"{toy.with_name('foe.ssp')}: no such file; did you mean 'toy.ssp'?", "exit_code": 2}


def test_effects_and_a_new_campaign(toy, told, tmp_path):
    effects = told("gap", "effects", toy)["effects"]
    assert [e["id"] for e in effects] == ["friction", "cubic_spring", "force_gain"]
    assert effects[0]["parameters"][0]["address"] == "o.F_c"
    table = measure(1, lambda t, x, v: 0.0)
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="time,u,x", comments="")
    made = told("gap", "new", toy, tmp_path / "run.csv", "--out", tmp_path / "c")
    assert made["campaign"] == str(tmp_path / "c" / "campaign.toml")
    assert [(c["column"], c["connector"]) for c in made["channels"]] == [("u", "o.u"), ("x", "o.x")]
    packed = told("gap", "pack", made["campaign"], "--out", tmp_path / "c.zip")
    assert packed == {"file": str(tmp_path / "c.zip"), "bytes": (tmp_path / "c.zip").stat().st_size}


def test_files_of_the_fmus(built, told, tmp_path):
    assert told("fmus", "forms", "--out", tmp_path) == {"files": [str(tmp_path / "effect_forms.py")]}
    (tmp_path / "x.fmu").write_text("nonsense")
    checked = told("fmus", "check", built / "DeepseaArm.fmu", tmp_path / "x.fmu", code=1)["problems"]
    assert checked[str(built / "DeepseaArm.fmu")] == []
    assert checked[str(tmp_path / "x.fmu")] == ["not a zip archive or damaged"]
