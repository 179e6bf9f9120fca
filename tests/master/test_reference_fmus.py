"""The Reference FMUs of the FMI project, in FMI 1.0, 2.0 and 3.0: `cosim-fmus check` finds nothing wrong with them, and
`cosim-master` gives their own results to the last digit.

They are built here from a checkout of https://github.com/modelica/Reference-FMUs that the environment variable
DEEPSEA_REFERENCE_FMUS names, with the C compiler alone: v0.0.39 and later. Their results lie beside the models
(MODEL/MODEL_out.csv) on its main branch since 2026. Nothing of it is part of this repository; without it all is
skipped.

The results are those of co-simulation with the FMUs' own solver, without event mode: each row there is a communication
point, so all its values have to be found in the run's row of that time, as the same double. (MODEL_ref.csv of other
releases is model exchange, with rows at the events, and is not meant.)
"""

from __future__ import annotations

import csv
import os
import re
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.fmus.cli import main as fmus_main
from deepsea_cosim.master.cli import main

from benchmarks import native

FOLDER = Path(os.environ.get("DEEPSEA_REFERENCE_FMUS", "") or "nowhere")

pytestmark = [
    pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here"),
    pytest.mark.skipif(not FOLDER.is_dir(), reason="DEEPSEA_REFERENCE_FMUS names no checkout of the Reference FMUs"),
]

MODELS = ("BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol")
FMUS = [*((model, version) for version in (1, 2, 3) for model in MODELS), ("StateSpace", 3)]
"""All that do co-simulation. Clocks does scheduled execution only."""

KNOWN = {("Feedthrough", 2): r"elements in the dependencies and dependenciesKind attributes .* do not match"}
"""What is wrong with an FMU itself: Feedthrough up to v0.0.39 (its issue 675)."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A function that gives the FMU of a model in a version of FMI."""
    folder, made = tmp_path_factory.mktemp("reference"), {}

    def fmu(model, version):
        if (model, version) not in made:
            (folder / str(version)).mkdir(exist_ok=True)
            made[model, version] = build(model, version, folder / str(version) / f"{model}.fmu")
        return made[model, version]

    return fmu


def build(model, version, target):
    """What the checkout's CMakeLists.txt does for an FMU of co-simulation."""
    sources = [FOLDER / model / "model.c", FOLDER / "src" / f"fmi{version}Functions.c", FOLDER / "src/cosimulation.c"]
    defines = ["-DDISABLE_PREFIX", f"-DFMI_VERSION={version}", *(["-DFMI_COSIMULATION"] if version == 1 else [])]
    includes = [f"-I{FOLDER / 'include'}", f"-I{FOLDER / model}"]
    # products and sums each rounded, as in the results, on processors also that could do without
    options = ["-shared", "-fPIC", "-O2", "-w", "-ffp-contract=off"]
    library = target.with_suffix(".so")
    subprocess.run([native.compiler, *options, *defines, *includes, *sources, "-o", library, "-lm"], check=True)
    with zipfile.ZipFile(target, "w") as archive:
        archive.write(FOLDER / model / f"FMI{version}{'CS' if version == 1 else ''}.xml", "modelDescription.xml")
        archive.write(library, f"{native.BINARIES[version]}/{model}.so")
        for path in sorted((FOLDER / model).glob("resources/*")):
            archive.write(path, f"resources/{path.name}")
    return target


def ran(tmp_path, fmu, *options):
    """The rows of a run's results: a dictionary for each, by column."""
    assert main([str(fmu), "--out", str(tmp_path / "out"), "--no-plot", "--quiet", *options]) == 0
    return table(tmp_path / "out" / "results.csv")


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def value(cell):
    """A cell as a number, where it is one."""
    try:
        return float({"true": "1", "false": "0"}.get(cell, cell))
    except ValueError:
        return cell


@pytest.mark.parametrize(("model", "version"), FMUS)
def test_the_check_finds_nothing_else_than_what_is_known(built, capsys, model, version):
    code = fmus_main(["check", str(built(model, version))])
    told = capsys.readouterr().out.splitlines()
    if code == 1:
        assert all(re.search(KNOWN.get((model, version), "$^"), line) for line in told), told
    else:
        assert code == 0


