"""Models that somebody else made: cylinders put into them, joints held, bodies left out, and what MJCF may have."""

import mujoco
import numpy as np
import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.core.sea import GRAVITY
from deepsea_cosim.mechanics.own_arm.description import Description
from deepsea_cosim.mechanics.own_arm.reading import read
from deepsea_cosim.mechanics.own_arm.remarks import bare_bodies, loose_joints
from deepsea_cosim.mechanics.own_arm.simulation import OwnArm
from deepsea_cosim.mechanics.own_arm.variables import table_of

ROBOT = """<mujoco><compiler angle="radian" inertiafromgeom="true"/><option density="1000" gravity="0 0 0"/>
<asset><texture name="grid" type="2d" builtin="checker" width="8" height="8"/><material name="grey" texture="grid"/>
<mesh name="tetra" vertex="0 0 0 0.3 0 0 0 0.3 0 0 0 0.3"/></asset>
<default><joint damping="2"/><geom material="grey"/><site material="grey"/></default>
<worldbody><geom name="floor" type="plane" size="1 1 0.1" pos="0 0 -1"/>
<body name="base"><geom name="foot" type="mesh" mesh="tetra"/><joint name="pan" axis="0 0 1"/>
<body name="upper"><joint name="lift" axis="0 -1 0"/>
<geom name="upper" type="capsule" fromto="0 0 0 0.5 0 0" size="0.04"/>
<body name="fore" pos="0.5 0 0"><joint name="elbow" axis="0 -1 0"/><site name="mark"/>
<geom name="fore" type="capsule" fromto="0 0 0 0.4 0 0" size="0.03"/>
<body name="thumb" pos="0.4 0 0"><joint name="thumb" axis="0 0 1"/><geom size="0.02"/></body>
<body name="finger" pos="0.4 0.05 0"><joint name="finger" axis="0 0 1"/><geom size="0.02"/></body></body></body></body>
<body name="ball" pos="1 0 0"><freejoint name="ball"/><geom size="0.1"/></body></worldbody>
<contact><pair geom1="fore" geom2="floor"/></contact>
<tendon><fixed name="grasp"><joint joint="thumb" coef="0.5"/><joint joint="finger" coef="0.5"/></fixed></tendon>
<equality><joint name="couple" joint1="thumb" joint2="finger"/></equality>
<actuator><motor joint="lift"/></actuator>
<sensor><jointpos joint="lift"/><framepos objtype="body" objname="ball"/></sensor>
<keyframe><key name="ready" qpos="0.1 0.4 -0.9 0.2 0.2 1 0 0 1 0 0 0"/></keyframe></mujoco>"""

TABLE = """without = ["ball", "couple"]
held = ["pan", "thumb", "fin*"]
[[cylinder]]
name = "boom"
base = "base"
base_at = [0.05, 0, -0.2]
eye = "upper"
eye_at = [0.2, 0, -0.05]
[[cylinder]]
name = "stick"
base = "upper"
base_at = [0.1, 0, 0.1]
eye = "fore"
eye_at = [-0.05, 0, 0.05]
"""


def description(tmp_path, table=TABLE, text=ROBOT, **options):
    (tmp_path / "robot.xml").write_text(text)
    cylinders = None
    if table is not None:
        cylinders = tmp_path / "cylinders.toml"
        cylinders.write_text(table)
    return read(tmp_path / "robot.xml", cylinders=cylinders, **options)


def simulated(d, **parameters):
    return OwnArm(d, table_of(d).parameters(parameters))


def test_cylinders_are_put_into_a_model_that_has_none(tmp_path):
    d = description(tmp_path)
    assert (d.tendons, d.joints, d.held) == (
        ("boom", "stick"), (("lift", "rad"), ("elbow", "rad")), ("pan", "thumb", "finger"),
    )  # fmt: skip
    assert Description.of(d.as_data()) == d
    assert "ball" not in d.xml
    it = simulated(d)
    assert it.lengths[0] == pytest.approx(np.hypot(0.15, 0.15))
    assert it.unheld < 1e-9
    assert loose_joints(it) == bare_bodies(it) == ()
    for k in range(300):
        it.step(k * 1e-3, 1e-3, it.F_hold + np.array([50.0, 0.0]))
    assert it.lengths[0] - it.start[0] > 1e-3
    assert np.abs(it.data.qpos[[0, 3, 4]]).max() == 0.0  # what is held has not moved at all


def test_held_joints_are_those_of_a_model_without_them(tmp_path):
    """The same arm whose other joints were taken out of the text moves the same."""
    text = ROBOT.replace('<joint name="pan" axis="0 0 1"/>', "")
    for name in ("thumb", "finger"):
        text = text.replace(f'<joint name="{name}" axis="0 0 1"/>', "")
    for part in ("tendon", "equality", "keyframe"):
        start, end = text.index(f"<{part}>"), text.index(f"</{part}>") + len(f"</{part}>")
        text = text[:start] + text[end:]
    one = simulated(description(tmp_path))
    other = simulated(description(tmp_path, TABLE.replace(', "couple"', "").replace("held = ", "#"), text))
    assert other.model.nv == 2
    for k in range(300):
        for it in (one, other):
            it.step(k * 1e-3, 1e-3, np.array([150.0, -20.0]))
    assert one.lengths == pytest.approx(other.lengths, rel=1e-9)
    assert np.abs(one.lengths - one.start).min() > 1e-4


