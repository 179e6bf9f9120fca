"""A machine from its data sheet: machine.toml with bore, rod, stroke, valve, pump, lines, oil and arm -> parameters.

    name = "gripper"
    depth = ["0 m", "3000 m"]

    [cylinder]
    bore = "63 mm"
    rod = "36 mm"
    stroke = "400 mm"

A value is a number in SI units or a text with a unit. docs/machine.md has every key; `KEYS` is that table.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from math import hypot, inf, isfinite, pi, sqrt
from pathlib import Path
from typing import Any

from ..core.errors import CosimError, PackageError, UsageError
from ..core.plain_numbers import plain_number, shown_value
from ..core.sea import GRAVITY
from ..core.toml_tables import Tables
from ..core.unit_names import named
from ..core.units import conversion, unit
from ..hydraulics_fmu.constants import by_name, constants
from ..hydraulics_fmu.cylinder import areas
from ..hydraulics_fmu.line import poiseuille_resistance
from ..hydraulics_fmu.oil import index_factor, viscosity
from ..hydraulics_fmu.stability import critical_gain
from ..hydraulics_fmu.variables import HYDRAULICS
from ..mechanics.linkage import check_buildable, linkage
from ..mechanics.variables import ARM

PAPER = HYDRAULICS.parameters({})
"""The machine of the paper, whose numbers hold where the sheet has none."""

KEYS: dict[str, dict[str, tuple[str, str]]] = {
    "cylinder": {
        "bore": ("m", "cylinder.D_h"), "rod": ("m", "cylinder.d_h"), "stroke": ("m", "cylinder.stroke"),
        "dead_volume": ("m3", "cylinder.dead_volume"), "viscous_friction": ("N.s/m", "cylinder.B_h"),
        "leakage": ("m3/(s.Pa)", "cylinder.c_l"),
    },
    "valve": {
        "rated_flow": ("m3/s", "valve.q_rated"), "rated_pressure": ("Pa", "valve.dp_rated"),
        "rated_current": ("mA", "valve.i_rated"), "transition": ("1", "valve.lam_crit"),
    },
    "pump": {
        "flow": ("m3/s", ""), "displacement": ("m3", "pump.displacement"), "speed": ("1/s", "pump.speed"),
        "pressure": ("Pa", "relief.p_crack"),
    },
    "lines": {
        "length": ("m", "line.length"), "diameter": ("m", "line.diameter"), "wall_modulus": ("Pa", "line.beta_wall"),
    },
    "oil": {
        "grade": ("", ""), "viscosity": ("m2/s", "oil.nu0"), "density": ("kg/m3", "oil.rho"),
        "bulk_modulus": ("Pa", "oil.beta"), "pressure_index": ("1/Pa", "oil.alpha"),
        "temperature": ("K", "effect.oil_temperature.T"),
    },
    "tank": {"volume": ("m3", "tank.volume")},
    "command": {
        "target": ("m", "command.target"), "start": ("s", "command.t_start"), "ramp_time": ("s", "command.ramp_time"),
        "hold_time": ("s", "command.hold_time"),
    },
    "controller": {
        "sensor_gain": ("1/m", "sensor.gain"), "kp": ("mA", "controller.kp"), "ki": ("mA/s", "controller.ki"),
        "kd": ("mA.s", "controller.kd"),
    },
    "arm": {
        v.name: (v.unit or "1", v.name) for v in ARM.of("parameter")
        if v.kind == "Real" and v.name != "depth" and not v.name.startswith("effect.")
    },
}  # fmt: skip
"""Tables and keys of a sheet: unit, and the parameter of the hydraulics (of the arm: of the arm) that it is."""

NEEDED = {"cylinder": ("bore", "rod", "stroke"), "valve": ("rated_flow",), "pump": ("pressure",)}
"""What a sheet cannot do without."""

WITH_STROKE = ("rod_eye_radius", "base_x", "base_y", "barrel_length", "rod_length")
"""Lengths of the arm that grow with the stroke where the sheet does not state them, so that its angles stay."""

LINKAGE = ("theta0", "rod_eye_radius", "base_x", "base_y")
"""Parameters of the arm that the cylinder's length follows from."""

