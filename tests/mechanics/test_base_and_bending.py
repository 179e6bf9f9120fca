"""A base that moves, a beam that bends, vortices and a tether: closed forms, limits, conservation."""

import numpy as np
import pytest
from deepsea_cosim.core.sea import GRAVITY
from deepsea_cosim.mechanics import loads, stepping
from deepsea_cosim.mechanics.arm import Arm
from deepsea_cosim.mechanics.linkage import linkage
from deepsea_cosim.mechanics.variables import ARM, BASE

from .test_effects import LENGTH, THETA, arm, moment

DRY = {"rho_s": 0.0}
STILL = {"current_speed": 0.0}
GEOMETRY = tuple(ARM[name].start for name in ("rod_eye_radius", "base_x", "base_y"))


def moved(parameters=None, **base):
    """An arm whose base is given a motion, not yet moved on."""
    it = Arm(ARM.parameters(parameters or {}))
    for name, value in base.items():
        it.values[ARM.index(f"base.{name}")] = value
    stepping.take_base(it.values, it.row.ctypes.data, 0.0)
    return it


def holding(it):
    return -it.projection[loads.TORQUE] / it.projection[loads.LEVER]


def test_a_base_at_rest_changes_nothing():
    plain, other = Arm(ARM.parameters()), moved(**dict.fromkeys((name.split(".")[1] for name in BASE), 0.0))
    for it in (plain, other):
        for k in range(50):
            it.step(k * 1e-3, 1e-3, 8000.0)
    assert (plain.out == other.out).all()


def turned(pitch):
    """Parameters of the arm with beam and base hinge turned about the pivot."""
    x, y = ARM["base_x"].start, ARM["base_y"].start
    return {
        "theta0": THETA + pitch,
        "base_x": x * np.cos(pitch) - y * np.sin(pitch), "base_y": x * np.sin(pitch) + y * np.cos(pitch),
    }  # fmt: skip


@pytest.mark.parametrize("pitch", [-0.4, 0.1, 0.5])
def test_a_pitched_base_is_the_same_arm_turned(pitch):
    """In still water: beam and base hinge turned about the pivot by the pitch. With a current likewise."""
    for sea in ({**DRY, **STILL}, STILL, {}):
        other = Arm(ARM.parameters({**sea, **turned(pitch)}))
        assert holding(moved(sea, pitch=pitch)) == pytest.approx(other.F_hold, rel=2e-3)


def test_heave_is_a_heavier_arm():
    """In the air an upward acceleration of g/5 is a gravity of 6/5 g."""
    assert holding(moved(DRY, heave_acceleration=0.2 * GRAVITY)) == pytest.approx(1.2 * Arm(ARM.parameters(DRY)).F_hold)


def test_heave_drags_through_the_water():
    """Against a beam that the base lifts at w comes the water, 1/2 rho C_D D (w cos)^2 L^2/2; the rest is small."""
    it, still = moved(STILL, heave_rate=0.3), Arm(ARM.parameters(STILL))
    down = 0.5 * 1025.0 * 1.2 * 0.1 * (0.3 * np.cos(THETA)) ** 2 * LENGTH**2 / 2
    more = still.projection[loads.TORQUE] - it.projection[loads.TORQUE]
    assert more == pytest.approx(down, rel=0.01)


def test_pitching_up_leaves_the_beam_behind():
    """The generalised force of the base's angular acceleration is the mixed derivative of the kinetic energy."""
    p = ARM.parameters(DRY)
    q = 0.7
    it, still = moved(DRY, pitch_acceleration=q), Arm(ARM.parameters(DRY))

    def bodies(theta):
        """Centres (n, 2) and angles (n,) of beam, load, barrel and rod with piston."""
        L, _, _, phi, *_ = linkage(theta, *GEOMETRY)
        beam, rod = np.array([np.cos(theta), np.sin(theta)]), np.array([np.cos(phi), np.sin(phi)])
        hinge = np.array([p["base_x"], p["base_y"]])
        centre = L + it.c.rod.centre
        return (
            np.array([0.5 * LENGTH * beam, LENGTH * beam,
                      hinge + 0.5 * p["barrel_length"] * rod, hinge + centre * rod]),
            np.array([theta, theta, phi, phi]),
        )  # fmt: skip

    h = 1e-5
    (above, angles_above), (below, angles_below), (at, _) = bodies(THETA + h), bodies(THETA - h), bodies(THETA)
    speed, turn = (above - below) / (2 * h), (angles_above - angles_below) / (2 * h)
    mass = np.array([p["beam_mass"], p["load_weight"] / GRAVITY, p["barrel_mass"], it.c.rod.mass])
    body = it.model.body
    own = np.array([body(name).inertia[1] for name in ("beam", "load", "barrel", "rod")])
    by_pitch = np.column_stack([-at[:, 1], at[:, 0]])
    mixed = (mass * (speed * by_pitch).sum(axis=1) + own * turn).sum()
    force = it.projection[loads.TORQUE] - still.projection[loads.TORQUE]
    assert force == pytest.approx(-q * mixed, rel=1e-6)


