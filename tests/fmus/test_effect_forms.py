"""Ready effects for users' FMUs against closed forms: exactly absent at first, of the stated size otherwise."""

import sys
from math import exp, pi, sin, sqrt

import numpy as np
import pytest
from deepsea_cosim.fmus.cli import main
from deepsea_cosim.fmus.effect_forms import MARK, DeadZone, Delay, Friction, Hysteresis, Leakage, Play, add

SWING = [0.1 * sin(2.0 * pi * k / 400.0) for k in range(1200)]
"""Three periods with an amplitude of 0.1."""


@pytest.mark.parametrize("x", [-3.0, -1e-9, 0.0, 1e-300, 0.7])
def test_absent_at_first(x):
    assert (Friction().force(x), Hysteresis().force(x), Leakage().flow(x)) == (0.0, 0.0, 0.0)
    assert (Play()(x), DeadZone()(x), Delay()(1.0, x)) == (x, x, x)


def test_friction_is_that_of_stribeck():
    f = Friction(v_s=0.05)
    f.F_c, f.F_s, f.b = 2.0, 1.5, 10.0
    for v in (0.02, 0.1, 0.6):
        assert f.force(v) == pytest.approx(2.0 + 1.5 * exp(-v / 0.05) + 10.0 * v, rel=1e-12)
        assert f.force(-v) == -f.force(v)
    assert f.force(0.0) == 0.0


def test_hysteresis_takes_up_the_energy_of_its_loop():
    h = Hysteresis(x_h=0.02)
    h.F_h = 3.0
    force = np.array([h.force(x) for x in SWING])
    assert abs(force).max() == 3.0
    mean, way = 0.5 * (force[1:] + force[:-1]), np.diff(SWING)
    assert np.sum((mean * way)[-400:]) == pytest.approx(4.0 * 3.0 * (0.1 - 0.02), rel=1e-3)


def test_play_rests_while_it_is_crossed():
    p = Play()
    p.width = 0.04
    driven = np.array([p(x) for x in SWING])[400:]
    assert (driven.max(), driven.min()) == (pytest.approx(0.08), pytest.approx(-0.08))
    area = np.sum(0.5 * (driven[1:401] + driven[:400]) * np.diff(SWING[400:])[:400])
    assert abs(area) == pytest.approx(0.04 * (0.2 - 0.04), rel=1e-2)  # a parallelogram, width times what it moves


def test_dead_zone():
    z = DeadZone()
    z.half_width = 0.3
    assert [z(x) for x in (-1.0, -0.3, 0.1, 0.3)] == [-0.7, 0.0, 0.0, 0.0]
    assert z(0.5) == pytest.approx(0.2)


def test_leakage():
    gap = Leakage(p_0=1.0)
    gap.G = 2e-12
    assert gap.flow(-3e6) == -6e-6
    gap.G, gap.K = 0.0, 1e-8
    assert gap.flow(4e6) == pytest.approx(1e-8 * sqrt(4e6), rel=1e-9)


def test_delay_of_a_line_is_a_line():
    d = Delay()
    d.time = 0.025
    for k in range(100):
        t = 0.01 * k
        assert d(t, 5.0 * t) == pytest.approx(max(5.0 * (t - 0.025), 0.0), abs=1e-12)
    assert len(d.past) < 6
    assert d(0.99, 99.0) == pytest.approx(5.0 * 0.965)  # asked again with another value


def test_delay_below_a_step_lies_between_the_last_two():
    d = Delay()
    d.time = 0.004
    assert [d(0.01 * k, float(k)) for k in range(4)] == pytest.approx([0.0, 0.6, 1.6, 2.6])


SCRIPT = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from effect_forms import Friction, Play, add


class Rubbing(Fmi2Slave):
    """Output: friction at the velocity that it is given, and its position behind a play."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.v, self.F, self.x = 0.0, 0.0, 0.0
        self.register_variable(Real("v", causality=Fmi2Causality.input))
        self.register_variable(Real("F", causality=Fmi2Causality.output))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        add(self, "rub", Friction(), "the slide rubs", F_c=0.3, F_s=0.1)
        add(self, "gear", Play(), width=0.01)

    def do_step(self, current_time, step_size):
        self.F, self.x = self.rub.force(self.v), self.gear(self.v)
        return True
'''


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory):
    """An FMU with forms, made as the documentation says: forms beside the script, pythonfmu with a project file."""
    import subprocess

    folder = tmp_path_factory.mktemp("forms")
    (folder / "rubbing.py").write_text(SCRIPT)
    assert main(["forms", "--out", str(folder)]) == 0
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", "rubbing.py", "effect_forms.py", "-d", "."]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return folder / "Rubbing.fmu"


def test_the_forms_work_in_an_fmu_and_begin_anew_with_each_run(rubbing):
    from deepsea_cosim.master.simulation.session import Session

    t = np.array([0.0, 0.5, 1.0])
    with Session(rubbing) as session:

        def ran(**changes):
            named = {f"Rubbing.{k.replace('__', '.')}": v for k, v in changes.items()}
            return session.run(["Rubbing.F", "Rubbing.x"], 1.0, 0.1, named, {"v": (t, np.array([0.0, 0.2, -0.2]))})[1]

        plain = ran()
        assert not plain[:, 0].any()
        rubs = ran(rub__F_c=0.4, gear__width=0.06)
        assert rubs[-1, 0] == pytest.approx(-0.4)
        assert rubs[:, 1].max() == pytest.approx(0.2 - 0.03)
        assert np.array_equal(ran(), plain)
        assert np.array_equal(ran(rub__F_c=0.4, gear__width=0.06), rubs)


def test_forms_is_not_written_over_another_file(tmp_path, capsys):
    (tmp_path / "effect_forms.py").write_text("mine = 1\n")
    assert main(["forms", "--out", str(tmp_path)]) == 2
    assert "effect_forms.py" in capsys.readouterr().err
    assert (tmp_path / "effect_forms.py").read_text() == "mine = 1\n"


def test_a_size_of_no_parameter_is_told():
    class Nothing:
        def register_variable(self, variable):
            raise AssertionError(MARK)

    with pytest.raises(ValueError, match="rub: F_x"):
        add(Nothing(), "rub", Friction(), F_x=1.0)