MARGIN = 2.2
"""By how much the gain that a sheet does not state is below the one at which the machine swings up: as in the paper's
machine at the surface."""

LINE_SPEED = 8.0
"""Speed of the oil in the lines [m/s] beyond which a word is said."""

MOST_DEPTHS, LONGEST_NAME = 50, 100
"""Packages that are built at a time; characters of a name, which becomes one of files."""

NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII)


@dataclass(frozen=True)
class Machine:
    """What a sheet says: name, depths [m], parameters of hydraulics and arm by name, and what is to be said of it."""

    name: str
    depths: tuple[float, ...]
    hydraulics: dict[str, float]
    arm: dict[str, float]
    remarks: tuple[str, ...] = field(default=())

    @property
    def stop(self) -> float:
        """End of a run [s]: the command's rise, hold and fall, and a tenth of it."""
        p = self.full
        return 1.1 * (p["command.t_start"] + 2.0 * p["command.ramp_time"] + p["command.hold_time"])

    @property
    def full(self) -> dict[str, float]:
        """All parameters of the hydraulics."""
        return HYDRAULICS.parameters(self.hydraulics)


class _Sheet(Tables):
    def __init__(self, path: Path):
        super().__init__(PackageError)
        self.path, self.data = path, self.load(path)
        self.reject_unknown_keys(self.data, ("name", "depth", *KEYS), str(path))
        self.values = {name: self._table(name) for name in KEYS}

    def _table(self, name: str) -> dict[str, float]:
        where = f"{self.path}: [{name}]"
        table = self.get(self.data, str(self.path), name, dict, {})
        self.reject_unknown_keys(table, tuple(KEYS[name]), where)
        for key in NEEDED.get(name, ()):
            if key not in table:
                raise self.error(f"{where}: '{key}' is missing")
        return {key: self.value(table, where, key, KEYS[name][key][0]) for key in table if KEYS[name][key][0]}

    def value(self, table: dict[str, Any], where: str, key: str, own: str) -> float:
        """A value in the unit `own`."""
        given = table[key]
        if not isinstance(given, str):
            return self.number(table, where, key)
        found = NUMBER.fullmatch(given)
        if found is None or found[2].startswith(","):
            raise self.error(f"{where}: '{key}' = '{given}' is no number with a unit, as \"63 mm\" or \"4.5 cm\"")
        try:
            factor, offset = conversion(named(found[2]) or unit(found[2]), unit(own)) if found[2] else (1.0, 0.0)
        except UsageError as error:
            hint = "; degrees are degC or degF" if found[2] in ("C", "F") and own == "K" else ""
            raise self.error(f"{where}: '{key}' = '{given}': {error}{hint}") from None
        try:
            return factor * plain_number(found[1]) + offset
        except ValueError as error:
            raise self.error(f"{where}: '{key}' {error}") from None


