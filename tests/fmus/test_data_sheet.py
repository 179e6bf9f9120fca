"""A machine from its data sheet: units, what follows, what is refused, and the packages that come of it."""

import json
import shutil
import tomllib
from pathlib import Path

import jsonschema
import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.fmus import cli
from deepsea_cosim.fmus.data_sheet import KEYS, PAPER, _load_at_rod, read, scaled_catalogue, scales
from deepsea_cosim.gap.campaign.read_catalogue import load, load_from_package
from deepsea_cosim.hydraulics_fmu.constants import by_name, constants
from deepsea_cosim.hydraulics_fmu.states import border
from deepsea_cosim.hydraulics_fmu.steady import steady_state
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.mechanics.variables import ARM

REPOSITORY = Path(__file__).parents[2]
SHEET = REPOSITORY / "examples" / "machine.toml"
CATALOGUE = REPOSITORY / "ssp" / "scenarios" / "deepsea" / "effects.toml"

PAPERS = """
depth = 11000
[cylinder]
bore = 0.045
rod = "25 mm"
stroke = "25 cm"
dead_volume = "20 mL"
viscous_friction = 1000
leakage = 5e-12
[valve]
rated_flow = "5 l/min"
[pump]
displacement = "6 cm3"
speed = "1450 rpm"
pressure = "200 bar"
[lines]
length = "4 m"
diameter = "4 mm"
[oil]
viscosity = "22 cSt"
[controller]
kp = 2.5
[command]
target = "0.2 m"
ramp_time = 5
"""


def sheet(tmp_path, text):
    path = tmp_path / "m.toml"
    path.write_text(text)
    return path


def test_the_papers_sheet_is_the_papers_machine(tmp_path):
    machine = read(sheet(tmp_path, PAPERS))
    for name, value in machine.full.items():
        assert value == pytest.approx(PAPER[name], rel=1e-12), name
    assert machine.depths == (11000.0,)
    assert {k for k, v in machine.arm.items() if abs(v) > 0} <= {
        "rod_eye_radius", "base_x", "base_y", "barrel_length", "rod_length", "rod_diameter", "barrel_diameter",
    }  # fmt: skip
    assert scales(machine) == {}


def test_a_grade_brings_viscosity_and_pressure_index(tmp_path):
    thick, thin = (read(sheet(tmp_path, PAPERS.replace('viscosity = "22 cSt"', f'grade = "{g}"'))).full
                   for g in ("ISO VG 68", "vg15"))  # fmt: skip
    assert (thick["oil.nu0"], thin["oil.nu0"]) == (pytest.approx(68e-6), pytest.approx(15e-6))
    assert thin["oil.alpha"] < PAPER["oil.alpha"] < thick["oil.alpha"]
    assert read(SHEET).full["effect.oil_temperature.T"] == pytest.approx(283.15)


def test_a_longer_stroke_takes_a_larger_linkage_and_the_loop_stays_slower_than_the_load(tmp_path):
    machine = read(SHEET)
    assert machine.arm["rod_eye_radius"] == pytest.approx(0.212 * 0.4 / 0.25)
    assert machine.full["controller.kp"] < PAPER["controller.kp"]
    assert machine.stop == pytest.approx(1.1 * (2 + 8 + 5 + 8))


