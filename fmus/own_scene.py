"""What a replay draws of a user's arm: its model as it goes into the FMU, with a rod and two chambers of oil, which
together are the barrel, in the place of each tendon between two sites. Lengths of the cylinders follow from the run,
for no model states a stroke. Planes go: there is a sea floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from lxml import etree

from ..mechanics.own_arm.description import Description
from ..mechanics.own_arm.simulation import OwnArm
from .scenes import Files

BARREL, ROD = 0.95, 0.92
"""Lengths of barrel and rod as shares of the cylinder's least length in the run: so the piston stays in the barrel
where the cylinder grows to 1.87 times that at most."""

SLIM, WIDTHS = 0.045, 1.5
"""Radius of a barrel: this share of the cylinder's length at the start, or so many widths of the tendon if that is
more."""

BARS = int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER)
SINGLE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
"""Geoms with an axis; joints of one number."""

HIDDEN = "5"
"""Group of sites that are not drawn."""

MATERIALS = {
    "steel": {"rgba": "0.85 0.87 0.9 1", "specular": "0.8", "shininess": "0.7"},
    "frame": {"rgba": "0.36 0.4 0.46 1", "specular": "0.2"},
    "oil": {"rgba": "0.75 0.75 0.78 1", "emission": "0.3", "specular": "0"},
}


@dataclass(frozen=True)
class _Cylinder:
    """A tendon between two sites, by name; `radius` of the barrel [m]."""

    name: str
    base: str
    eye: str
    radius: float


def scene_of(arm: OwnArm) -> Files:
    """The files that go into resources/replay of the FMU, by name, of the arm in its first pose."""
    root = etree.fromstring(arm.d.xml.encode())
    world, tendons = root.find("worldbody"), root.find("tendon")
    assets = root.find("asset") if root.find("asset") is not None else etree.SubElement(root, "asset")
    for name, look in MATERIALS.items():
        etree.SubElement(assets, "material", {"name": f"cylinder.{name}", **look})
    for plane in root.findall(".//geom[@type='plane']"):
        plane.getparent().remove(plane)
    cylinders = list(_cylinders(arm))
    for c in cylinders:
        for element in tendons.findall(f"spatial[@name='{c.name}']"):
            tendons.remove(element)
        _add_cylinder(world, c)
    _add_brackets(arm, root, world, cylinders)
    etree.indent(root, "  ")
    text: bytes = etree.tostring(root, pretty_print=True)
    return ("replay.toml", _rules(arm, cylinders).encode()), ("scene.xml", text)


def _cylinders(arm: OwnArm) -> Iterator[_Cylinder]:
    m = arm.model
    for name, length in zip(arm.d.tendons, arm.lengths, strict=True):
        k = m.tendon(name).id
        way = range(m.tendon_adr[k], m.tendon_adr[k] + m.tendon_num[k])
        if [int(m.wrap_type[w]) for w in way] == [int(mujoco.mjtWrap.mjWRAP_SITE)] * 2:
            base, eye = (m.site(m.wrap_objid[w]).name for w in way)
            yield _Cylinder(name, base, eye, float(max(SLIM * length, WIDTHS * m.tendon_width[k])))


def signal(address: str) -> str:
    """A name of a variable in a formula."""
    plain = all(part.isidentifier() for part in address.split("."))
    return address if plain else f"signal({address!r})"


def _place(formula: str) -> str:
    """A formula as it stands in a scene: a number is just that."""
    try:
        return f"{float(formula):.6g}"
    except ValueError:
        return f"{{{formula}}}"


def _add_cylinder(world: etree._Element, c: _Cylinder) -> None:
    """Barrel, rod and oil; places in braces are formulas."""
    name, r = c.name, c.radius
    least = f"min({signal(f'{name}.length')})"
    barrel, rod = f"{BARREL} * {least}", f"{ROD} * {least}"

    def bar(owner: etree._Element, part: str, look: str, begin: str, end: str, radius: float) -> None:
        etree.SubElement(
            owner, "geom", name=f"{name}.{part}", type="cylinder", material=f"cylinder.{look}", size=f"{radius:.6g}",
            fromto=f"{_place(begin)} 0 0 {_place(end)} 0 0", contype="0", conaffinity="0",
        )  # fmt: skip

    def site(owner: etree._Element, part: str, at: str) -> None:
        etree.SubElement(owner, "site", name=f"{name}.{part}", pos=f"{_place(at)} 0 0", group=HIDDEN)

    body = etree.SubElement(world, "body", name=f"{name}.barrel", mocap="true")
    bar(body, "cap", "frame", f"{-0.6 * r:.6g}", f"{0.2 * r:.6g}", 1.08 * r)
    bar(body, "gland", "frame", f"{barrel} - {0.2 * r:.6g}", f"{barrel} + {0.2 * r:.6g}", 1.08 * r)
    site(body, "cap_inside", f"{0.2 * r:.6g}")
    site(body, "gland_inside", f"{barrel} - {0.2 * r:.6g}")
    body = etree.SubElement(world, "body", name=f"{name}.rod", mocap="true")
    bar(body, "rod", "steel", "0", rod, 0.42 * r)
    bar(body, "piston", "frame", f"{rod} - {0.5 * r:.6g}", rod, 1.04 * r)
    site(body, "piston_back", rod)
    site(body, "piston_front", f"{rod} - {0.5 * r:.6g}")
    for chamber in ("chamber_1", "chamber_2"):
        bar(world, chamber, "oil", "0", "0.1", r)


def _add_brackets(arm: OwnArm, root: etree._Element, world: etree._Element, cylinders: list[_Cylinder]) -> None:
    """Bars from where cylinders are hinged to what carries them; in a bare world to where the arm stands."""
    m = arm.model
    for c in cylinders:
        ends = [m.site(site).id for site in (c.base, c.eye)]
        for site, other in (ends, ends[::-1]):
            body = m.site_bodyid[site]
            place = m.site_pos[site]
            bends = [_nearest(m, body, place)] if body else []
            if not body and m.body_geomnum[0] == 0:  # down where the arm stands, then across to the hinge
                foot = m.body_pos[m.body_rootid[m.site_bodyid[other]]]
                bends = [foot, np.array([foot[0], foot[1], min(foot[2], place[2])])]
            owner = world if not body else root.find(f".//body[@name='{m.body(body).name}']")
            way = [*(point for point in bends if point is not None), place]
            for k, (begin, end) in enumerate(pairwise(way), 1):
                if owner is None or np.linalg.norm(end - begin) < 1e-6:
                    continue
                etree.SubElement(
                    owner, "geom", name=f"{c.name}.bracket_{m.site(site).name}_{k}", type="capsule", mass="0",
                    fromto=" ".join(f"{float(x):.6g}" for x in (*begin, *end)), size=f"{0.8 * c.radius:.6g}",
                    material="cylinder.frame", contype="0", conaffinity="0",
                )  # fmt: skip


def _nearest(m: mujoco.MjModel, body: int, place: np.ndarray) -> np.ndarray | None:
    """The nearest point to a place in a body's frame on the axes of its bars; None where it has none."""
    found: list[np.ndarray] = []
    for g in range(m.body_geomadr[body], m.body_geomadr[body] + m.body_geomnum[body]):
        if int(m.geom_type[g]) in BARS:
            turned = np.empty(9)
            mujoco.mju_quat2Mat(turned, m.geom_quat[g])
            axis, half = turned.reshape(3, 3)[:, 2], m.geom_size[g][1]
            found.append(m.geom_pos[g] + axis * np.clip((place - m.geom_pos[g]) @ axis, -half, half))
    return min(found, key=lambda point: float(np.linalg.norm(point - place)), default=None)