def read(path: Path) -> Machine:
    """The machine of a sheet. Raises `PackageError` in one line for what cannot be."""
    sheet = _Sheet(path)
    name = sheet.get(sheet.data, str(path), "name", str, path.stem)
    if not re.fullmatch(r"\w[\w.-]*", name) or len(name) > LONGEST_NAME:
        raise PackageError(
            f"{path}: 'name' = {shown_value(name)} cannot be the name of a file: letters, digits, '_', '-' and '.', "
            f"{LONGEST_NAME} at most"
        )
    hydraulics = {
        parameter: sheet.values[table][key]
        for table, keys in KEYS.items() if table != "arm"
        for key, (_, parameter) in keys.items() if parameter and key in sheet.values[table]
    }  # fmt: skip
    _check_bounds(sheet)
    stated = sheet.values["cylinder"]
    if stated["rod"] >= stated["bore"]:
        raise PackageError(
            f"{path}: [cylinder]: the rod is {1e3 * stated['rod']:g} mm thick in a bore of {1e3 * stated['bore']:g} mm"
        )
    hydraulics |= _pump(sheet) | _oil(path, sheet)
    hydraulics = _usual(hydraulics)
    depths = _depths(sheet)
    try:
        HYDRAULICS.parameters(hydraulics)
        arm = _arm(path, sheet.values["arm"], hydraulics)
        if "kp" not in sheet.values["controller"]:
            hydraulics["controller.kp"] = _gain(hydraulics, arm, depths)
        full = HYDRAULICS.parameters(hydraulics)
    except PackageError:
        raise
    except CosimError as error:
        raise PackageError(f"{path}: {error}") from None
    return Machine(name, depths, hydraulics, arm, tuple(_remarks(full, arm, depths)))


def _check_bounds(sheet: _Sheet) -> None:
    """Raise `PackageError` for a value that its parameter may not have, by the name that it has in the sheet."""
    for table, keys in KEYS.items():
        for key, value in sheet.values[table].items():
            if keys[key][1]:
                _check_bound(sheet, table, key, keys[key][1], value)


def _check_bound(sheet: _Sheet, table: str, key: str, parameter: str, value: float) -> None:
    """Raise `PackageError` for a value that a parameter may not have, which the sheet's key is or makes."""
    own, given = KEYS[table][key][0], sheet.data[table][key]
    try:
        (ARM if table == "arm" else HYDRAULICS).parameters({parameter: value})
    except CosimError as error:
        plain = f"; a number without a unit is in {own}" if own not in ("", "1") and not isinstance(given, str) else ""
        raise PackageError(f"{sheet.path}: [{table}]: '{key}' = {given}: {error}{plain}") from None


def kilometres(depth: float) -> str:
    """A depth [m] as it stands in the name of a package."""
    return f"{depth / 1e3:g}km"


def _depths(sheet: _Sheet) -> tuple[float, ...]:
    where, given = str(sheet.path), sheet.data.get("depth", 0.0)
    entries = given if isinstance(given, list) else [given]
    if len(entries) > MOST_DEPTHS:
        raise PackageError(f"{where}: 'depth' has {len(entries)} depths; it takes {MOST_DEPTHS} at most")
    depths = tuple(sheet.value({"depth": entry}, where, "depth", "m") for entry in entries)
    once = len({kilometres(d) for d in depths}) == len(depths)
    if not depths or not once or not all(0.0 <= d <= 12000.0 for d in depths):
        raise PackageError(f"{where}: 'depth' = {given} has to be depths from 0 to 12 km, each once")
    return depths


def _pump(sheet: _Sheet) -> dict[str, float]:
    """Displacement and speed; a flow alone is one at the paper's speed."""
    where, pump = f"{sheet.path}: [pump]", sheet.values["pump"]
    for key in ("flow", "speed"):
        if pump.get(key, 1.0) <= 0.0:
            raise PackageError(f"{where}: '{key}' = {sheet.data['pump'][key]} has to be above zero")
    if "flow" not in pump:
        if "displacement" not in pump:
            raise PackageError(f"{where}: 'flow' or 'displacement' is missing")
        return {}
    if "displacement" in pump and "speed" in pump:
        raise PackageError(f"{where}: of 'flow', 'displacement' and 'speed' one is too much")
    if "displacement" in pump:
        made = {"pump.speed": pump["flow"] / pump["displacement"]}
    else:
        speed = pump.get("speed", PAPER["pump.speed"])
        made = {"pump.displacement": pump["flow"] / speed, "pump.speed": speed}
    for parameter, value in made.items():
        _check_bound(sheet, "pump", "flow", parameter, value)
    return made