def test_a_keyframe_counts_for_the_joints_that_stay(tmp_path):
    d = description(tmp_path, pose="ready")
    assert d.pose == (0.1, 0.4, -0.9, 0.2, 0.2)
    it = simulated(d)
    it.step(0.0, 0.1, it.F_hold)
    assert it.data.qpos == pytest.approx(d.pose, abs=1e-6)


def test_only_what_the_table_names_is_a_cylinder(tmp_path):
    table = 'without = ["ball", "couple"]\n[[cylinder]]\nname = "grasp"'
    d = description(tmp_path, table)
    assert d.tendons == ("grasp",)
    it = simulated(d)
    assert set(loose_joints(it)) == {"pan", "lift", "elbow"}
    assert bare_bodies(it) == ("base",)  # has a mesh only
    assert it.speeds.shape == (1,)


def test_masses_stay_and_nothing_needs_a_file(tmp_path):
    """Of meshes, too, whatever the compiler's options; materials without their pictures."""
    d = description(tmp_path)
    before, after = mujoco.MjModel.from_xml_string(ROBOT), mujoco.MjModel.from_xml_string(d.xml)
    for name in ("base", "upper", "fore", "thumb"):
        assert after.body(name).mass == pytest.approx(before.body(name).mass, rel=1e-5)
        assert after.body(name).inertia == pytest.approx(before.body(name).inertia, rel=1e-4)
    assert (after.nmesh, after.ntex, after.nu, after.nsensor, after.npair, after.nkey, after.neq) == (0,) * 7
    assert after.opt.density == 0.0
    assert {w.geom for w in d.wet} >= {"upper", "fore"}
    assert "foot" not in {w.geom for w in d.wet}


def test_light_damped_fingers_take_shorter_steps(tmp_path):
    """Held or not: the model's own dampers would burst in steps of 1 ms."""
    text = ROBOT.replace('<joint name="thumb" axis="0 0 1"/>', '<joint name="thumb" axis="0 0 1" damping="20"/>')
    free = simulated(description(tmp_path, TABLE.replace('"thumb", ', ""), text))
    assert free.longest < 1e-4
    free.data.qvel[3] = 1.0
    free.step(0.0, 5e-3, free.F_hold)
    assert abs(free.data.qvel[3]) < 1e-2
    assert simulated(description(tmp_path, TABLE, text)).longest == simulated(description(tmp_path)).longest


def test_gravity_is_that_of_the_sea(tmp_path):
    it = simulated(description(tmp_path, dry=True))
    masses = {name: float(it.model.body(name).mass[0]) for name in ("upper", "fore", "thumb", "finger")}
    reach = {"upper": 0.25, "fore": 0.7, "thumb": 0.9, "finger": 0.9}
    torque = -GRAVITY * sum(m * reach[name] for name, m in masses.items())
    assert it.load[1] == pytest.approx(torque, rel=1e-5)


@pytest.mark.parametrize(("table", "words"), [
    (None, "has <equality> constraints (couple)"),
    (TABLE.replace('"ball", ', '"bal", '), "without 'bal': no body, tendon or equality is called so; did you mean"),
    (TABLE.replace('"pan"', '"pen"'), "held 'pen': no joint is called so; did you mean 'pan'"),
    (TABLE.replace('base = "upper"', 'base = "uper"'), "cylinder stick: base: the model has no body 'uper'; did you"),
    (TABLE.replace('eye = "fore"\n', ""), "cylinder stick: 'eye' is missing"),
    (TABLE.replace("[0.1, 0, 0.1]", "[0.1, 0]"), "'base_at' has to be three numbers"),
    (TABLE.replace('"boom"', '"grasp"'), "cylinder grasp: the model has a tendon of that name"),
    (TABLE.replace('"boom"', '"stick"'), "cylinder stick: stands there 2 times"),
    (TABLE + '[[cylinder]]\nname = "gras"', "the model has no tendon of that name; did you mean 'grasp'"),
    (TABLE + '[[cylinder]]\nname = "x"', "needs base, base_at, eye and eye_at"),
    (TABLE.replace("held", "hold"), "unknown key 'hold'; did you mean 'held'"),
    (TABLE.replace('["pan", "thumb", "fin*"]', '["*"]'), "no joint is left that moves"),
    (TABLE.replace('base = "upper"', 'base = "fore"'), "cylinder stick: moves nothing, for no joint between its ends"),
    (TABLE.replace('"thumb"', '"elbow"'), "cylinder stick: moves nothing"),
    ('held = ["thumb", "finger"]\nwithout = ["couple"]', "cylinder grasp: moves nothing"),
], ids=lambda x: str(x)[-24:])  # fmt: skip
def test_what_cannot_be_is_one_line(tmp_path, table, words):
    with pytest.raises(PackageError) as caught:
        description(tmp_path, table)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
