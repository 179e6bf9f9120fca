"""What an FMU carries to be drawn: formulas in it, what moves, aims and stretches, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.errors import PackageError, UsageError
from deepsea_cosim.master.replay.motion import aimed, along, names
from deepsea_cosim.master.replay.stage import bounds, build

from .made import RAM, RULES, filmed, made_run, ram, site_distance


def test_a_longer_beam_is_drawn_longer():
    long = made_run(parameters={"arm.long": 2.5, "arm.foot": 0.4, "arm.lead": 0.0})
    for run, length in ((made_run(), 1.0), (long, 2.5)):
        film = filmed(ram(), run, [0.0, 2.0])
        assert 2.0 * film.model.geom("arm/beam").size[1] == pytest.approx(length)


def test_rods_aim_and_oil_reaches_from_site_to_site():
    film = filmed(ram(), made_run(), np.linspace(0.0, 2.0, 9))
    angle = np.linspace(0.0, 1.0, 9)
    apart = np.hypot(np.cos(angle) - 0.4, np.sin(angle))
    assert site_distance(film, "arm/eye", "arm/foot") == pytest.approx(apart, abs=1e-12)
    assert site_distance(film, "arm/end", "arm/foot") == pytest.approx(apart - 0.1, abs=1e-12)
    assert 2.0 * film.half[:, 0] == pytest.approx(apart - 0.1, abs=1e-12)


@pytest.mark.parametrize("way", [(1, 0, 0), (-1, 0, 0), (0, 0, -2), (0.3, -0.4, 0.1), (0, 0, 0)])
def test_turns_are_along_their_ways(way):
    import mujoco

    way = np.array(way, dtype=float)
    for turn, axis in ((aimed(way), 0), (along(way), 2)):
        found = np.empty(9)
        mujoco.mju_quat2Mat(found, turn)
        if way.any():
            assert found.reshape(3, 3)[:, axis] == pytest.approx(way / np.linalg.norm(way), abs=1e-9)


def test_scenes_stand_side_by_side_and_ghosts_where_theirs_do():
    sizes = {"long": 1.0, "foot": 0.4, "lead": 0.0}
    parameters = {f"{arm}.{name}": value for arm in "ab" for name, value in sizes.items()}
    run = made_run({f"{arm}.angle": [0.0, 1.0] for arm in "ab"}, parameters)
    stage = build([ram("a"), ram("b")], run, [(ram("b"), run)])
    a, b, ghost = stage.parts
    assert (a.prefix, b.prefix, ghost.prefix, ghost.ghost) == ("a/", "b/", "ghost b/", True)
    assert b.low[0] > a.high[0]
    assert np.abs(ghost.low - b.low).max() < 0.01
    assert stage.model.geom("ghost b/beam").rgba[3] < 0.5 < stage.model.geom("b/beam").rgba[3]


def test_the_floor_is_below_all_that_moves():
    run = made_run({"arm.angle": [0.0, -1.2]})
    stage = build([ram()], run)
    low, _ = bounds(ram().filled(run), run)
    assert stage.model.geom("replay floor").pos[2] < low[2] < -0.8


@pytest.mark.parametrize(
    ("xml", "rules", "told"),
    [
        (RAM.replace("{long}", "{lng}"), RULES, "arm.lng"),
        (RAM.replace("{long}", "{angle}"), RULES, "signal, no number"),
        (RAM.replace("{foot}", "{__import__('os')}"), RULES, "there is no function"),
        (RAM.replace("<worldbody>", '<include file="/etc/passwd"/><worldbody>'), RULES, "carries all that it needs"),
        (RAM.replace("<worldbody>", '<asset><mesh file="a.stl"/></asset><worldbody>'), RULES, "'a.stl' is not in"),
        (RAM.replace("<worldbody>", '<compiler meshdir="/"/><worldbody>'), RULES, "beside the scene"),
        (RAM.replace("</mujoco>", ""), RULES, "scene.xml"),
        (RAM.replace("capsule", "cone"), RULES, "MuJoCo does not read it"),
        (RAM, RULES.replace("q =", "p ="), "no joint 'p'"),
        (RAM, RULES.replace('"oil"', '"beam"'), "cylinder or capsule of the worldbody"),
        (RAM, RULES.replace('"rod"', '"arm"'), 'needs mocap="true"'),
        (RAM, RULES.replace("angle", "angel"), "arm.angel"),
        (RAM, RULES.replace("[[aim]]", "[[aims]]"), "did you mean 'aim'"),
        (RAM, RULES.replace("view = [90, 0]", "view = 90"), "view"),
    ],
)
def test_what_is_wrong_is_one_line(xml, rules, told):
    with pytest.raises((PackageError, UsageError)) as caught:
        filmed(ram(xml=xml, rules=rules), made_run(), [0.0])
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_of_the_model_begin_with_their_component():
    assert set(names(build([ram()], made_run()).model, "joint")) == {"arm/q"}
