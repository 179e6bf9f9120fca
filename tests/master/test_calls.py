"""What FMUs may rely on when they are called, and what they may do: native FMUs that look, copies of linear.c."""

from __future__ import annotations

import os
import subprocess
import zipfile

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import constant, gain, linear, rewritten

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

SOURCE = native.HERE / "fmus" / "linear.c"
STEP = "int EXPORT(DoStep)(Model *m, double t, double h, Bool keep) {\n    (void)keep;"
FIRST = "(void)name; (void)type; (void)guid; (void)where; (void)functions;"
"""The beginning of fmi2Instantiate."""
LOGGER = (
    "#include <stddef.h>\n#include <stdio.h>\n"
    "typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);\n"
    "typedef struct { Logger log; void *a, *f, *s, *environment; } Callbacks;\n"
    "static Callbacks CALL; static char NAME[256];\n"
)
KEEP = (FIRST, "CALL = *(Callbacks *)functions; strcpy(NAME, name);")


@pytest.fixture
def made(tmp_path):
    """Makes an FMU of linear.c with replacements (old, new)."""

    def make(name, version, *changes, **told):
        folder = tmp_path / f"made_{name}"
        folder.mkdir()
        return rewritten(folder, version, *changes, **told)

    return make


def bad(trouble, name="bad"):
    """A component that makes trouble at 0.5 s."""
    given = bindings(binding(values({"trouble": float(trouble), "when": 0.5})))
    return component(name, "resources/L.fmu", connector("y1", "output"), bindings=given)


def packed(path, fmu, *parts, links=(), **files):
    return package(path / "p.ssp", system("root", *parts, links=links), {"resources/L.fmu": fmu, **files})


# FMI 1.0


@pytest.mark.parametrize(("status", "message"), [(1, None), (3, "fmiInitializeSlave: the FMU returned fmiError")])
def test_what_initialize_slave_returns_is_heard(made, tmp_path, status, message):
    old = "m->entered = m->ready = 1;\n    return 0;"
    path = packed(tmp_path, made("init", 1, (old, old.replace("return 0", f"return {status}"))), gain("a", 3.0))
    if message is None:
        assert run(path, tmp_path / "out").summary["status"] == "ok"
    else:
        with pytest.raises(CosimError, match=message):
            run(path, tmp_path / "out")


def test_a_run_without_an_end_has_no_stop_time(made, tmp_path):
    """StopTimeDefined says so; an infinite time would be one."""
    told = "(void)start; if (defined ? !(stop > 0.0 && stop < 1e300) : stop != 0.0) return 3;"
    path = packed(tmp_path, made("stop", 1, ("(void)start; (void)defined; (void)stop;", told)), gain("a", 3.0))
    with Session(path) as session:
        session.run(["a.y1"], 1.0, 0.1)
        assert session.start(["a.y1"], 0.1, {"a.u1": 2.0}).step() == [6.0]


def test_no_instance_is_an_error(made, tmp_path):
    fmu = made("null", 1, ("(void)logging;\n    return make();", "return NULL;"))
    with pytest.raises(CosimError, match="component 'a' cannot be instantiated: the FMU gave no instance"):
        run(packed(tmp_path, fmu, gain("a", 3.0)), tmp_path / "out")


def test_what_an_fmu_says_of_why_there_is_no_instance_is_one_line(made, tmp_path):
    old = "(void)name; (void)type; (void)guid; (void)where; (void)functions; (void)visible; (void)logging;"
    says = '((void (**)(void *, const char *, int, const char *, const char *, ...))functions)[0]'
    fmu = made("told", 2, (old, f'{says}(0, name, 3, "error", "no licence:\\n ask for one"); return NULL;'))
    with pytest.raises(CosimError, match=r"component 'a' cannot be instantiated: no licence: ask for one$"):
        run(packed(tmp_path, fmu, gain("a", 3.0)), tmp_path / "out")


