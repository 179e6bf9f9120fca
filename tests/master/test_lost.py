"""After fmiFatal no function of an FMU is called any more, whatever it was that ended so."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import component, connector, link, package, system
from .parts import constant, linear, rewritten

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

WATCH = """
#include <stdio.h>
static int dead;
static int kill_it(void) { dead = 1; return 4; }
static void look(void) { if (dead) fclose(fopen("MARK", "w")); }
"""
FREE = ("void fmi2FreeInstance(Model *m) {", "void fmi2FreeInstance(Model *m) { look();")
STEP = ("int EXPORT(DoStep)(Model *m, double t, double h, Bool keep) {",
        "int EXPORT(DoStep)(Model *m, double t, double h, Bool keep) { look();")  # fmt: skip
DROP = ("int fmi2FreeFMUstate(Model *m, Model **s) {", "int fmi2FreeFMUstate(Model *m, Model **s) { look();")
FATAL_STEP = ("    int status = trouble(m, t);", "    int status = t < 0.05 ? 0 : kill_it();")
FATAL_DROP = ("int fmi2FreeFMUstate(Model *m, Model **s) {", "int fmi2FreeFMUstate(Model *m, Model **s) { look(); "
              "return kill_it();")  # fmt: skip


@pytest.fixture
def deadly(tmp_path):
    """Makes an FMU that notes calls after it has returned fatal; and whether it has noted one."""
    mark = tmp_path / "called"

    def make(*changes, **told):
        folder = tmp_path / "made"
        folder.mkdir()
        return rewritten(folder, 2, FREE, STEP, *changes, before=WATCH.replace("MARK", str(mark)), **told)

    return make, mark.exists


def circle(path, fmu):
    """A state that is its own input's integral, and the FMU whose outputs follow."""
    parts = (
        linear("a", A=[[0.0]], B=[[-1.0]], C=[[1.0]], x0=[1.0]),
        linear("b", "resources/D.fmu", A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[1.0]]),
    )
    root = system("root", *parts, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    return package(path, root, {"resources/L.fmu": native.linear(path.parent, 2), "resources/D.fmu": fmu})


def test_an_fmu_that_dies_as_it_is_terminated_is_not_freed(deadly, tmp_path):
    make, was_called = deadly
    fmu = make(("int fmi2Terminate(Model *m) { return terminate(m); }", "int fmi2Terminate() { return kill_it(); }"))
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), {"resources/L.fmu": fmu})
    (warning,) = run(path, tmp_path / "out", Options()).summary["warnings"]
    assert warning.startswith("component 'a', terminate: ")
    assert not was_called()


@pytest.mark.parametrize("method", ["fixed-point", "interface-jacobian"])
@pytest.mark.parametrize(("changes", "words"), [((DROP, FATAL_STEP), "doStep"), ((FATAL_DROP,), "freeFMUstate")])
def test_a_state_of_an_fmu_that_is_lost_is_left(deadly, tmp_path, method, changes, words):
    """What killed it is told, not what its state does to it."""
    make, was_called = deadly
    path = circle(tmp_path / "p.ssp", make(*changes))
    with pytest.raises(CosimError, match=f"component 'b', {words}"):
        run(path, tmp_path / "out", Options(method=method))
    assert not was_called()


def test_an_fmu_that_dies_as_its_state_is_saved_is_left(deadly, tmp_path):
    make, was_called = deadly
    old = "int fmi2SerializeFMUstate(Model *m, Model *s, char *b, size_t n) {"
    path = circle(tmp_path / "p.ssp", make(DROP, (old, f"{old} return kill_it();")))
    with pytest.raises(CosimError, match="component 'b', serializeFMUstate"):
        run(path, tmp_path / "out", Options(save_state=True))
    assert not was_called()


def test_an_fmu_that_dies_of_its_derivatives_is_not_stepped(deadly, tmp_path):
    make, was_called = deadly
    fmu = make(DROP, ("    if (m->trouble == 11.0) return 3;", "    if (1) return kill_it();"), derivatives=True)
    with pytest.raises(CosimError, match="component 'b', getDirectionalDerivative"):
        run(circle(tmp_path / "p.ssp", fmu), tmp_path / "out", Options(method="interface-jacobian"))
    assert not was_called()


def test_an_fmu_that_dies_of_a_perturbation_is_not_stepped(deadly, tmp_path):
    """A spring that answers to a position at once: how much counts for the power bond."""
    make, was_called = deadly
    begin = "int EXPORT(SetReal)(Model *m, const unsigned *r, size_t n, const double *v) {"
    end = "        if (!m->ready && r[k] >= 20 && r[k] < 26) m->x[r[k] - 20] = v[k];"
    spring = make((begin, f"{begin} look();"), (end, f"{end}\n        if (m->u[1] != 0.0) return kill_it();"),
                  units={"y1": "N", "u1": "m/s", "u2": "m"})  # fmt: skip
    mass = native.linear(tmp_path, 2, "mass", through=False, units={"u1": "N", "y1": "m/s", "y2": "m"})
    ports = {"mass": ("u1", "y1", "y2"), "spring": ("u1", "u2", "y1")}
    parts = (
        component(n, f"resources/{n}.fmu", *(connector(p, "input" if p[0] == "u" else "output") for p in of))
        for n, of in ports.items()
    )
    links = (link("mass.y1", "spring.u1"), link("mass.y2", "spring.u2"), link("spring.y1", "mass.u1"))
    files = {"resources/mass.fmu": mass, "resources/spring.fmu": spring}
    path = package(tmp_path / "p.ssp", system("root", *parts, links=links), files, stop=1.0, step=0.1)
    with pytest.raises(CosimError, match="component 'spring', setting the inputs"):
        run(path, tmp_path / "out", Options())
    assert not was_called()