def _oil(path: Path, sheet: _Sheet) -> dict[str, float]:
    """Viscosity by the grade, and the pressure index of such oil after Wooster where none is stated."""
    where, table, oil = f"{path}: [oil]", sheet.data.get("oil", {}), sheet.values["oil"]
    made: dict[str, float] = {}
    if "grade" in table:
        if "viscosity" in oil:
            raise PackageError(f"{where}: of 'grade' and 'viscosity' one is too much")
        found = re.fullmatch(r"(?:ISO\s*)?VG\s*(\d+(?:\.\d+)?)", str(table["grade"]), re.IGNORECASE)
        if found is None:
            raise PackageError(f"{where}: 'grade' = '{table['grade']}' is no viscosity grade, as \"ISO VG 32\"")
        made["oil.nu0"] = 1e-6 * float(found[1])
        _check_bound(sheet, "oil", "grade", "oil.nu0", made["oil.nu0"])
    nu = made.get("oil.nu0", oil.get("viscosity", PAPER["oil.nu0"]))
    if "pressure_index" not in oil and nu != PAPER["oil.nu0"]:
        rho = oil.get("density", PAPER["oil.rho"])
        made["oil.alpha"] = PAPER["oil.alpha"] * index_factor(rho * nu, PAPER["oil.rho"] * PAPER["oil.nu0"])
    return made


def _usual(given: dict[str, float]) -> dict[str, float]:
    """With what a sheet seldom states, in proportion to what it does."""
    stroke = given["cylinder.stroke"]
    A_1, _ = areas(given["cylinder.D_h"], given["cylinder.d_h"])
    paper_A_1, _ = areas(PAPER["cylinder.D_h"], PAPER["cylinder.d_h"])
    volume, size = A_1 * stroke / (paper_A_1 * PAPER["cylinder.stroke"]), A_1 / paper_A_1
    pump = given.get("pump.displacement", PAPER["pump.displacement"]) * given.get("pump.speed", PAPER["pump.speed"])
    quick = 0.5 * min(pump, given["valve.q_rated"]) / A_1  # half of what valve and pump give for sure
    target = given.get("command.target", 0.8 * stroke)
    usual = {
        "cylinder.dead_volume": PAPER["cylinder.dead_volume"] * volume,
        "cylinder.c_l": PAPER["cylinder.c_l"] * sqrt(size), "cylinder.B_h": PAPER["cylinder.B_h"] * sqrt(size),
        "cylinder.stop_stiffness": PAPER["cylinder.stop_stiffness"] * size,
        "cylinder.stop_damping": PAPER["cylinder.stop_damping"] * size,
        "tank.volume": max(PAPER["tank.volume"], PAPER["tank.volume"] * volume),
        "command.target": target, "command.ramp_time": max(target / quick, 0.1),
    }  # fmt: skip
    return {**usual, **given}


def _arm(path: Path, given: dict[str, float], hydraulics: dict[str, float]) -> dict[str, float]:
    """The arm's parameters that differ from the paper's; its linkage grows with the stroke."""
    stroke, paper = hydraulics["cylinder.stroke"], ARM.parameters({})
    grown = stroke / PAPER["cylinder.stroke"]
    usual = {name: paper[name] * grown for name in WITH_STROKE}
    usual |= {
        "rod_diameter": hydraulics["cylinder.d_h"],
        "barrel_diameter": hydraulics["cylinder.D_h"] * paper["barrel_diameter"] / PAPER["cylinder.D_h"],
    }
    arm = {**usual, **given}
    full = ARM.parameters(arm)
    geometry = tuple(full[name] for name in LINKAGE)
    check_buildable(*geometry)
    if full["rod_eye_radius"] > full["beam_length"]:
        raise PackageError(
            f"{path}: [arm]: the rod's eye, which grows with the stroke, is {full['rod_eye_radius']:.3g} m from the "
            f"hinge, beyond the beam's end at {full['beam_length']:.3g} m: state 'beam_length' and 'beam_mass', or "
            "'rod_eye_radius'"
        )
    length = linkage.py_func(*geometry)[0]
    reach = full["rod_eye_radius"] + hypot(full["base_x"], full["base_y"])
    if length + stroke > reach:
        raise PackageError(
            f"{path}: [arm]: the cylinder is {length:.3g} m long at theta0 and would have to reach "
            f"{length + stroke:.3g} m at the end of its stroke; eye and base are at most {reach:.3g} m apart"
        )
    return arm


