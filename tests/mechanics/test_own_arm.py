"""An arm of the user's own: closed forms, conservation, the project's own arm, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.core.sea import GRAVITY
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.own_arm.description import Description
from deepsea_cosim.mechanics.own_arm.reading import read
from deepsea_cosim.mechanics.own_arm.remarks import not_acted_on
from deepsea_cosim.mechanics.own_arm.simulation import OwnArm
from deepsea_cosim.mechanics.own_arm.variables import table_of
from deepsea_cosim.mechanics.own_arm.water import drag_of_bar
from deepsea_cosim.mechanics.variables import ARM

EXAMPLE = Path(__file__).parents[2] / "examples" / "boom_and_stick"

BAR = """<mujoco><worldbody><site name="base" pos="0.36 0 -0.322"/>
<body euler="0 {tilt} 0"><joint name="pivot" type="hinge" axis="0 -1 0"/>
<geom name="beam" type="cylinder" fromto="0 0 0 1.605 0 0" size="0.05" mass="50"/>
<site name="eye" pos="0.212 0 0"/>{more}</body></worldbody>
<tendon><spatial name="ram"><site site="base"/><site site="eye"/></spatial></tendon></mujoco>"""

CHAIN = """<mujoco><compiler angle="degree"/><worldbody><site name="base" pos="0.3 0 -0.3"/>
<body euler="0 -30 0"><joint name="yaw" axis="0 0 1"/><joint name="pitch" axis="0 -1 0"/>
<geom name="one" type="cylinder" fromto="0 0 0 1.5 0 0" size="0.05" mass="30"/><site name="eye" pos="0.5 0 0"/>
<body pos="1.5 0 0" euler="20 50 0"><joint name="elbow" axis="0 -1 0"/>
<geom name="two" type="cylinder" fromto="0 0 0 1 0 0" size="0.04" mass="15"/></body></body></worldbody>
<tendon><spatial name="ram"><site site="base"/><site site="eye"/></spatial></tendon></mujoco>"""


def arm(tmp_path, text, water=None, dry=False, **parameters):
    path = tmp_path / "arm.xml"
    path.write_text(text)
    table = None
    if water is not None:
        table = tmp_path / "water.toml"
        table.write_text(water)
    d = read(path, table, dry)
    return OwnArm(d, table_of(d).parameters(parameters))


def energy(it):
    """Kinetic energy, with the water's, and potential one less buoyancy [J]."""
    m, d = it.model, it.data
    kinetic = 0.5 * d.qvel @ it.M @ d.qvel
    height = sum(m.body_mass[k] * d.xipos[k, 2] for k in range(1, m.nbody)) * GRAVITY
    lift = sum(it.p["rho_s"] * w.volume * d.geom(w.geom).xpos[2] for w in it.d.wet if w.lifted) * GRAVITY
    return kinetic + height - lift


@pytest.mark.parametrize("dry", [True, False], ids=["dry", "wet without drag"])
def test_nothing_is_lost_without_drag(tmp_path, dry):
    """Three joints about different axes, falling freely: with the water that moves along, too."""
    it = arm(tmp_path, CHAIN, dry=dry, drag=0.0)
    it.data.qvel[:] = 0.8, 0.0, 1.0
    it.settle()
    first, most = energy(it), 0.0
    for k in range(1500):
        it.step(k * 1e-3, 1e-3, np.zeros(1))
        most = max(most, 0.5 * it.data.qvel @ it.M @ it.data.qvel)
        assert energy(it) == pytest.approx(first, abs=2e-3 * most + 1e-3)
    assert most > 100.0


def test_a_bar_in_still_water_is_a_pendulum_with_its_added_mass(tmp_path):
    """Hanging, without drag: omega^2 = (m - rho V) g L/2 / (m L^2/3 + rho (C_M - 1) V L^2/3)."""
    it = arm(tmp_path, BAR.format(tilt=89, more=""), drag=0.0)
    V, L = np.pi / 4 * 0.1**2 * 1.605, 1.605
    own = 50 * (L**2 / 12 + 0.05**2 / 4) + 50 * L**2 / 4
    assert it.M[0, 0] == pytest.approx(own + 1025 * V * L**2 / 3, rel=1e-6)  # MJCF texts have six digits
    expected = 2 * np.pi / np.sqrt((50 - 1025 * V) * GRAVITY * L / 2 / it.M[0, 0])
    angles = []
    for k in range(8000):
        it.step(k * 1e-3, 1e-3, np.zeros(1))
        angles.append(it.data.qpos[0] + np.radians(1.0))
    a = np.array(angles)
    up = np.flatnonzero((a[:-1] < 0) & (a[1:] >= 0))
    assert np.diff(up - a[up] / (a[up + 1] - a[up])).mean() * 1e-3 == pytest.approx(expected, rel=1e-3)


