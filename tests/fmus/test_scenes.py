"""What our FMUs carry for a replay draws what they compute."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from deepsea_cosim.fmus.build import CONTAINER, MODELS
from deepsea_cosim.fmus.own_scene import scene_of
from deepsea_cosim.master.replay.motion import names, places
from deepsea_cosim.master.replay.scene import parsed
from deepsea_cosim.mechanics.linkage import linkage
from deepsea_cosim.mechanics.own_arm.reading import read
from deepsea_cosim.mechanics.own_arm.simulation import OwnArm
from deepsea_cosim.mechanics.own_arm.variables import table_of
from deepsea_cosim.mechanics.variables import ARM

from ..master.replay.made import filmed, made_run, site_distance

EXAMPLES = Path(__file__).parents[2] / "examples"


def scene(files, component="arm"):
    texts = {name: content.decode() for name, content in files}
    return parsed(component, "X.fmu: resources/replay/", texts["scene.xml"], texts["replay.toml"], {})


def deepsea():
    return scene(next(m.scene for m in MODELS if m.name == "DeepseaArm"))


def arm_run(thetas, **changes):
    p = ARM.parameters(changes)
    return p, made_run({"arm.theta": thetas}, {f"arm.{name}": float(value) for name, value in p.items()})


@pytest.mark.parametrize("changes", [{}, {"beam_length": 3.0, "rod_eye_radius": 0.4, "base_x": 0.5, "base_y": -0.5}])
def test_the_cylinder_of_the_arm_is_that_of_the_linkage(changes):
    thetas = np.linspace(0.3, 1.6, 6)
    p, run = arm_run(thetas, **changes)
    film = filmed(deepsea(), run, run.times)
    length = [linkage.py_func(t, p["rod_eye_radius"], p["base_x"], p["base_y"])[0] for t in thetas]
    assert site_distance(film, "arm/base", "arm/rod_eye") == pytest.approx(length, abs=1e-9)
    assert site_distance(film, "arm/rod_eye", "arm/piston_back") == pytest.approx(np.full(6, p["rod_length"]), abs=1e-9)
    in_barrel = site_distance(film, "arm/base", "arm/piston_back")
    assert in_barrel == pytest.approx(np.array(length) - p["rod_length"], abs=1e-9)
    assert 2.0 * film.model.geom("arm/beam").size[1] == pytest.approx(p["beam_length"])


def test_the_arm_in_a_container_is_drawn_by_the_names_that_it_has_there():
    _, run = arm_run([0.4, 1.2])
    signals = {"m.arm.theta": run.signals["arm.theta"]}
    inside = made_run(signals, {f"m.{name}": value for name, value in run.parameters.items()})
    alone = site_distance(filmed(deepsea(), run, run.times), "arm/base", "arm/rod_eye")
    assert site_distance(
        filmed(scene(CONTAINER.scene, "m"), inside, run.times), "m/base", "m/rod_eye"
    ) == pytest.approx(alone)


def test_the_place_of_the_load_is_that_of_the_beams_end():
    thetas = [0.0, 0.5, 1.2]
    p, run = arm_run(thetas)
    film = filmed(deepsea(), run, run.times)
    known = names(film.model, "geom")
    [load, pivot] = np.moveaxis(places(film, [("geom", known["arm/load"]), ("geom", known["arm/pivot"])]), 1, 0)
    wanted = p["beam_length"] * np.array([[np.cos(t), 0.0, np.sin(t)] for t in thetas])
    assert load - pivot == pytest.approx(wanted, abs=1e-9)


@pytest.fixture(scope="module", params=["boom_and_stick", "published_arm"])
def own(request):
    if request.param == "boom_and_stick":
        return read(EXAMPLES / "boom_and_stick" / "arm.xml")
    gymnasium = pytest.importorskip("gymnasium", reason="the example's model is in that package")
    model = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "pusher_v5.xml"
    folder = EXAMPLES / "published_arm"
    return read(model, folder / "water.toml", cylinders=folder / "cylinders.toml")


def own_run(d, arm):
    """Outputs of the arm over some poses, as MuJoCo has them of the model in the FMU."""
    signals = {f"arm.{name}.q": [] for name, _ in d.joints} | {f"arm.{name}.length": [] for name in d.tendons}
    for k in range(5):
        arm.data.qpos[:] = d.pose
        for j, (name, _) in enumerate(d.joints):
            arm.data.joint(name).qpos[:] += 0.1 * k * (-1) ** j
            signals[f"arm.{name}.q"].append(float(arm.data.joint(name).qpos[0]))
        mujoco.mj_forward(arm.model, arm.data)
        for name in d.tendons:
            signals[f"arm.{name}.length"].append(float(arm.data.tendon(name).length[0]))
    return made_run(signals, {"arm.depth": 0.0})


def test_each_cylinder_of_an_own_arm_is_as_long_as_its_output(own):
    arm = OwnArm(own, table_of(own).parameters({}))
    run = own_run(own, arm)
    film = filmed(scene(scene_of(arm)), run, run.times)
    known = names(film.model, "body")
    for name in own.tendons:
        ends = places(film, [("body", known[f"arm/{name}.barrel"]), ("body", known[f"arm/{name}.rod"])])
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        assert np.ptp(length) > 0.01
        assert length == pytest.approx(run.signals[f"arm.{name}.length"], abs=1e-6)
        piston = site_distance(film, f"arm/{name}.cap_inside", f"arm/{name}.piston_back")
        room = site_distance(film, f"arm/{name}.cap_inside", f"arm/{name}.gland_inside")
        assert (piston < room).all()


def test_joints_that_are_held_stay_as_they_are(own):
    arm = OwnArm(own, table_of(own).parameters({}))
    made = scene(scene_of(arm))
    told = {name for name, _ in own.joints}
    assert {name for name, formula in made.joints.items() if formula == f"{name}.q"} == told
    assert set(made.joints) >= set(own.held)
