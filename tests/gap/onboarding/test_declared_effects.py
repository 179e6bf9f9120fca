"""A catalogue of what FMUs say of their own effects; the example goes from a script and CSV files to a campaign."""

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from deepsea_cosim.fmus.cli import main as fmus
from deepsea_cosim.gap.campaign.campaign import CampaignError
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load, parse
from deepsea_cosim.gap.cli import main
from deepsea_cosim.gap.onboarding.check import check
from deepsea_cosim.gap.onboarding.declared_effects import catalogue, rows
from deepsea_cosim.gap.onboarding.model import Parameter

EXAMPLE = Path(__file__).parents[3] / "examples" / "first_diagnosis"
SAID = {"id": "rub", "text": 'it "rubs"', "group": "friction", "neutral": 0.0, "bounds": [0.0, 6.0], "prior": 0.3}


def test_rows_of_what_is_declared():
    parameters = [
        Parameter("a.F", 0.0, "N", f"friction [N] @effect {json.dumps(SAID)}"),
        Parameter("b.F", 0.0, "N", f"friction [N] @effect {json.dumps(SAID)}"),
        Parameter("a.m", 2.0, "kg", "mass"),
    ]
    made = parse(catalogue(parameters, 0.02))
    assert [(e.id, e.text, e.parameters[0].address) for e in made.effects] == [
        ("rub", 'it "rubs"', "a.F"), ("b_rub", 'it "rubs"', "b.F"),
    ]  # fmt: skip
    assert made.sensors[-1].prior == pytest.approx(0.03)
    assert not rows(parameters[2:])
    assert not parse(catalogue(parameters[2:], 0.02)).effects


@pytest.mark.parametrize("text", ["{", "[]", '{"id": "x"}'])
def test_what_is_declared_wrongly_is_told(text):
    with pytest.raises(CampaignError, match=r"^a\.F: "):
        rows([Parameter("a.F", 0.0, "N", f"friction @effect {text}")])


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The example's folder after the page's commands up to `new`."""
    folder = tmp_path_factory.mktemp("first")
    for path in EXAMPLE.glob("*.py"):
        shutil.copy(path, folder)
    subprocess.run([sys.executable, "measure.py"], cwd=folder, check=True, capture_output=True)
    assert fmus(["forms", "--out", str(folder)]) == 0
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slide.py", "effect_forms.py", "-d", "."]
    subprocess.run(build, cwd=folder, check=True, capture_output=True)
    files = [str(p) for p in sorted((folder / "data").glob("*.csv"))]
    command = ["new", str(folder / "Slide.fmu"), *files, "--out", str(folder / "campaign"), "--tolerance", "0.05"]
    assert main([*command, "--quiet"]) == 0
    return folder


def test_the_example_needs_no_hand(example):
    text = (example / "campaign" / "campaign.toml").read_text()
    assert "\n# ?" not in text
    data = tomllib.loads(text)
    assert [(c["connector"], c["unit"]) for c in data["channel"]] == [("force", "N"), ("Slide.position", "mm")]
    assert [r["parameters"] for r in data["run"]] == [{"Slide.payload": float(k)} for k in range(3)]
    effects = load(example / "campaign" / "effects.toml").effects
    assert [e.id for e in effects] == ["rub_coulomb", "rub_stribeck", "slack", "late"]
    assert not check(read(example / "campaign" / "campaign.toml")).findings


def test_rows_of_a_package(example, capsys):
    assert main(["effects", str(example / "Slide.fmu"), "--rows"]) == 0
    assert [e.id for e in parse(capsys.readouterr().out).effects] == ["rub_coulomb", "rub_stribeck", "slack", "late"]


def test_a_sensor_in_volts_gets_a_scale(example, tmp_path):
    file = example / "data" / "slide_payload=0kg.csv"
    lines = file.read_text().splitlines()
    rows = [[float(x) for x in line.split(",")] for line in lines[1:]]
    text = "\n".join(["Time [ms],Force [N],Laser [V]", *(f"{t},{f},{x / 50.0 + 5.0}" for t, f, x in rows)])
    (tmp_path / "run.csv").write_text(text + "\n")
    command = ["new", str(example / "Slide.fmu"), str(tmp_path / "run.csv"), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(command) == 0
    laser = next(c for c in tomllib.loads((tmp_path / "out" / "campaign.toml").read_text())["channel"] if "scale" in c)
    assert (laser["column"], laser["connector"], laser["unit"]) == ("Laser [V]", "Slide.position", "m")
    assert laser["scale"] == pytest.approx(0.05, rel=0.4)  # as far as the model is right; the campaign asks
