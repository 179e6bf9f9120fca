"""`new` on measured data: what it guesses of them. Needs the data in ../shared/data; skips without."""

import gzip
import tomllib
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.gap.cli import main

from benchmarks.real.package import build_fmu

DATA = Path(__file__).parents[4] / "shared" / "data"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the measured data are not here")


def new(name, files, folder, *more):
    """The campaign that `new` writes for a benchmark's FMU."""
    fmu = build_fmu(name, folder)
    assert main(["new", str(fmu), *map(str, files), "--out", str(folder / "out"), "--quiet", *more]) == 0
    data = tomllib.loads((folder / "out" / "campaign.toml").read_text())
    return data, {c["column"]: c for c in data["channel"]}


def test_cascaded_tanks(tmp_path):
    data, channels = new("cascaded_tanks", [DATA / "cascaded_tanks.csv"], tmp_path)
    assert (channels["u"]["connector"], channels["u"]["role"]) == ("u", "input")
    assert channels["y"]["connector"] == "CascadedTanks.y"
    assert [r.get("use") for r in data["run"]] == [None, "holdout"]


def test_silverbox(tmp_path):
    file = tmp_path / "start.csv.gz"  # the rest is more of the same, and takes long to read
    with gzip.open(DATA / "silverbox_SNLS80mV.csv.gz", "rt") as source, gzip.open(file, "wt") as target:
        target.writelines(islice(source, 8000))
    _, channels = new("silverbox", [file], tmp_path, "--rate", "610.35")
    assert (channels["V1"]["connector"], channels["V2"]["connector"]) == ("u", "Silverbox.y")


def test_servo_cylinder(tmp_path):
    files = []
    with np.load(DATA / "servo_cylinder_16x10_1kHz.npz") as data:
        for key in ("pA_2V_1", "pB_2V_1", "pA_4V_1", "pB_4V_1"):
            table = data[key][::10]
            files.append(tmp_path / f"{key}.csv")
            table = np.column_stack([0.01 * np.arange(len(table)), table])
            head = f"time [s],x [V],{key[:2]} [MPa],u [V]"
            np.savetxt(files[-1], table, "%.6g", ",", header=head, comments="")
    _, channels = new("servo_cylinder", files, tmp_path)
    connectors = {name: c["connector"].rpartition(".")[2] for name, c in channels.items()}
    assert connectors == {"u [V]": "u", "pA [MPa]": "pA", "pB [MPa]": "pB", "x [V]": "x"}
    assert channels["x [V]"]["scale"] == pytest.approx(0.02, rel=0.15)