def test_a_swell_is_what_the_inputs_would_say():
    """Up to the acceleration, which is held during a step: an error of first order."""
    swell = {"base_motion__heave": 0.4, "base_motion__pitch": 0.05, "base_motion__frequency": 0.15}
    rate, apart = 2 * np.pi * 0.15, []
    for h in (2e-3, 1e-3):
        one, other, still = arm(**swell), arm(), arm()
        for k in range(round(1.0 / h)):
            up, ahead = np.sin(rate * k * h), rate * np.cos(rate * k * h)
            wave = (0.4 * ahead, -0.4 * rate**2 * up, 0.05 * up, 0.05 * ahead, -0.05 * rate**2 * up)
            for name, value in zip(BASE, wave, strict=True):
                other.values[ARM.index(name)] = value
            for it in (one, other, still):
                it.step(k * h, h, 7000.0)
        apart.append(abs(other.theta - one.theta))
    assert apart[1] == pytest.approx(apart[0] / 2, rel=0.05)
    assert abs(one.theta - still.theta) > 100 * apart[1]


def free(it, seconds, h=1e-3):
    """Deflection over time under the force that holds the arm at first."""
    made = []
    for k in range(round(seconds / h)):
        it.step(k * h, h, it.F_hold)
        made.append(it.row[stepping.SAG])
    return np.array(made)


def test_a_bending_beam_swings_at_its_frequency():
    """sqrt(k/m J/(J - m L^2)) of spring and both masses, the arm being free to turn."""
    bending = {"effect.beam_flexibility.period": 0.2, "effect.beam_flexibility.damping": 0.0}
    it = Arm(ARM.parameters({**DRY, **STILL, **bending}))
    J = Arm(ARM.parameters({**DRY, **STILL})).projection[loads.MASS]
    m = it.c.bending.mass
    it.row[stepping.SAG] += 1e-4
    stepping.evaluate(it.row.ctypes.data, it.theta, 0.0, 0.0, 0.0)
    w = free(it, 3.0, 1e-4)
    w -= w.mean()
    up = np.flatnonzero((w[:-1] < 0) & (w[1:] >= 0))
    cross = up - w[up] / (w[up + 1] - w[up])
    period = np.diff(cross).mean() * 1e-4
    assert period == pytest.approx(0.2 * np.sqrt((J - m * LENGTH**2) / J), rel=2e-3)
    assert np.abs(w[-3000:]).max() == pytest.approx(np.abs(w[:3000]).max(), rel=0.02)  # nothing is lost


def test_a_bending_beam_starts_at_rest_and_tends_to_a_stiff_one():
    it = arm(beam_flexibility__period=0.3)
    assert it.F_hold == pytest.approx(arm().F_hold, rel=1e-12)
    assert np.ptp(free(it, 0.5)) < 1e-9
    gaps = []
    for period in (0.2, 0.1, 0.05):
        bending, stiff = arm(beam_flexibility__period=period, beam_flexibility__damping=0.5), arm()
        for k in range(1000):
            force = stiff.F_hold * (1.0 + 0.02 * np.sin(3.0 * k * 1e-3) ** 2)
            bending.step(k * 1e-3, 1e-3, force)
            stiff.step(k * 1e-3, 1e-3, force)
        gaps.append(abs(bending.theta - stiff.theta))
    assert gaps[0] > 2.5 * gaps[1] > 5.0 * gaps[2] > 0.0


def test_vortices_push_at_the_strouhal_frequency():
    it = arm(viv__C_L=0.8)
    largest = 0.25 * 1025.0 * 0.8 * 0.1 * 0.5**2 * LENGTH**2
    for k in range(1000):
        it.step(k * 1e-3, 1e-3, it.F_hold)
    assert it.row[stepping.PHASE] == pytest.approx(2 * np.pi * 0.2 * 0.5 / 0.1, rel=1e-9)
    at = Arm(ARM.parameters({"effect.viv.C_L": 0.8, "effect.viv.phase": np.pi / 2}))
    assert at.projection[loads.TORQUE] - arm().projection[loads.TORQUE] == pytest.approx(largest, rel=1e-9)


def test_a_tether_pulls_back_and_drags():
    it = arm(tether__stiffness=500.0, tether__drag=20.0)
    assert it.F_hold == arm().F_hold
    c, plain = it.c, arm().c
    from deepsea_cosim.mechanics.effects import extra_torque

    for theta, omega in ((THETA + 0.2, 0.0), (THETA, 0.3), (THETA, -0.3)):
        more = extra_torque(theta, omega, LENGTH, c) - extra_torque(theta, omega, LENGTH, plain)
        spring, drag = 500.0 * LENGTH**2 * (theta - THETA), 20.0 * LENGTH**3 * omega * abs(omega)
        assert more == pytest.approx(-spring - drag)


