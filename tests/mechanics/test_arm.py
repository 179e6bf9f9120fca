"""The arm: kinematics, statics, energy, an independent pendulum, and the MJCF as a viewer sees it."""

import mujoco
import numpy as np
import pytest
from deepsea_cosim.core.errors import ParameterError
from deepsea_cosim.core.sea import GRAVITY
from deepsea_cosim.mechanics import stepping
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.linkage import linkage
from deepsea_cosim.mechanics.mjcf import mjcf
from deepsea_cosim.mechanics.mujoco_library import addresses
from deepsea_cosim.mechanics.variables import ARM, BEAM_STRIPS

NAMES = [v.name for v in ARM.of("output")]
DRY = {"rho_s": 0.0}
BARE = {**DRY, "barrel_mass": 1e-3, "rod_mass": 1e-3, "piston_mass": 0.0}
BEAM = ARM["beam_length"].start
GEOMETRY = tuple(ARM[name].start for name in ("rod_eye_radius", "base_x", "base_y"))


def outputs(arm):
    return dict(zip(NAMES, arm.out.tolist(), strict=True))


def swing(parameters, force, seconds, h=1e-3):
    arm = Arm(ARM.parameters(parameters))
    rows = []
    for k in range(round(seconds / h)):
        arm.step(k * h, h, force(k * h, arm))
        rows.append(arm.out.copy())
    return arm, {name: np.array(rows)[:, i] for i, name in enumerate(NAMES)}


def test_linkage_derivatives():
    for theta in (-0.5, 0.3, 1.2):
        h = 1e-5
        low, mid, high = (np.array(linkage(theta + s * h, *GEOMETRY)) for s in (-1, 0, 1))
        assert (high[0] - low[0]) / (2 * h) == pytest.approx(mid[1], rel=1e-8)
        assert (high[1] - low[1]) / (2 * h) == pytest.approx(mid[2], rel=1e-6)
        assert (high[3] - low[3]) / (2 * h) == pytest.approx(mid[4], rel=1e-8)
        assert (high[4] - low[4]) / (2 * h) == pytest.approx(mid[5], rel=1e-6)


def test_as_printed_the_current_loads_a_standing_arm_twice_as_much():
    as_is, printed = (Arm(ARM.parameters({"drag_as_printed": flag})) for flag in (False, True))
    for arm in (as_is, printed):
        arm.report(arm.F_hold)
    one, other = outputs(as_is), outputs(printed)
    for name in ("M_hd", "M_hd_cylinder"):
        assert other[name] == pytest.approx(2.0 * one[name], rel=1e-6)
    assert other["strip[3]"] == one["strip[3]"]


def test_holding_force_is_the_static_moment():
    arm = Arm(ARM.parameters({**BARE, "barrel_mass": 1e-3}))
    theta = ARM["theta0"].start
    _, lever, *_ = linkage(theta, *GEOMETRY)
    moment = (50.0 * GRAVITY / 2 + 800.0) * BEAM * np.cos(theta)
    assert arm.F_hold == pytest.approx(moment / lever, rel=1e-4)


@pytest.mark.parametrize("parameters", [{}, {"current_speed": -1.5}, {"load_weight": 0.0}])
def test_holding_force_holds(parameters):
    _, run = swing(parameters, lambda t, arm: arm.F_hold, 1.0)
    assert np.abs(run["v_h"]).max() < 1e-12
    assert np.abs(run["x_h"]).max() < 1e-12


def test_free_fall_conserves_energy():
    """Without water and force: kinetic energy by v_h and torques is what the weight lost."""
    arm, run = swing({**DRY, "current_speed": 0.0}, lambda t, arm: 0.0, 2.0, h=1e-3)
    theta, omega = run["theta"], run["omega"]
    kinetic = []
    heights = []
    for a, w in zip(theta, omega, strict=True):
        stepping.evaluate(arm.row.ctypes.data, a, w, 0.0, 0.0)
        kinetic.append(0.5 * arm.projection[0] * w * w)
        mujoco.mj_forward(arm.model, arm.data)
        heights.append(sum(arm.model.body_mass[i] * arm.data.xipos[i, 2] for i in range(1, arm.model.nbody)))
    energy = np.array(kinetic) + GRAVITY * np.array(heights)
    assert np.ptp(kinetic) > 500.0
    assert np.ptp(energy) < 1e-4 * np.ptp(kinetic)