def test_a_ball_swings_with_half_of_its_water(tmp_path):
    """omega^2 = (m - rho V) g L / (I + (m + rho V / 2) L^2), without a table of coefficients."""
    ball = BAR.replace('<geom name="beam" type="cylinder" fromto="0 0 0 1.605 0 0" size="0.05" mass="50"/>',
                       '<geom name="ball" type="sphere" pos="1 0 0" size="0.1" mass="30"/>')  # fmt: skip
    it = arm(tmp_path, ball.format(tilt=89, more=""), drag=0.0)
    V = np.pi * 0.2**3 / 6
    assert it.M[0, 0] == pytest.approx(30 * (0.4 * 0.1**2 + 1.0) + 0.5 * 1025 * V, rel=1e-6)


def test_what_an_arm_leaves_out_is_told(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(BAR.format(tilt=0, more=""))
    assert not_acted_on(path, ["pivot"]) == ()
    text = BAR.format(tilt=0, more="").replace("<mujoco>", '<mujoco><option gravity="0 -9.81 0"/>')
    path.write_text(text.replace('name="pivot"', 'name="pivot" limited="true" range="-3 3" frictionloss="2"'))
    limits, losses, gravity = not_acted_on(path, ["pivot"])
    assert limits == "the limits of pivot"
    assert losses == "the friction loss of pivot"
    assert "(0, -9.81, 0)" in gravity


def test_it_is_the_projects_arm_where_both_can_be(tmp_path):
    """A beam with a load, cylinder without mass: holding force and motion against a current, by other equations."""
    bare = {"barrel_mass": 1e-3, "barrel_diameter": 1e-3, "rod_mass": 1e-3, "rod_diameter": 1e-4, "piston_mass": 0.0,
            "C_M": 1.0}  # which the project's arm takes in full, as Eq. 29 does
    other = Arm(ARM.parameters({**bare, "current_speed": 0.5}))
    load = f'<body pos="1.605 0 0"><inertial pos="0 0 0" mass="{800 / GRAVITY}" diaginertia="1e-9 1e-9 1e-9"/></body>'
    it = arm(tmp_path, BAR.format(tilt=-np.degrees(ARM["theta0"].start), more=load), current_speed=0.5)
    assert it.F_hold[0] == pytest.approx(float(other.F_hold), rel=1e-5)
    for k in range(1000):
        F = float(other.F_hold) * (1.0 + 0.1 * np.sin(3e-3 * k))
        it.step(k * 1e-3, 1e-3, np.array([F]))
        other.step(k * 1e-3, 1e-3, F)
    assert it.lengths[0] - it.start[0] == pytest.approx(float(other.out[0]), rel=2e-4)
    assert it.speeds[0] == pytest.approx(float(other.out[1]), rel=2e-4)


def test_drag_of_a_turning_bar_is_its_integral():
    axis, u, omega = np.array([0.6, 0.0, 0.8]), np.array([0.3, 0.2, 0.1]), np.array([0.1, 0.4, -0.2])
    force, torque = drag_of_bar(2.0, 0.1, 1.2, tuple(axis), tuple(u), tuple(omega), 1025.0)
    s = (np.arange(20000) + 0.5) / 10000 - 1.0
    flow = u - np.outer(s, np.cross(omega, axis))
    flow -= np.outer(flow @ axis, axis)
    loads = 0.5 * 1025 * 1.2 * 0.1 * np.linalg.norm(flow, axis=1)[:, None] * flow / 10000
    assert force == pytest.approx(loads.sum(axis=0), rel=1e-3)
    assert torque == pytest.approx(np.cross(axis, s @ loads), rel=1e-3, abs=1e-3)


def test_the_example_rests_in_the_hands_of_its_cylinders():
    d = read(EXAMPLE / "arm.xml", EXAMPLE / "water.toml", name="Boom and stick!")
    assert (d.name, d.tendons, d.joints) == (
        "Boom_and_stick_", ("boom_cylinder", "stick_cylinder"), (("boom", "rad"), ("stick", "rad")),
    )  # fmt: skip
    assert {w.geom: (w.C_D, w.C_M) for w in d.wet} == {"boom": (1.2, 2.0), "stick": (1.2, 2.0), "grab": (0.5, 1.5)}
    assert Description.of(d.as_data()) == d
    it = OwnArm(d, table_of(d).parameters({}))
    assert it.unheld < 1e-9
    for k in range(200):
        it.step(k * 1e-3, 1e-3, it.F_hold)
    assert np.abs(it.lengths - it.start).max() < 1e-9


def test_a_restored_state_goes_on_bitwise(tmp_path):
    it = arm(tmp_path, CHAIN)
    for k in range(20):
        it.step(k * 1e-3, 1e-3, np.array([100.0]))
    kept = it.state()
    rows = []
    for _ in range(2):
        for k in range(20, 40):
            it.step(k * 1e-3, 1e-3, np.array([200.0]))
        rows.append(it.state())
        it.restore(kept)
    assert rows[0] == rows[1]


def test_boxes_and_ellipsoids_are_bars_of_their_volume(tmp_path):
    text = BAR.format(tilt=0, more='<geom name="box" type="box" size="0.5 0.1 0.05" pos="0.5 0 0"/>'
                                   '<geom name="egg" type="ellipsoid" size="0.1 0.4 0.2" pos="0.5 0 0"/>')  # fmt: skip
    wet = {w.geom: w for w in arm(tmp_path, text).d.wet}
    assert (wet["box"].axis, wet["egg"].axis) == (0, 1)
    assert wet["box"].volume == pytest.approx(8 * 0.5 * 0.1 * 0.05)
    assert wet["egg"].volume == pytest.approx(4 / 3 * np.pi * 0.1 * 0.4 * 0.2)


@pytest.mark.parametrize(("text", "water", "words"), [
    (BAR.replace('<tendon><spatial name="ram"><site site="base"/><site site="eye"/></spatial></tendon>', ""), None,
     "has no tendon"),
    (BAR.replace(' name="ram"', ""), None, "tendon 1 has no name"),
    (BAR.replace("</mujoco>", '<equality><joint joint1="pivot"/></equality></mujoco>'), None, "which are not followed"),
    (BAR.replace('<joint name="pivot" type="hinge" axis="0 -1 0"/>', ""), None, "nothing moves"),
    (BAR.replace("<mujoco>", "<mujoco"), None, "no MJCF model"),
    (BAR.replace('site="eye"/>', 'site="nose"/>'), None, "MuJoCo"),
    (BAR, '[[geom]]\nname = "bean"', "did you mean 'beam'"),
    (BAR, '[[geom]]\nname = "beam"\nlift = true', "did you mean 'lifted'"),
    (BAR, '[[geom]]\nname = "beam"\ndiameter = 0', "has to be positive"),
    (BAR, '[[geom]]\nC_D = 1', "'name' is missing"),
    (BAR, "", "has no [[geom]]"),
], ids=lambda x: str(x)[-24:])  # fmt: skip
def test_what_cannot_be_is_one_line(tmp_path, text, water, words):
    with pytest.raises(PackageError) as caught:
        arm(tmp_path, text.format(tilt=0, more="") if "{tilt}" in text else text, water)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_that_is_no_text_is_one_line(tmp_path):
    text = BAR.format(tilt=0, more="").encode()
    (tmp_path / "arm.xml").write_bytes(text.replace(b'joint name="', b'joint name="\x8b', 1))
    with pytest.raises(PackageError, match="a name in it is no UTF-8 text"):
        read(tmp_path / "arm.xml")


def test_bodies_without_geoms_are_in_no_water(tmp_path):
    text = BAR.replace('<geom name="beam" type="cylinder" fromto="0 0 0 1.605 0 0" size="0.05" mass="50"/>',
                       '<inertial pos="0.8 0 0" mass="50" diaginertia="0.1 10 10"/>')  # fmt: skip
    assert arm(tmp_path, text.format(tilt=0, more="")).d.wet == ()