def torque_of(u):
    """Torque [N m] of the drag of a current profile u(l) along the beam at rest, by quadrature."""
    l = (np.arange(4000) + 0.5) / 4000 * LENGTH  # noqa: E741
    return (0.5 * 1025.0 * 1.2 * 0.1 * u(l / LENGTH) * np.abs(u(l / LENGTH)) * l).sum() * LENGTH / 4000


def test_a_current_that_grows_along_the_beam():
    normal = -0.5 * np.sin(THETA)
    even, sheared = moment(arm()), moment(arm(current_error__shear=1.5))
    expected = torque_of(lambda s: normal + 0.0 * s) - torque_of(lambda s: normal * (1.0 + 1.5 * (s - 0.5)))
    assert sheared - even == pytest.approx(expected, rel=1e-5)


def test_drag_and_growth_on_the_outer_part_of_the_beam():
    half = moment(arm(drag_coefficient__scale=3.0, drag_coefficient__part=0.5)) - moment(arm())
    normal = -0.5 * np.sin(THETA)
    assert half == pytest.approx(-2.0 * torque_of(lambda s: normal * (s > 0.5)), rel=0.05)  # and of the cylinder
    water = [arm(marine_growth__thickness=0.02, marine_growth__part=part).projection[loads.MASS] for part in (1.0, 0.5)]
    missing = 1025 * 2.0 * np.pi / 12 * (0.5 * LENGTH) ** 3 * (0.14**2 - 0.10**2)
    assert water[0] - water[1] == pytest.approx(missing, rel=1e-9)
    assert sum(arm(marine_growth__part=0.5).out) == pytest.approx(sum(arm().out), rel=1e-12)


def test_a_load_beyond_the_end_weighs_more_about_the_pivot():
    off = arm(payload_error__along=0.2)
    assert moment(off) - moment(arm()) == pytest.approx(800.0 * 0.2 * np.cos(THETA), rel=1e-9)
    inertia = 800.0 / GRAVITY * ((LENGTH + 0.2) ** 2 - LENGTH**2)
    assert off.projection[loads.MASS] - arm().projection[loads.MASS] == pytest.approx(inertia, rel=1e-9)


@pytest.mark.parametrize("along", [-0.5, -0.1, 0.3])
def test_a_bending_beam_whose_load_does_not_hang_at_its_end(along):
    """What swings takes all the load's inertia along, so that the same is left as of a load at the end."""
    bending = {"beam_flexibility__period": 0.2, "payload_error__along": along}
    it, at_end = arm(**bending), arm(beam_flexibility__period=0.2)
    assert it.projection[loads.MASS] == pytest.approx(at_end.projection[loads.MASS], rel=1e-9)
    assert it.F_hold == pytest.approx(arm(payload_error__along=along).F_hold, rel=1e-12)
    assert np.ptp(free(it, 0.5)) < 1e-9


@pytest.mark.parametrize("pitch", [-0.4, 0.5])
def test_buoyancy_stays_upright_on_a_pitched_base(pitch):
    """In still water all is the arm turned, that force and the outer rod's buoyancy, too."""
    lifted = {**STILL, "effect.buoyancy_error.force": 300.0, "rod_diameter": 0.1}
    assert holding(moved(lifted, pitch=pitch)) == pytest.approx(Arm(ARM.parameters({**lifted, **turned(pitch)})).F_hold)


def test_a_base_that_stays_turned_is_restored():
    """Held where it is, it tells an arm that is built anew of no change."""
    it, other = moved(pitch=0.2), Arm(ARM.parameters())
    it.step(0.0, 0.1, 8000.0)
    other.values[:] = it.values
    other.set_state(it.get_state())
    for a in (it, other):
        a.step(0.1, 0.1, 7000.0)
    assert (it.out == other.out).all()


@pytest.mark.parametrize("changes", [{"effect.marine_growth.thickness": 1e-15, "effect.marine_growth.part": 0.5},
                                     {"effect.current_error.shear": 1e-9}])  # fmt: skip
def test_as_printed_the_drag_is_so_where_it_varies_along_the_beam(changes):
    """By so little that nothing changes but the way it is computed."""
    for omega in (0.0, 0.3, -0.3):
        plain, varied = (Arm(ARM.parameters({"drag_as_printed": 1.0, **more})).c for more in ({}, changes))
        assert varied.switch.drag_varies > 0.0
        assert loads.beam_torque(0.2, omega, varied) == pytest.approx(loads.beam_torque(0.2, omega, plain), rel=1e-6)