def _gain(hydraulics: dict[str, float], arm: dict[str, float], depths: tuple[float, ...]) -> float:
    """A proportional gain [mA per sensor's unit] that the machine bears: `MARGIN` times less than the one at which it
    swings up at rest, at the depth and the place of the rod where that is the lowest."""
    p = HYDRAULICS.parameters(hydraulics)
    lowest = inf
    for x in _places(p):
        F_hold, mass = _load_at_rod(arm, x)
        for depth in depths:
            lowest = min(lowest, critical_gain({**p, "depth": depth}, x, F_hold, mass))
    return lowest / MARGIN if isfinite(lowest) else p["controller.kp"]


def _places(p: dict[str, float]) -> list[float]:
    """Places of the rod [m] from where it rests to where the command goes, within the stroke."""
    furthest = min(p["command.target"], p["cylinder.stroke"])
    return [share * furthest for share in (0.0, 0.25, 0.5, 0.75, 1.0)]


def _load_at_rod(arm: dict[str, float], x: float) -> tuple[float, float]:
    """Force [N] and mass [kg] that the cylinder feels at rest at its displacement x [m]."""
    from ..mechanics import loads, stepping
    from ..mechanics.arm import Arm

    it = Arm(ARM.parameters(arm))
    theta = float(it.theta)
    for _ in range(50):  # Newton for the angle at x
        stepping.evaluate(it.row.ctypes.data, theta, 0.0, 0.0, 0.0)
        theta += (x - float(it.projection[loads.X])) / float(it.projection[loads.LEVER])
    lever = float(it.projection[loads.LEVER])
    return -float(it.projection[loads.TORQUE]) / lever, float(it.projection[loads.MASS]) / lever**2


def _remarks(p: dict[str, float], arm: dict[str, float], depths: tuple[float, ...]) -> list[str]:
    """What is to be said of a machine that can be built."""
    said: list[str] = []
    pump, supply = p["pump.displacement"] * p["pump.speed"], p["relief.p_crack"]
    if p["valve.q_rated"] > 1.0001 * pump:
        said.append(
            f"the valve is bigger than the pump: it is rated for {_flow(p['valve.q_rated'])}, the pump gives "
            f"{_flow(pump)}"
        )
    A_1, A_2 = areas(p["cylinder.D_h"], p["cylinder.d_h"])
    loads = [(_load_at_rod(arm, x)[0], x) for x in _places(p)]
    hold, x = max(loads, key=lambda it: max(it[0] / A_1, -it[0] / A_2))
    if not -0.9 * supply * A_2 < hold < 0.9 * supply * A_1:
        said.append(
            f"the load needs {hold / 1e3:.3g} kN at rest at {1e3 * x:.4g} mm; the cylinder pushes at most "
            f"{supply * A_1 / 1e3:.3g} kN and pulls {supply * A_2 / 1e3:.3g} kN"
        )
    bore, Q = pi * p["line.diameter"] ** 2 / 4.0, A_1 * p["command.target"] / p["command.ramp_time"]
    if Q / bore > LINE_SPEED:
        said.append(f"the commanded stroke drives the oil through the lines at {Q / bore:.3g} m/s; usual are 2 to 6")
    c = by_name(constants({**p, "depth": max(depths)}))  # with the oil's temperature
    eta = viscosity.py_func(c.sea.p_am, c.line.eta0, c.line.alpha, c.effect.viscosity_law.share)
    loss = 2.0 * poiseuille_resistance.py_func(eta, p["line.length"], p["line.diameter"]) * Q
    if loss > 0.5 * supply:
        said.append(
            f"at {max(depths) / 1e3:g} km both lines lose {loss / 1e6:.3g} MPa of {supply / 1e6:.3g} MPa at the "
            "commanded speed: the stroke will take longer than told"
        )
    full = ARM.parameters(arm)
    inside = linkage.py_func(*(full[name] for name in LINKAGE))[0] - full["rod_length"]
    if inside < 0.0 or inside + p["cylinder.stroke"] > full["barrel_length"]:
        said.append(
            f"the piston is {inside:.3g} to {inside + p['cylinder.stroke']:.3g} m from the base hinge, outside its "
            f"barrel of {full['barrel_length']:.3g} m: state 'rod_length' and 'barrel_length', which the weights go by"
        )
    if p["command.target"] > p["cylinder.stroke"]:
        said.append("the command goes beyond the stroke: the piston will lean on its end stop")
    return said


