"""The shipped effects.toml fits the FMUs: addresses exist, neutral values are theirs, bounds lie in their ranges."""

import tomllib
import zipfile
from pathlib import Path

import pytest
from deepsea_cosim import ssp
from deepsea_cosim.hydraulics_fmu.variables import HYDRAULICS
from deepsea_cosim.mechanics.variables import ARM

TABLES = {"hydraulics": HYDRAULICS, "arm": ARM}
CATALOGUE = tomllib.loads((Path(ssp.__file__).parent / "scenarios" / "deepsea" / "effects.toml").read_text())

# ids that others rely on: none of them goes or gets another name
CORE = (
    "cylinder_presliding valve_hysteresis bulk_modulus_pressure external_leakage density_pressure line_turbulence "
    "unsteady_line_friction end_cushion joint_clearance viv beam_flexibility compensator_trapped_air base_motion "
    "oil_warm_up line_thermal counterbalance_valve compensator_travel umbilical_supply pump_dynamics filter_clogging "
    "water_in_oil silt_lock tether sensor_drift sensor_nonlinearity "
    "cylinder_coulomb_friction cylinder_stribeck_friction seal_pressure_friction cylinder_viscous_error "
    "entrained_air hose_compliance valve_dynamics command_delay valve_dead_zone valve_null_shift valve_leakage "
    "valve_flow_gain orifice_flow_number piston_leakage oil_temperature relief_override supply_droop "
    "line_minor_losses line_diameter_error joint_friction payload_error buoyancy_error marine_growth "
    "drag_coefficient current_error current_unsteady sensor_bias sensor_scale sensor_lag sensor_delay "
    "controller_sampling ambient_pressure_error viscosity_law pump_slip "
)


def variable(address):
    component, _, name = address.partition(".")
    return TABLES[component][name]


def test_every_core_effect_is_there_once():
    ids = [e["id"] for e in (*CATALOGUE["effect"], *CATALOGUE["sensor"])]
    assert len(set(ids)) == len(ids)
    assert set(CORE.split()) <= set(ids)


def test_every_effect_of_the_fmus_is_listed():
    own = {v.name.split(".")[1] for table in TABLES.values() for v in table if v.name.startswith("effect.")}
    curves = {address.split(".")[2] for c in CATALOGUE["curve"] for address in c["parameters"]}
    assert own <= {e["id"] for e in CATALOGUE["effect"]} | curves


@pytest.mark.parametrize("curve", CATALOGUE["curve"], ids=lambda c: c["id"])
def test_values_of_a_curve(curve):
    assert len(curve["knots"]) == len(curve["parameters"])
    for knot, address in zip(curve["knots"], curve["parameters"], strict=True):
        v = variable(address)
        assert v.start == 0.0
        assert v.min <= -5 * curve["prior"] < 5 * curve["prior"] <= v.max
        assert f"{knot:g}" in v.description


@pytest.mark.parametrize("effect", CATALOGUE["effect"], ids=lambda e: e["id"])
def test_parameters_of_an_effect(effect):
    assert effect["text"]
    assert effect["group"]
    for p in effect["parameter"]:
        for address in (p["address"], *p.get("also", ())):
            v = variable(address)
            low, high = p["bounds"]
            assert v.min <= low < high <= v.max
            assert low <= p["neutral"] <= high
            assert p["prior"] > 0
            if v.name.startswith("effect."):
                assert v.start == pytest.approx(p["neutral"])


def test_base_parameters_exist_and_have_a_size():
    for base in CATALOGUE["base"]:
        assert variable(base["parameter"]).start != 0
        assert 0 < base["tolerance"] < 1


def test_catalogue_is_packed(built):
    with zipfile.ZipFile(built / "deepsea_11km.ssp") as package:
        assert tomllib.loads(package.read("resources/effects.toml").decode()) == CATALOGUE