def _rules(arm: OwnArm, cylinders: list[_Cylinder]) -> str:
    """replay.toml: joints that move follow their outputs, those that are held stay where they are."""
    d: Description = arm.d
    lines = ["# How scene.xml follows a run (docs/fmus.md)", "[joints]"]
    told = {name for name, _ in d.joints}
    for j in range(arm.model.njnt):
        name = arm.model.joint(j).name
        if int(arm.model.jnt_type[j]) in SINGLE:
            formula = signal(f"{name}.q") if name in told else repr(float(d.pose[arm.model.jnt_qposadr[j]]))
            lines.append(f"{_quoted(name)} = {_quoted(formula)}")
    for c in cylinders:
        for body, at, towards in (("barrel", c.base, c.eye), ("rod", c.eye, c.base)):
            lines += ["", "[[aim]]", f"body = {_quoted(f'{c.name}.{body}')}", f"at = {_quoted(at)}",
                      f"towards = {_quoted(towards)}"]  # fmt: skip
        for chamber, begin, end in (("chamber_1", "cap_inside", "piston_back"),
                                    ("chamber_2", "piston_front", "gland_inside")):  # fmt: skip
            lines += ["", "[[stretch]]", f"geom = {_quoted(f'{c.name}.{chamber}')}",
                      f"from = {_quoted(f'{c.name}.{begin}')}", f"to = {_quoted(f'{c.name}.{end}')}"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A basic string of TOML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