@pytest.mark.parametrize(("old", "new", "words"), [
    ('rod = "25 mm"', 'rod = "50 mm"', "the rod is 50 mm thick in a bore of 45 mm"),
    ('rod = "25 mm"', 'rood = "25 mm"', "did you mean 'rod'"),
    ('rod = "25 mm"', 'rod = "25 bar"', "they measure different quantities"),
    ('rod = "25 mm"', 'rod = "thick"', "no number with a unit"),
    ('rod = "25 mm"', 'rod = "25 mmm"', "unknown unit 'mmm'"),
    ('rod = "25 mm"', "", "'rod' is missing"),
    ('rod = "25 mm"', "rod = true", "wrong type"),
    ('rod = "25 mm"', 'rod = "1e400 mm"', "'rod' '1e400' is larger than a number can be"),
    ("bore = 0.045", "bore = 45", "out of range"),
    ('speed = "1450 rpm"', 'speed = "1450 rpm"\nflow = "8 l/min"', "one is too much"),
    ('speed = "1450 rpm"', "speed = 0", "'speed' = 0 has to be above zero"),
    ('displacement = "6 cm3"', "flow = 0", "'flow' = 0 has to be above zero"),
    ('displacement = "6 cm3"', "flow = 30", "'flow' = 30: parameter 'pump.displacement' = 1.24138 m3"),
    ('displacement = "6 cm3"', "flow = 30", "a number without a unit is in m3/s"),
    ('viscosity = "22 cSt"', 'grade = "ISO VG 0"', "'grade' = ISO VG 0: parameter 'oil.nu0' = 0 m2/s is out of range"),
    ('viscosity = "22 cSt"', 'grade = "ISO VG 99999"', "allowed: 1e-07 to 0.01 m2/s"),
    ("depth = 11000", "depth = [3000, 3000.001]", "each once"),
    ('displacement = "6 cm3"', "", "'flow' or 'displacement' is missing"),
    ('viscosity = "22 cSt"', 'grade = "SAE 10"', "no viscosity grade"),
    ('viscosity = "22 cSt"', 'grade = "VG 22"\nviscosity = "22 cSt"', "one is too much"),
    ("depth = 11000", "depth = [0, 0]", "each once"),
    ("depth = 11000", "depth = 20000", "0 to 12 km"),
    ("depth = 11000", 'name = "a/b"', "cannot be the name of a file"),
    ("depth = 11000", "[arm]\nrod_eye_radius = 0.05", "would have to reach"),
    ("depth = 11000", "[arm]\nload_weight = -1", "out of range"),
    ("[oil]", "[oil", "not valid TOML"),
    ("bore = 0.045", "bore = 45", "'bore' = 45: parameter 'cylinder.D_h' = 45 m is out of range"),
    ("bore = 0.045", "bore = 45", "a number without a unit is in m"),
    ('stroke = "25 cm"', 'stroke = "-25 cm"', "'stroke' = -25 cm"), ('"25 cm"', '"2,5 cm"', "is no number with a unit"),
    ('stroke = "25 cm"', 'stroke = "2.5 m"', "beyond the beam's end at 1.6 m"),
    ('viscosity = "22 cSt"', 'viscosity = "22 cSt"\ntemperature = "4 C"', "degrees are degC or degF"),
], ids=lambda x: x[:24])  # fmt: skip
def test_what_cannot_be_is_one_line_that_names_the_place(tmp_path, capsys, old, new, words):
    text = PAPERS.replace(old, new)
    assert text != PAPERS
    path = sheet(tmp_path, text)
    with pytest.raises(PackageError) as caught:
        read(path)
    assert words in str(caught.value)
    assert cli.main(["machine", str(path), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert str(path) in told
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("old", "new", "words"), [
    ('rated_flow = "5 l/min"', 'rated_flow = "40 l/min"', "the valve is bigger than the pump"),
    ('pressure = "200 bar"', 'pressure = "20 bar"', "the load needs"),
    ('diameter = "4 mm"', 'diameter = "2.5 mm"', "at 6 km both lines lose"),
    ("ramp_time = 5", "ramp_time = 0.5", "drives the oil through the lines"),
    ('target = "0.2 m"', 'target = "0.3 m"', "beyond the stroke"),
    ("[controller]", "[arm]\nrod_length = 0.1\n[controller]", "the piston is 0.34 to 0.59 m from the base hinge"),
], ids=lambda x: x[:24])  # fmt: skip
def test_what_is_odd_is_told(tmp_path, old, new, words):
    shallow = PAPERS.replace("depth = 11000", "depth = 6000")
    assert read(sheet(tmp_path, shallow)).remarks == ()
    told = read(sheet(tmp_path, shallow.replace(old, new))).remarks
    assert any(words in remark for remark in told)


def test_a_load_is_told_that_is_not_held_behind_the_vertical(tmp_path):
    """At 230 mm the beam has passed it and has to be pulled back, by a piston that a thick rod leaves little of."""
    thick = PAPERS.replace('rod = "25 mm"', 'rod = "42 mm"').replace("depth = 11000", "depth = 0")
    assert read(sheet(tmp_path, thick)).remarks == ()
    (remark,) = read(sheet(tmp_path, thick.replace('target = "0.2 m"', 'target = "0.23 m"'))).remarks
    assert "the load needs -4.52 kN at rest at 230 mm" in remark  # -4.53 with the buoyancy of the thin rod
    assert f"pulls {20e3 * 3.14159 / 4 * (0.045**2 - 0.042**2):.3g} kN" in remark


def test_cold_oil_is_told_to_be_late(tmp_path):
    """At 5 C the oil is five times as thick as at 40 C."""
    shallow = PAPERS.replace("depth = 11000", "depth = 3000")
    assert read(sheet(tmp_path, shallow)).remarks == ()
    (remark,) = read(sheet(tmp_path, shallow.replace("[oil]", '[oil]\ntemperature = "5 degC"'))).remarks
    assert "at 3 km both lines lose" in remark


def test_units_as_data_sheets_write_them(tmp_path):
    text = PAPERS.replace('"22 cSt"', '"22 mm2/s"').replace('displacement = "6 cm3"', 'displacement = "6 cc/rev"')
    text = text.replace('"5 l/min"', '"5 lpm"').replace("depth = 11000", 'depth = "11000 msw"')
    assert read(sheet(tmp_path, text)) == read(sheet(tmp_path, PAPERS))


def test_the_gain_follows_from_the_machine(tmp_path):
    """Less for a wide cylinder under a heavy load; the paper's bears about what it has."""
    paper = PAPERS.replace("[controller]\nkp = 2.5\n", "").replace("depth = 11000", "depth = 0")
    assert read(sheet(tmp_path, paper)).full["controller.kp"] == pytest.approx(2.5, rel=0.05)
    heavy = read(sheet(tmp_path, f"{paper}[arm]\nload_weight = 4000\n")).full["controller.kp"]
    assert heavy < 0.7 * read(sheet(tmp_path, paper)).full["controller.kp"]


def test_the_gain_is_that_of_places_within_the_stroke(tmp_path):
    """Beyond it the linkage is somewhere else, or nowhere."""
    paper = PAPERS.replace("[controller]\nkp = 2.5\n", "").replace("depth = 11000", "depth = 0")
    whole, beyond = (read(sheet(tmp_path, paper.replace('"0.2 m"', target))).full["controller.kp"]
                     for target in ('"0.25 m"', '"5 m"'))  # fmt: skip
    assert whole == beyond


def test_the_papers_machine_is_told_to_be_late_in_the_deep(tmp_path):
    """It takes 7.6 s for a stroke that it is told to do in 5 s."""
    (remark,) = read(sheet(tmp_path, PAPERS)).remarks
    assert "at 11 km both lines lose" in remark


def test_effects_are_usual_in_the_size_of_the_machine(tmp_path):
    machine = read(SHEET)
    force = 0.063**2 * 21e6 / (0.045**2 * 20e6)
    path = tmp_path / "effects.toml"
    path.write_text(scaled_catalogue(CATALOGUE.read_text(), scales(machine)))
    plain, scaled = load(CATALOGUE), load(path)
    usual = {"cylinder_coulomb_friction": force, "valve_leakage": 4.0, "entrained_air": 1.0}
    arm, paper = ({**ARM.parameters({}), **made} for made in (machine.arm, {}))
    weight, paper_weight = (a["load_weight"] + 9.81 * a["beam_mass"] for a in (arm, paper))
    usual["joint_friction"] = weight / paper_weight * arm["beam_length"] / paper["beam_length"]
    usual["buoyancy_error"] = weight / paper_weight
    stroke = machine.full["cylinder.stroke"] / PAPER["cylinder.stroke"]
    usual["compensator_trapped_air"] = stroke * (0.063 / 0.045) ** 2
    for id, factor in usual.items():
        one, other = plain.effect(id).main, scaled.effect(id).main
        assert other.prior == pytest.approx(factor * one.prior, rel=1e-3)
        assert (other.low, other.high) == pytest.approx((factor * one.low, factor * one.high), rel=1e-3)
        assert other.neutral == one.neutral
    assert [e.id for e in scaled.effects] == [e.id for e in plain.effects]


@pytest.mark.parametrize(("bore", "rod", "flow"), [(1.0, 0.5, "2000 l/min"), (0.01, 0.005, "0.1 l/min")])
def test_effects_of_large_and_small_machines_stay_in_the_ranges_of_the_fmu(tmp_path, bore, rod, flow):
    text = PAPERS.replace("bore = 0.045", f"bore = {bore}").replace('rod = "25 mm"', f"rod = {rod}")
    text = text.replace('"5 l/min"', f'"{flow}"').replace('displacement = "6 cm3"', f'flow = "{flow}"')
    factors = scales(read(sheet(tmp_path, text)))
    path = tmp_path / "effects.toml"
    path.write_text(scaled_catalogue(CATALOGUE.read_text(), factors))
    parameters = [x for e in load(path).effects for x in e.all_parameters if x.address in factors]
    assert {x.address for x in parameters} == set(factors)
    for x in parameters:
        component, _, name = x.address.partition(".")
        allowed = {"hydraulics": HYDRAULICS, "arm": ARM}[component][name]
        assert allowed.min <= x.low < x.high <= allowed.max, x.address


def _offset(machine, depth, x, integral):
    """What the controller is off [m] at x [m], for the leakage under the load there and at the start, after that
    integral of the error [m s]."""
    p = {**machine.full, "depth": depth}
    c = constants(p)
    rests = [steady_state(c, _load_at_rod(machine.arm, place)[0])[0] for place in (0.0, x)]
    start, there = (border.py_func(y, by_name(c)).spool for y in rests)
    missing = (start - there) * p["valve.i_rated"] + p["controller.ki"] * p["sensor.gain"] * integral
    return missing / (p["controller.kp"] * p["sensor.gain"])


def test_the_example_builds_and_runs(built, tmp_path, capsys):
    """With the FMUs that are there already; a package a depth."""
    for name in ("DeepseaHydraulics", "DeepseaArm"):
        shutil.copy(built / f"{name}.fmu", tmp_path)
    assert cli.main(["machine", str(SHEET), "--out", str(tmp_path)]) == 0
    assert "note:" not in capsys.readouterr().out
    package = tmp_path / "grab_3km.ssp"
    assert (tmp_path / "grab_0km.ssp").exists()
    assert not check(package).errors
    assert len(load_from_package(package).effects) > 50
    frame = run(package, tmp_path / "out", Options(step=4e-3)).frame()
    error = (frame["hydraulics.x_cmd"] - frame["arm.x_h"])[: frame[frame["hydraulics.x_cmd"] > 0.3499].index[-1]]
    assert -error.iloc[-1] == pytest.approx(_offset(read(SHEET), 3000.0, 0.35, 4e-3 * error.sum()), abs=2e-4)
    assert frame["arm.x_h"].iloc[-1] == pytest.approx(0.0, abs=2e-3)


def test_every_key_is_in_the_docs():
    page = (REPOSITORY / "docs" / "machine.md").read_text()
    for table, keys in KEYS.items():
        for key in keys:
            assert f"| `[{table}] {key}` |" in page


def test_an_editor_takes_the_example_and_marks_what_is_wrong(tmp_path, capsys):
    assert cli.main(["schema", "--out", str(tmp_path)]) == 0
    check = jsonschema.Draft7Validator(json.loads((tmp_path / "machine.schema.json").read_text()))
    sheet = tomllib.loads(SHEET.read_text())
    assert check.is_valid(sheet)
    assert not check.is_valid({**sheet, "cylinder": {**sheet["cylinder"], "bohre": "63 mm"}})
    assert not check.is_valid({**sheet, "pump": {}})
    assert not check.is_valid({**sheet, "depth": []})