def test_second_order_in_the_internal_step():
    ends = []
    for step in (4e-3, 2e-3, 1e-3, 1e-4):
        assert step <= stepping.MAX_STEP
        arm = Arm(ARM.parameters({"current_amplitude": 0.3, "current_frequency": 0.5}))
        for k in range(20):
            force = arm.F_hold * (1.0 + 0.3 * np.sin(3.0 * k))
            for i in range(round(0.04 / step)):
                arm.step(k * 0.04 + i * step, step, force)
        ends.append(arm.theta)
    errors = np.abs(np.array(ends[:3]) - ends[3])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.2)


def test_dry_bare_arm_is_a_physical_pendulum():
    """Small swings about the hanging position against the closed form of the period."""
    parameters = {**BARE, "theta0": -np.pi / 2 + 0.01, "load_weight": 100.0}
    _, run = swing(parameters, lambda t, arm: 0.0, 6.0)
    angle = run["theta"] + np.pi / 2
    crossings = np.flatnonzero(np.diff(np.sign(angle)) < 0) * 1e-3
    period = np.diff(crossings).mean()
    load, beam, L = 100.0 / GRAVITY, 50.0, BEAM
    inertia = beam * (L**2 / 3 + 0.05**2 / 4) + load * L**2
    stiffness = (beam * L / 2 + load * L) * GRAVITY
    assert period == pytest.approx(2 * np.pi * np.sqrt(inertia / stiffness), rel=2e-3)


def test_one_long_step_is_many_short_ones():
    a = Arm(ARM.parameters())
    b = Arm(ARM.parameters())
    a.step(0.0, 0.04, 8000.0)
    for k in range(10):
        b.step(k * 4e-3, 4e-3, 8000.0)
    assert a.theta == pytest.approx(b.theta, abs=1e-13)


def test_torques_are_consistent():
    """I alpha of the bare beam is the sum of the reported torques."""
    wet = {**BARE, "rho_s": 1025.0, "barrel_diameter": 1e-3, "rod_diameter": 1e-4}
    _, run = swing(wet, lambda t, a: 9000.0, 0.5)
    alpha = np.gradient(run["omega"], 1e-3)[100:-100]
    load, L = 800.0 / GRAVITY, BEAM
    inertia = 50.0 * (L**2 / 3 + 0.05**2 / 4) + load * L**2
    total = (run["M_hd"] + run["M_g"] + run["M_F"])[100:-100]
    assert inertia * alpha == pytest.approx(total, rel=2e-3)
    strips = sum(run[f"strip[{i}]"] * L * (i - 0.5) / BEAM_STRIPS for i in range(1, BEAM_STRIPS + 1))
    assert strips[100:-100] == pytest.approx(run["M_hd"][100:-100], rel=2e-2)


def test_positive_current_pushes_towards_retraction():
    held = [Arm(ARM.parameters({"current_speed": v})).F_hold for v in (-1.0, 0.0, 1.0)]
    assert held[0] < held[1] < held[2]


def test_sinusoidal_current_shakes_the_arm():
    _, run = swing({"current_amplitude": 0.4, "current_frequency": 0.5}, lambda t, arm: arm.F_hold, 2.0)
    assert run["v_oc"].max() == pytest.approx(0.9, abs=1e-3)
    assert np.abs(run["v_h"]).max() > 1e-5


def test_state_restores_bitwise():
    arm = Arm(ARM.parameters())
    arm.step(0.0, 0.1, 8000.0)
    state = arm.get_state()
    arm.step(0.1, 0.1, 7000.0)
    first = arm.out.copy()
    arm.set_state(state)
    arm.step(0.1, 0.1, 7000.0)
    assert (arm.out == first).all()


def test_mjcf_closes_the_loop_for_viewers():
    p = ARM.parameters()
    model = mujoco.MjModel.from_xml_string(mjcf(p))
    data = mujoco.MjData(model)
    L, _, _, phi, _, _ = linkage(1.0, p["rod_eye_radius"], p["base_x"], p["base_y"])
    data.qpos[:] = 1.0, phi, L
    mujoco.mj_forward(model, data)
    assert data.site("rod_eye").xpos == pytest.approx(data.site("beam_eye").xpos, abs=1e-12)
    assert sum(model.body_mass) == pytest.approx(50 + 800 / GRAVITY + 6 + 2 + 5)


def test_unbuildable_linkage_is_refused():
    with pytest.raises(ParameterError, match="cannot move the beam"):
        Arm(ARM.parameters({"rod_eye_radius": 0.001, "base_x": 0.001, "base_y": 0.0}))


def test_mujoco_does_not_ask_the_clock():
    """Its Python package switches timers on that take one part in fifteen of a run."""
    addresses()
    body = "<body><joint/><geom size='.1'/></body>"
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration == 0.0