def _flow(Q: float) -> str:
    return f"{6e4 * Q:.3g} l/min"


def scales(machine: Machine) -> dict[str, float]:
    """By how much the usual sizes of effects are those of the paper's machine times, by address of the catalogue."""
    p, arm, paper_arm = machine.full, ARM.parameters(machine.arm), ARM.parameters({})
    A_1, paper = areas(p["cylinder.D_h"], p["cylinder.d_h"])[0], areas(PAPER["cylinder.D_h"], PAPER["cylinder.d_h"])[0]
    pressure = p["relief.p_crack"] / PAPER["relief.p_crack"]
    force = A_1 / paper * pressure
    flow = p["valve.q_rated"] / PAPER["valve.q_rated"]
    pump = p["pump.displacement"] * p["pump.speed"] / (PAPER["pump.displacement"] * PAPER["pump.speed"])
    weight = _weight(arm) / _weight(paper_arm)
    length = arm["beam_length"] / paper_arm["beam_length"]
    hydraulics = {
        "cylinder_coulomb_friction.F_c": force, "cylinder_stribeck_friction.F_extra": force,
        "cylinder_presliding.F_c": force, "seal_pressure_friction.k_p": A_1 / paper,
        "valve_leakage.c": flow, "external_leakage.c": sqrt(A_1 / paper),
        "relief_override.R": pressure / pump, "counterbalance_valve.p_set": pressure,
        "compensator_trapped_air.volume": A_1 / paper * p["cylinder.stroke"] / PAPER["cylinder.stroke"],
    }  # fmt: skip
    of_arm = {
        "joint_friction.tau_c": weight * length, "buoyancy_error.force": weight, "tether.stiffness": weight / length,
    }  # fmt: skip
    made = {f"hydraulics.effect.{name}": scale for name, scale in hydraulics.items()}
    made |= {f"arm.effect.{name}": scale for name, scale in of_arm.items()}
    return {address: scale for address, scale in made.items() if abs(scale - 1.0) > 1e-9}


def _weight(arm: dict[str, float]) -> float:
    """Weight [N] of an arm's load and beam, about: the beam's as in air."""
    return arm["load_weight"] + GRAVITY * arm["beam_mass"]


def scaled_catalogue(text: str, factors: dict[str, float]) -> str:
    """A catalogue whose bounds, usual sizes and starts are other ones for some addresses."""
    factor, lines = 1.0, []
    address = re.compile(r'address = "([^"]+)"')

    def scaled(found: re.Match[str]) -> str:
        return f"{float(found[0]) * factor:.4g}"

    for line in text.splitlines():
        if found := address.fullmatch(line.strip()):
            factor = factors.get(found[1], 1.0)
        elif line.startswith("[["):
            factor = 1.0
        elif factor != 1.0 and re.match(r"(bounds|prior|starts) = ", line):
            key, _, rest = line.partition(" = ")
            line = f"{key} = {re.sub(r'[-+]?[0-9][0-9.eE+-]*', scaled, rest)}"
        lines.append(line)
    return "\n".join(lines) + "\n"
