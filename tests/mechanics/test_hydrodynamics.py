import numpy as np
import pytest
from deepsea_cosim.mechanics.hydrodynamics import added_inertia, drag, inertia_per_length, printed_torque, wave
from scipy.integrate import quad

RHO, C_D, C_M, D = 1025.0, 1.2, 2.0, 0.1


@pytest.mark.parametrize(
    ("u", "w"), [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.3), (0.0, -0.3), (0.4, 0.5), (0.4, -0.5), (-0.4, -0.5), (0.4, 5.0)]
)
def test_drag_is_the_integral_of_the_strip_force(u, w):
    l1, l2 = 0.1, 1.5
    zero = [u / w] if w and l1 < u / w < l2 else None
    strip = lambda l: 0.5 * RHO * C_D * D * (u - w * l) * abs(u - w * l)  # noqa: E731, E741
    force = quad(strip, l1, l2, points=zero, epsabs=1e-12)[0]
    torque = quad(lambda l: l * strip(l), l1, l2, points=zero, epsabs=1e-12)[0]  # noqa: E741
    assert drag(u, w, l1, l2, D, RHO, C_D) == pytest.approx((force, torque), rel=1e-10)


def test_still_water_is_eq_29():
    w, l1, l2 = 0.7, 0.0, 1.557
    _, torque = drag(0.0, w, l1, l2, D, RHO, C_D)
    assert torque == pytest.approx(-RHO * C_D * D * w * abs(w) * (l2**4 - l1**4) / 8)
    assert added_inertia(l1, l2, D, RHO, C_M) == pytest.approx(RHO * C_M * np.pi * D**2 * (l2**3 - l1**3) / 12)


def test_standing_beam_is_eq_30_with_one_quarter():
    v, theta, l1, l2 = 0.5, 0.9, 0.2, 1.5
    u = v * np.sin(theta)
    _, torque = drag(u, 0.0, l1, l2, D, RHO, C_D)
    assert torque == pytest.approx(RHO * C_D * D * v * abs(v) * np.sin(theta) ** 2 * (l2**2 - l1**2) / 4)
    # second term of Eq. 30: 1/8 rho C_M pi D^2 sin(theta) dv/dt (l2^2 - l1^2)
    a = 0.3
    inertia = inertia_per_length(D, RHO, C_M) * a * np.sin(theta) * (l2**2 - l1**2) / 2
    assert inertia == pytest.approx(RHO * C_M * np.pi * D**2 * np.sin(theta) * a * (l2**2 - l1**2) / 8)


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.2), (-0.5, 0.2), (0.5, -0.2)])
def test_as_printed_it_is_the_sum_of_eqs_29_and_30(v, w):
    theta, l1, l2 = 0.9, 0.2, 1.5
    eq29 = RHO * C_D * D * w * abs(w) * (l2**4 - l1**4) / 8
    eq30 = RHO * C_D * D * v * abs(v) * np.sin(theta) ** 2 * (l2**2 - l1**2) / 2
    printed = printed_torque(-v * np.sin(theta), w, l1, l2, D, RHO, C_D)  # a current along +x pushes it down
    assert printed == pytest.approx(-eq29 - eq30)


def test_current_and_its_acceleration():
    t = np.linspace(0, 20, 2001)
    v, a = np.array([wave(s, 0.2, 0.1, 0.3) for s in t]).T
    assert v[0] == pytest.approx(0.2 * np.sin(0.3))
    assert np.gradient(v, t)[1:-1] == pytest.approx(a[1:-1], abs=1e-5)