@pytest.mark.parametrize("method", ["jacobi", "nepce"])
def test_an_isolated_fmu_has_the_dependencies_that_it_declares(made, tmp_path, method):
    ramp = component("r", "resources/L.fmu", connector("y1", "output"),
                     bindings=bindings(binding(values({"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}))))  # fmt: skip
    path = packed(tmp_path, made("direct", 1, direct=True), ramp, gain("a", 2.0), links=(link("r.y1", "a.u1"),))
    for isolate in (False, True):
        frame = run(path, tmp_path / "out", Options(method=method, isolate=isolate)).frame()
        assert frame["a.y1"].iloc[-1] == pytest.approx(2.0)


# messages


def test_each_session_hears_its_own_fmus(made, tmp_path):
    """FMI 2.0 brings back what it was given with the callbacks, whatever name the FMU gives itself."""
    log = 'CALL.log(CALL.environment, "model", 1, "c", "u1 is #r0#, 100## at %g", t);'
    heard = {"a": [], "b": []}
    packages = {}
    for name in heard:
        fmu = made(name, 2, KEEP, (STEP, STEP + log), before=LOGGER + f"int in_{name};\n")
        (tmp_path / name).mkdir()
        packages[name] = packed(tmp_path / name, fmu, gain(name, 3.0))
    with Session(packages["a"], lambda *m: heard["a"].append(m)) as session:
        session.run(["a.y1"], 1.0, 0.5)
        with Session(packages["b"], lambda *m: heard["b"].append(m)) as other:
            other.run(["b.y1"], 1.0, 0.5)
            session.run(["a.y1"], 1.0, 0.5)
        session.run(["a.y1"], 1.0, 0.5)
    assert [m[0] for m in heard["a"]] == ["a"] * 6
    assert heard["b"] == [("b", "warning", "u1 is u1, 100# at 0"), ("b", "warning", "u1 is u1, 100# at 0.5")]


def test_the_reason_is_what_the_fmu_says_now(made, tmp_path):
    log = 'CALL.log(CALL.environment, NAME, 2, "c", "first guess discarded");'
    old = "int fmi2EnterInitializationMode(Model *m) { m->entered = 1;"
    path = packed(tmp_path, made("stale", 2, KEEP, (old, old + log), before=LOGGER), bad(1))
    with pytest.raises(CosimError, match=r"doStep at t = 0.5 s: the FMU returned fmi2Error"):
        run(path, tmp_path / "out")


def test_a_reason_after_many_messages_is_heard(made, tmp_path):
    many = 'for (int i = 0; i < 120; i++) CALL.log(CALL.environment, NAME, 1, "c", "w %d", i);'
    log = 'CALL.log(CALL.environment, NAME, 3, "c", "table t.txt not found"); return 3;'
    old = "int fmi2EnterInitializationMode(Model *m) { m->entered = 1;"
    fmu = made("flood", 2, (KEEP[0], KEEP[1] + many), (old, old + log), before=LOGGER)
    with pytest.raises(CosimError, match=r"table t\.txt not found"):
        run(packed(tmp_path, fmu, gain("a", 1.0)), tmp_path / "out")


# after errors


@pytest.mark.parametrize(("trouble", "expected"), [(1, ["free", "free"]), (5, [])])
def test_what_failed_is_left_alone(made, tmp_path, trouble, expected):
    """After fmi2Error only freeing is allowed, after fmi2Fatal nothing, for all instances of the FMU."""
    told = tmp_path / "told"
    note = f'{{ FILE *f = fopen("{told}", "a"); fputs("%s\\n", f); fclose(f); }}'
    fmu = made(
        "after", 2,
        ("int fmi2Terminate(Model *m) {", "int fmi2Terminate(Model *m) { if (m->trouble) " + note.replace("%s", "end")),
        ("void fmi2FreeInstance(Model *m) {", "void fmi2FreeInstance(Model *m) { " + note.replace("%s", "free")),
        before="#include <stdio.h>\n",
    )  # fmt: skip
    with pytest.raises(CosimError, match=r"doStep at t = 0\.5 s"):
        run(packed(tmp_path, fmu, bad(trouble), gain("sibling", 1.0)), tmp_path / "out")
    assert (told.read_text().split() if told.exists() else []) == expected


def test_a_library_that_does_not_load_leaves_the_folder_as_it_was(made, tmp_path, monkeypatch):
    fmu = made("cwd", 2, (STEP, STEP + " nowhere();"), before="void nowhere(void);\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CosimError, match="cannot be instantiated"):
        run(packed(tmp_path, fmu, gain("a", 1.0)), tmp_path / "out")
    assert os.getcwd() == str(tmp_path)


# what is set and stepped


@pytest.mark.parametrize("method", ["jacobi", "nepce", "gauss-seidel"])
def test_only_items_that_exist_are_tried(made, tmp_path, method):
    """An FMU that does not say what its outputs depend on is asked with other inputs; 4 is no colour."""
    old = "else if (r[k] == 530) m->item_in = v[k];"
    fmu = made("enum", 2, (old, "else if (r[k] == 530) { if (v[k] < 1 || v[k] > 3) return 4; m->item_in = v[k]; }"),
               through=None)  # fmt: skip
    a = component("a", "resources/L.fmu", connector("item_out", "output", None),
                  bindings=bindings(binding(values({}).replace("<ssv:Parameters>", "<ssv:Parameters>"
                  '<ssv:Parameter name="item_in"><ssv:Integer value="3"/></ssv:Parameter>'))))  # fmt: skip
    b = component("b", "resources/L.fmu", connector("item_in", "input", None), connector("item_out", "output", None))
    path = packed(tmp_path, fmu, a, b, links=(link("a.item_out", "b.item_in"),))
    assert run(path, tmp_path / "out", Options(method=method)).frame()["b.item_out"].iloc[-1] == 3


@pytest.mark.parametrize(("h", "n", "ratio"), [(0.1, 100, 2), (0.1, 100, 6), (0.1, 1000, 7)])
def test_steps_of_their_own_end_at_the_stop_time(made, tmp_path, h, n, ratio):
    old = "int fmi2SetupExperiment(Model *m, int d, double tol, double start, int sd, double stop) {"
    fmu = made("beyond", 2, (old, old + " STOP = stop;"), (STEP, STEP + " if (t + h > STOP) return 3;"),
               before="static double STOP;\n")  # fmt: skip
    options = Options(stop_time=n * h, step=h, substeps=(("a", ratio),))
    assert run(packed(tmp_path, fmu, gain("a", 0.5)), tmp_path / "out", options).summary["status"] == "ok"


def test_a_state_that_may_come_back_is_not_given_up_between_steps_of_their_own(made, tmp_path):
    """noSetFMUStatePriorToCurrentPoint is false where the program may still go back to the macro step's start."""
    back = "int fmi2SetFMUstate(Model *m, Model *s) {"
    late = STEP, STEP + " m->at = t + h; if (keep && t > m->safe) m->safe = t;"
    record = "typedef struct {\n", "typedef struct {\n    double at, safe;\n"
    fmu = made("prior", 2, record, late, (back, back + " if (s->at < m->safe - 1e-12) return 3;"))
    b = linear("b", A=[[-1.0]], B=[[1.0]], C=[[1.0]], x0=[1.0])
    path = packed(tmp_path, fmu, gain("a", 0.5), b, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    options = Options(method="fixed-point", substeps=(("a", 4),))
    assert run(path, tmp_path / "out", options).summary["status"] == "ok"


# libraries


def test_libraries_of_one_name_are_told(made, tmp_path):
    fmus = {}
    for k in (1, 2):
        folder = tmp_path / f"h{k}"
        folder.mkdir()
        (folder / "h.c").write_text(f"double helper(void) {{ return {k}; }}")
        build = [native.compiler, "-shared", "-fPIC", "h.c", "-o", "libhelper.so", "-Wl,-soname,libhelper.so"]
        subprocess.run(build, cwd=folder, check=True)
        linked = (f"-L{folder}", "-lhelper", "-Wl,-rpath,$ORIGIN")
        change, file = (STEP, STEP + " m->y[5] = helper();"), folder / "libhelper.so"
        fmus[k] = made(f"helped{k}", 2, change, before="double helper(void);\n", more=linked, beside=file)
    root = system("root", component("a", "resources/A.fmu"), component("b", "resources/B.fmu"))
    path = package(tmp_path / "p.ssp", root, {"resources/A.fmu": fmus[1], "resources/B.fmu": fmus[2]})
    warnings = run(path, tmp_path / "out").summary["warnings"]
    assert any("'b' and 'a' bring different libraries 'libhelper.so'" in text for text in warnings)
    assert not run(path, tmp_path / "out", Options(isolate=True)).summary["warnings"]


def test_functions_that_nobody_calls_may_be_missing(made, tmp_path):
    fmu = made("less", 3, ("MISSING(GetNominalsOfContinuousStates)", ""))
    assert run(packed(tmp_path, fmu, constant("a", 2.0)), tmp_path / "out").frame()["a.y1"].iloc[-1] == 2.0


def test_a_function_that_is_needed_may_not(made, tmp_path):
    fmu = made("none", 2, ("int EXPORT(DoStep)(", "static int hidden("))
    with pytest.raises(CosimError, match="has no function fmi2DoStep"):
        run(packed(tmp_path, fmu, constant("a", 2.0)), tmp_path / "out")


def test_nothing_else_allowed_is_no_answer(made, tmp_path):
    """An input whose least and greatest value are the same is left alone."""
    from deepsea_cosim.master.coupling.perturbation import perturbed

    path = packed(tmp_path, made("plain", 2), gain("a", 1.0))
    with Session(path) as session:
        session.run(["a.y1"], 0.1, 0.1)
        system_, instance = session.system, session.system.instances["a"]
        instance.variables["u1"].min = instance.variables["u1"].max = "0"
        with perturbed(system_, system_.inputs["a", "u1"], system_.inputs["a", "u1"].place, 1e-6) as change:
            assert change == 0.0
        assert np.isfinite(system_.buffer.reals).all()


@pytest.mark.parametrize(("name", "value", "expected"), [
    ("wide_in", 2**63 - 1, -1), ("wide_in", -(2**63), 1), ("huge_in", 2**64 - 1, -1), ("huge_in", 0, 1),
    ("huge_in", 2**63, 1),
])  # fmt: skip
def test_an_integer_at_the_end_of_its_type_is_perturbed_inwards(made, tmp_path, name, value, expected):
    from deepsea_cosim.master.coupling.perturbation import perturbed

    with Session(packed(tmp_path, made("plain", 3), component("a", "resources/L.fmu"))) as session:
        session.run(["a.y1"], 0.1, 0.1, {f"a.{name}": value})
        signal = session.system.inputs["a", name]
        before = session.system.buffer.integers[signal.place]
        with perturbed(session.system, signal, signal.place, 1e-6) as change:
            assert change == expected
            assert session.system.buffer.integers[signal.place] == (value + expected + 2**63) % 2**64 - 2**63
        assert session.system.buffer.integers[signal.place] == before


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("where", ["binaries/linux64", "resources/lib"])
@pytest.mark.parametrize("named", [True, False])
def test_libraries_beside_an_fmu_are_found(made, tmp_path, where, named, isolate):
    """The FMU's library needs one that needs another, and says of neither where it lies."""
    calls = "double deep(void); double helper(void) { return deep(); }"
    for name, body, needs in (("deep", "double deep(void) { return 3.0; }", ()), ("helper", calls, ("deep",))):
        (tmp_path / f"{name}.c").write_text(body)
        own = [f"-Wl,-soname,lib{name}{tmp_path.name}.so"] if named else []
        links = [f"-l{n}{tmp_path.name}" for n in needs]
        build = [native.compiler, "-shared", "-fPIC", f"{name}.c", "-o", f"lib{name}{tmp_path.name}.so", *own, "-L."]
        subprocess.run([*build, *links], cwd=tmp_path, check=True)
    linked = (f"-L{tmp_path}", f"-lhelper{tmp_path.name}", f"-Wl,-rpath-link,{tmp_path}")
    fmu = made("needy", 2, (STEP, STEP + " m->C[0][0] = helper();"), before="double helper(void);\n", more=linked)
    with zipfile.ZipFile(fmu, "a") as archive:
        for name in ("deep", "helper"):
            archive.write(tmp_path / f"lib{name}{tmp_path.name}.so", f"{where}/lib{name}{tmp_path.name}.so")
    path = packed(tmp_path, fmu, constant("a", 2.0))
    if named or isolate:
        frame = run(path, tmp_path / "out", Options(isolate=isolate)).frame()
        assert frame["a.y1"].iloc[-1] == 6.0
    else:
        with pytest.raises(CosimError, match=rf"libhelper{tmp_path.name}\.so.*: --isolate has it found"):
            run(path, tmp_path / "out")