@pytest.mark.parametrize(("model", "version"), FMUS)
def test_a_run_is_the_reference_to_the_last_digit(built, tmp_path, model, version):
    reference = FOLDER / model / f"{model}_out.csv"
    if not reference.is_file():
        pytest.skip(f"this checkout has no {reference.name}")
    expected = table(reference)
    step = float(expected[1]["time"]) - float(expected[0]["time"])
    rows = {float(row["time"]): row for row in ran(tmp_path, built(model, version), "--step", repr(step))}
    if version > 1:  # Stair asks to end before its stop time; FMI 1.0 has no words for that
        assert max(rows) == float(expected[-1]["time"])
    compared = 0
    for row in expected:
        at = rows[float(row["time"])]
        for name, cell in row.items():
            column = f"{model}.{name}"
            pairs = [(cell, at[column])] if column in at else []
            if f"{column}[1]" in at:
                pairs = [(c, at[f"{column}[{k}]"]) for k, c in enumerate(cell.split(), start=1)]
            assert pairs or version < 3 or name == "time", name
            for one, other in pairs:
                assert value(other) == value(one), (name, row["time"])
            compared += len(pairs)
    assert compared >= len(expected)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_driven_inputs_are_those_of_fmpy(built, tmp_path, version):
    """A jump, a straight line, and discrete values that are held."""
    from fmpy import simulate_fmu

    names = ("Float64_continuous", "Float64_discrete", "Int32")
    given = [(0.0, 3, 3, 1), (1, 3, 3, 1), (1, 2, 2, 1), (2, 3, 3, 1), (3, 3, 3, 2), (4, 3, 3, 2)]
    stimuli = tmp_path / "stimuli.csv"
    stimuli.write_text("\n".join(",".join(map(str, row)) for row in [("time", *(f"{n}_input" for n in names)), *given]))
    fmu = built("Feedthrough", version)
    rows = ran(tmp_path, fmu, "--step", "0.5", "--stop-time", "5", "--stimuli", str(stimuli))
    inputs = np.array(given, dtype=[("time", float), *((f"{n}_input", t) for n, t in zip(names, "ffi", strict=True))])
    other = simulate_fmu(str(fmu), fmi_type="CoSimulation", stop_time=5, step_size=0.5, output_interval=0.5,
                         input=inputs, output=[f"{n}_output" for n in names], validate=False)  # fmt: skip
    mine = [[float(row[f"Feedthrough.{n}_output"]) for n in names] for row in rows]
    assert mine == [[float(row[f"{n}_output"]) for n in names] for row in other]


def test_whole_numbers_pass_to_the_ends_of_their_types(built, tmp_path):
    """As in the checkout's Feedthrough_in.csv."""
    sizes = (8, 16, 32, 64)
    ends = {f"Int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in sizes} | {f"UInt{n}": (0, 2**n - 1) for n in sizes}
    stimuli = tmp_path / "stimuli.csv"
    rows = [("time", *(f"{kind}_input" for kind in ends)), (0, *(a for a, _ in ends.values())),
            (1, *(b for _, b in ends.values()))]  # fmt: skip
    stimuli.write_text("\n".join(",".join(map(str, row)) for row in rows))
    first, _, last = ran(tmp_path, built("Feedthrough", 3), "--step", "1", "--stimuli", str(stimuli))
    for kind, (least, greatest) in ends.items():
        assert first[f"Feedthrough.{kind}_output"] == str(least)
        assert last[f"Feedthrough.{kind}_output"] == str(greatest)


@pytest.mark.parametrize(("model", "step"), [("BouncingBall", 0.01), ("Stair", 0.2)])
def test_event_mode_elsewhere_adds_rows_and_changes_none(built, tmp_path, model, step):
    """FMPy with event mode and early return: rows at the events too; at ours it has what the run has."""
    from fmpy import simulate_fmu

    fmu = built(model, 3)
    rows = ran(tmp_path, fmu, "--step", repr(step))
    other = simulate_fmu(str(fmu), fmi_type="CoSimulation", step_size=step, output_interval=step, use_event_mode=True,
                         early_return_allowed=True)  # fmt: skip
    names = [name for name in other.dtype.names if name != "time"]
    assert len(other) > len(rows)
    for row in rows:
        there = other[np.isclose(other["time"], float(row["time"]), rtol=0.0, atol=1e-9)].tolist()
        assert tuple(float(row[f"{model}.{name}"]) for name in names) in [tuple(one[1:]) for one in there], row


def test_arrays_of_other_sizes(built, tmp_path):
    """y = D u with u, y of two values instead of three, no state, and then with none."""
    stimuli = tmp_path / "stimuli.csv"
    stimuli.write_text("time,u[1],u[2]\n0,1,2\n1,3,4\n")
    sizes = [f"--set={name}={size}" for name, size in (("m", 2), ("n", 0), ("r", 2))]
    fmu, twice = built("StateSpace", 3), ("--step", "1", "--stop-time", "2")
    rows = ran(tmp_path, fmu, *twice, *sizes, "--set=D=1 0 0 1", "--stimuli", str(stimuli))
    assert [[float(row[f"StateSpace.y[{k}]"]) for k in (1, 2)] for row in rows] == [[1, 2], [1, 2], [3, 4]]
    rows = ran(tmp_path, fmu, *twice, "--set=m=0", "--set=r=0")
    assert [list(row) for row in rows] == [["time"]] * 3
