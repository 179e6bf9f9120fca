"""Where `cosim-fmus arm` takes a model from."""

from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.fmus import cli
from deepsea_cosim.fmus.build_arm import build_arm, place
from deepsea_cosim.mechanics.own_arm.reading import read
from deepsea_cosim.mechanics.own_arm.remarks import loose_joints, without_direction
from deepsea_cosim.mechanics.own_arm.simulation import OwnArm
from deepsea_cosim.mechanics.own_arm.variables import table_of

PUBLISHED = Path(__file__).parents[2] / "examples" / "published_arm"


def test_a_model_may_be_in_a_package(tmp_path):
    import deepsea_cosim.fmus as package

    assert place(Path("deepsea_cosim.fmus:cli.py")) == Path(package.__file__).parent / "cli.py"
    for plain in ("arm.xml", "C:arm.xml", str(tmp_path / "a:b.xml")):
        assert place(Path(plain)) == Path(plain)
    for missing in ("no_such_package:arm.xml", "no_such.package:arm.xml"):
        with pytest.raises(PackageError, match="no Python package"):
            place(Path(missing))


def test_the_published_arm_rests_in_its_cylinders():
    pytest.importorskip("gymnasium", reason="the example's model is in that package")
    model = place(Path("gymnasium:envs/mujoco/assets/pusher_v5.xml"))
    d = read(model, PUBLISHED / "water.toml", cylinders=PUBLISHED / "cylinders.toml")
    assert d.tendons == ("lift", "elbow")
    assert d.joints == (("r_shoulder_lift_joint", "rad"), ("r_elbow_flex_joint", "rad"))
    it = OwnArm(d, table_of(d).parameters({}))
    assert (loose_joints(it), it.unheld < 1e-9) == ((), True)
    assert it.F_hold == pytest.approx([59.1, 22.8], abs=0.1)
    assert (it.levers[0, 1] < -0.15, it.levers[1, 3] < -0.05) == (True, True)  # what extends turns them back and up
    for k in range(100):
        it.step(k * 1e-3, 1e-3, it.F_hold)
    assert np.abs(it.lengths - it.start).max() < 1e-9


def test_a_dry_arm_has_no_table_of_its_water(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["arm", "arm.xml", "--dry", "--water", "water.toml"])
    assert caught.value.code == 2
    assert "--dry" in capsys.readouterr().err


def test_a_cylinder_of_no_length_is_refused_before_anything_is_built(tmp_path):
    """A drive on a hinge has none either, and needs none."""
    model = tmp_path / "arm.xml"
    text = (
        '<mujoco><worldbody><site name="base" pos="0.3 0 {z}"/><body><joint name="j" axis="0 -1 0"/>'
        '<geom type="capsule" fromto="0 0 0 1 0 0" size="0.05"/><site name="eye" pos="0.3 0 0"/></body></worldbody>'
        '<tendon><spatial name="ram"><site site="base"/><site site="eye"/></spatial>'
        '<fixed name="drive"><joint joint="j" coef="0.1"/></fixed></tendon></mujoco>'
    )
    model.write_text(text.format(z=0))
    with pytest.raises(PackageError, match="cylinder ram: base and eye are in one place"):
        build_arm(model, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    model.write_text(text.format(z=-0.3))
    d = read(model)
    assert without_direction(OwnArm(d, table_of(d).parameters({}))) == ()
