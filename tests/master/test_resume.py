"""A run that goes on from a saved state gives the rows of one that never stopped, bit for bit."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
import zipfile

import pytest
from deepsea_cosim.core.errors import CosimError, SimulationError, UsageError
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.results.frame import frame
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native, splits

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import constant, gain, linear, redescribed, rewritten, two

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def lines(folder):
    return (folder / "results.csv").read_text().splitlines()


def seconds(line):
    return float(line.split(",")[0])


def joined(*folders):
    """The rows of runs, of each up to where the next one has gone on."""
    begins = [json.loads((folder / "summary.json").read_text())["start_time_s"] for folder in folders[1:]]
    made = lines(folders[0])[:1]
    for folder, end in zip(folders, (*begins, float("inf")), strict=True):
        head, *rows = lines(folder)
        assert head == made[0]
        made += [line for line in rows if seconds(line) < end]
    return made


def in_two(path, tmp_path, half, stop, then=None, **options):
    """Rows of one run, and those of two, of which the second goes on where the first one has ended."""
    run(path, tmp_path / "whole", Options(stop_time=stop, **options))
    run(path, tmp_path / "a", Options(stop_time=half, save_state=True, **options))
    run(path, tmp_path / "b", Options(stop_time=stop, resume=tmp_path / "a", **{**options, **(then or {})}))
    return lines(tmp_path / "whole"), joined(tmp_path / "a", tmp_path / "b")


@pytest.fixture(scope="module", params=[splits.quarter_car, splits.two_masses])
def split(request, tmp_path_factory):
    return splits.packed(request.param(), tmp_path_factory.mktemp("split"))


@pytest.mark.parametrize("method", NAMES)
def test_rows_are_those_of_one_run(split, tmp_path, method):
    one, two = in_two(split, tmp_path, 0.4, 0.6, method=method, step=0.004)
    assert one == two
    assert len(one) == 152


@pytest.mark.parametrize("half", [1.0, 2.2])
def test_what_is_measured_every_500_steps_is_so_before_and_after_a_halt(split, tmp_path, half):
    one, two = in_two(split, tmp_path, half, 2.6, method="interface-jacobian", step=0.004)
    assert one == two


def everything(path, fmus, version):
    """A loop that is solved by Newton's method, an oscillator, and values of other types that stimuli drive."""
    inputs = [connector(f"u{k}", "input") for k in (1, 2, 3)]
    loop = component("l", "resources/L.fmu", *inputs, connector("y1", "output"), bindings=bindings(
        binding(values({"D[1,1]": -3.0, "D[1,3]": 1.0, "square": 0.1}))))  # fmt: skip
    kinds = ("integer", "boolean", "string")
    typed = [connector(f"{kind}_{way}", f"{way}put", None) for kind in kinds for way in ("in", "out")]
    swing = component("s", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), *typed,
                      bindings=bindings(binding(values({"A[1,2]": 1.0, "A[2,1]": -40.0, "B[2,1]": 1.0, "C[1,1]": 1.0,
                                                        "x0[1]": 1.0}))))  # fmt: skip
    own = {"in": ("Real", "l.u3"), "whole": ("Integer", "s.integer_in"), "either": ("Boolean", "s.boolean_in"),
           "words": ("String", "s.string_in")}  # fmt: skip
    made = [connector(name, "input", kind) for name, (kind, _) in own.items()]
    links = [link(name, way) for name, (_, way) in own.items()]
    links += [link("l.y1", "g.u1"), link("g.y1", "l.u1"), link("s.y1", "l.u2"), link("g.y1", "s.u1")]
    root = system("root", loop, gain("g", 1.0), swing, made=tuple(made), links=tuple(links))
    return package(path, root, {"resources/L.fmu": fmus[version]}, step=0.01)


STIMULI = """time,in,whole,either,words
0,1,3,true,down
0.305,2.5,3,true,down
0.305,-1,4,false,up
0.77,0.3,-5,true,"left, right"
"""


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "extrapolation", "nepce"])
@pytest.mark.parametrize("version", [2, 3])
def test_loops_stimuli_types_and_substeps_go_on(fmus, tmp_path, version, method):
    path = everything(tmp_path / "p.ssp", fmus, version)
    (tmp_path / "s.csv").write_text(STIMULI)
    given = {"stimuli": tmp_path / "s.csv", "substeps": {"s": 3}, "record_every": 7, "method": method}
    one, two = in_two(path, tmp_path, 0.53, 1.0, **given)
    assert one == two
    assert [seconds(line) for line in lines(tmp_path / "b")[1:3]] == [0.56, 0.63]


def test_processes_may_go_on_with_a_state_of_fmus_in_the_masters_own_and_the_other_way_round(fmus, tmp_path):
    path = everything(tmp_path / "p.ssp", fmus, 2)
    (tmp_path / "s.csv").write_text(STIMULI)
    given = {"stimuli": tmp_path / "s.csv", "method": "nepce"}
    run(path, tmp_path / "whole", Options(**given))
    run(path, tmp_path / "a", Options(stop_time=0.4, save_state=True, **given))
    run(path, tmp_path / "b", Options(stop_time=0.7, save_state=True, isolate=True, resume=tmp_path / "a", **given))
    run(path, tmp_path / "c", Options(resume=tmp_path / "b", **given))
    assert joined(*(tmp_path / name for name in "abc")) == lines(tmp_path / "whole")


def test_other_columns_may_be_recorded_from_there(fmus, tmp_path):
    path = everything(tmp_path / "p.ssp", fmus, 2)
    (tmp_path / "s.csv").write_text(STIMULI)
    given = {"stimuli": tmp_path / "s.csv", "method": "nepce"}
    run(path, tmp_path / "a", Options(save_state=True, stop_time=0.5, record=("s.y1",), **given))
    here, whole = (
        run(path, tmp_path / name, Options(resume=a, record=("*_out", "words"), **given)).frame()
        for name, a in (("b", tmp_path / "a"), ("whole", None))
    )
    assert here.equals(whole[whole["time"] >= 0.5].reset_index(drop=True))
    assert here["s.string_out"].iloc[0] == "up"


def test_slopes_of_inputs_go_on(tmp_path):
    fmu = native.linear(tmp_path, 2, slopes=True)
    a = linear("a", A=[[0, 1], [-40.0, 0]], B=[[0, 0], [1.0, 0]], C=[[1, 0]], x0=[1, 0])
    b = linear("b", A=[[-1.0]], B=[[1.0]], C=[[1]])
    root = system("root", a, b, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, step=0.01)
    one, two = in_two(path, tmp_path, 0.41, 1.0, method="extrapolation")
    assert one == two
    with pytest.raises(UsageError, match="slopes of inputs"):
        run(path, tmp_path / "c", Options(method="extrapolation", resume=tmp_path / "a", stop_time=1.0, isolate=True))


@pytest.mark.parametrize("method", ["gauss-seidel", "nepce", "interface-jacobian"])
def test_the_machine_goes_on_in_another_process(built, tmp_path, method):
    path = built / "deepsea_3km.ssp"
    run(path, tmp_path / "whole", Options(stop_time=3.0, step=2e-3, method=method))
    given = [str(path), "--step", "0.002", "--method", method, "--no-plot", "--quiet"]
    for more in (("2.4", "--out", "a", "--save-state"), ("3", "--out", "b", "--resume", "a")):
        subprocess.run([sys.executable, "-m", "deepsea_cosim.master.cli", *given, "--stop-time", *more], check=True,
                       cwd=tmp_path)  # fmt: skip
    assert joined(tmp_path / "a", tmp_path / "b") == lines(tmp_path / "whole")


def test_a_run_goes_on_again_and_again(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2])
    run(path, tmp_path / "whole")
    before = None
    for k, stop in enumerate((0.2, 0.5, 1.0)):
        result = run(path, tmp_path / str(k), Options(stop_time=stop, save_state=True, resume=before))
        before = tmp_path / str(k) / "state.zip"
    assert result.summary["start_time_s"] == 0.5
    assert result.summary["steps"] == 50
    assert result.summary["resumed"] == {"from": str(tmp_path / "1" / "state.zip"), "time_s": 0.5, "steps": 50}
    assert result.summary["saved_state"] == {"file": "state.zip", "time_s": 1.0, "steps": 100}
    assert joined(*(tmp_path / name for name in "012")) == lines(tmp_path / "whole")


def test_the_clock_is_kept_from_there_on(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2], step=0.05)
    run(path, tmp_path / "whole")
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))
    summary = run(path, tmp_path / "b", Options(resume=tmp_path / "a", realtime=True)).summary
    assert summary["wall_time_s"] >= 0.5
    assert summary["real_time_factor"] <= 1.0
    assert joined(tmp_path / "a", tmp_path / "b") == lines(tmp_path / "whole")


def test_a_state_of_other_versions_goes_on_with_a_remark(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2])
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))

    def aged(content):
        state = json.loads(content)
        state["versions"]["fmpy"] = "0.1"
        return json.dumps(state).encode()

    old = rewritten_state(tmp_path / "a" / "state.zip", tmp_path / "old.zip", "state.json", aged)
    assert not run(path, tmp_path / "b", Options(resume=tmp_path / "a")).summary["warnings"]
    told = run(path, tmp_path / "b", Options(resume=old)).summary["warnings"]
    assert len(told) == 1
    assert "fmpy: 0.1 when the state was saved" in told[0]


def test_a_state_is_one_that_a_longer_run_has(fmus, tmp_path):
    """Not that behind a last step that is cut short."""
    path = two(tmp_path / "p.ssp", fmus[2])
    one, two_ = in_two(path, tmp_path, 0.405, 1.0)
    assert one == two_
    summary = json.loads((tmp_path / "a" / "summary.json").read_text())
    assert summary["saved_state"]["time_s"] == 0.4
    assert [w for w in summary["warnings"] if "t = 0.4 s" in w]
    for half in (0.3, 0.57, 0.7):  # ends of which rounding makes another step
        assert in_two(path, tmp_path, half, 1.0)[1] == one


def test_a_run_whose_step_hangs_on_its_length_goes_on_with_that(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), {"resources/L.fmu": fmus[2]}, stop=None)
    run(path, tmp_path / "a", Options(stop_time=2.0, save_state=True))
    assert run(path, tmp_path / "b", Options(stop_time=3.0, resume=tmp_path / "a")).summary["steps"] == 500


def test_the_last_state_before_a_failure_is_there(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2], trouble=1.0, when=0.5)
    with pytest.raises(CosimError):
        run(path, tmp_path / "a", Options(save_state_every=0.2))
    with pytest.raises(CosimError, match=r"t = 0\.5"):
        run(path, tmp_path / "b", Options(resume=tmp_path / "a"))
    assert [seconds(line) for line in lines(tmp_path / "b")[1:3]] == [40 * 0.01, 41 * 0.01]
    assert joined(tmp_path / "a", tmp_path / "b") == lines(tmp_path / "a")


def test_a_run_that_an_fmu_ends_keeps_the_state_before(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2], trouble=8.0, when=0.5)
    summary = run(path, tmp_path / "a", Options(save_state_every=0.2)).summary
    assert summary["status"] == "ended"
    assert summary["saved_state"]["time_s"] == 0.4
    assert [w for w in summary["warnings"] if "t = 0.4 s" in w]


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGTERM")
@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("more", [(), ("--isolate",)])
def test_a_run_that_is_asked_to_end_goes_on_later(fmus, tmp_path, kind, more):
    path = two(tmp_path / "p.ssp", fmus[2], stop=2000.0)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--no-plot", "--out", str(tmp_path / "a")]
    process = subprocess.Popen([*command, "--save-state", "--realtime", *more], stderr=subprocess.PIPE)
    while process.poll() is None and not (tmp_path / "a" / "state.zip").exists():
        time.sleep(0.05)
    time.sleep(0.3)
    process.send_signal(kind)
    told = process.communicate(timeout=60)[1].decode()
    assert process.returncode == 128 + kind
    assert f"--resume {tmp_path / 'a'}" in told
    reached = json.loads((tmp_path / "a" / "summary.json").read_text())["saved_state"]["time_s"]
    assert reached == pytest.approx(seconds(lines(tmp_path / "a")[-1]) + 0.01)
    assert reached > 0.0
    end = reached + 1.0
    run(path, tmp_path / "b", Options(resume=tmp_path / "a", stop_time=end))
    run(path, tmp_path / "whole", Options(stop_time=end))
    assert joined(tmp_path / "a", tmp_path / "b") == lines(tmp_path / "whole")


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGTERM")
def test_a_step_under_way_in_another_process_is_waited_for(tmp_path):
    fmu = rewritten(tmp_path, 2, ("    if (m->first == 0.0) m->first = h;", "    if (m->ready) usleep(300000);"))
    path = two(tmp_path / "p.ssp", fmu)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--no-plot", "--out", str(tmp_path / "a")]
    process = subprocess.Popen([*command, "--save-state", "--isolate"], stderr=subprocess.PIPE)
    while process.poll() is None and not (tmp_path / "a" / "state.zip").exists():
        time.sleep(0.05)
    time.sleep(0.8)
    process.send_signal(signal.SIGTERM)
    assert b"goes on from there" in process.communicate(timeout=60)[1]
    saved = json.loads((tmp_path / "a" / "summary.json").read_text())["saved_state"]
    assert saved["steps"] == len(lines(tmp_path / "a")) - 1 > 0


def test_fmus_are_not_told_an_end_that_is_none(tmp_path):
    """One that refuses to go beyond it may be gone on with."""
    fmu = rewritten(
        tmp_path, 2,
        ("int fmi2SetupExperiment(Model *m, int d, double tol, double start, int sd, double stop) { return 0; }",
         "int fmi2SetupExperiment(Model *m, int d, double tol, double start, int sd, double stop) { "
         "m->until = sd ? stop : 1e300; return 0; }"),
        ("double first, last;", "double first, last, until;"),
        ("    if (m->first == 0.0) m->first = h;", "    if (FMI == 2 && t + h > m->until + 1e-9) return 3;"),
    )  # fmt: skip
    one, two_ = in_two(two(tmp_path / "p.ssp", fmu), tmp_path, 0.5, 1.0)
    assert one == two_


def test_other_stimuli_may_drive_it_on_and_it_is_said(fmus, tmp_path):
    path = everything(tmp_path / "p.ssp", fmus, 2)
    (tmp_path / "s.csv").write_text(STIMULI)
    (tmp_path / "t.csv").write_text(STIMULI.replace('0.77,0.3,-5,true,"left, right"', "0.77,0.3,8,true,right"))
    given = {"method": "nepce", "stimuli": tmp_path / "s.csv"}
    _, rows = in_two(path, tmp_path, 0.53, 1.0, then={"stimuli": tmp_path / "t.csv"}, **given)
    assert lines(tmp_path / "whole") != rows
    run(path, tmp_path / "other", Options(**{**given, "stimuli": tmp_path / "t.csv"}))
    assert frame(tmp_path / "other" / "results.csv")["whole"].iloc[-1] == 8
    assert lines(tmp_path / "b")[-1].split(",")[-3:] == lines(tmp_path / "other")[-1].split(",")[-3:]
    summary = json.loads((tmp_path / "b" / "summary.json").read_text())
    assert [w for w in summary["warnings"] if "t = 0.53 s" in w]


REFUSED = [
    ({"method": "jacobi"}, "--method: gauss-seidel when the state was saved, jacobi here"),
    ({"step": 0.005}, r"step \[s\]: 0\.01 when the state was saved, 0\.005 here"),
    ({"changes": {"b.D[1,1]": 2.5}}, r"value of 'b\.D\[1,1\]': 2\.0 when the state was saved, 2\.5 here"),
    ({"changes": {"b.D[2,1]": 2.5}}, r"value of 'b\.D\[2,1\]': none when the state was saved, 2\.5 here"),
    ({"substeps": {"b": 2}}, "--substeps of component 'b': 1 when the state was saved, 2 here"),
    ({"record": ("a.x0[1]",)}, r"variable 'a\.x0\[1\]' .*: none when the state was saved"),
    ({"stop_time": 0.5}, r"t = 0\.5 s; the stop time, 0\.5 s"),
    ({"check_step": True}, "--check-step"),
]  # fmt: skip


@pytest.mark.parametrize(("other", "told"), REFUSED)
def test_a_run_of_something_else_is_refused(fmus, tmp_path, other, told):
    path = two(tmp_path / "p.ssp", fmus[2])
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))
    with pytest.raises(UsageError, match=told) as error:
        run(path, tmp_path / "b", Options(**{"stop_time": 1.0, "resume": tmp_path / "a", **other}))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "b").exists()


def test_a_package_that_is_another_is_refused(fmus, tmp_path):
    run(two(tmp_path / "p.ssp", fmus[2]), tmp_path / "a", Options(stop_time=0.5, save_state=True))
    go_on = Options(resume=tmp_path / "a")
    (tmp_path / "fmu").mkdir()
    fmu = rewritten(tmp_path / "fmu", 2, ("m->last = t + h;", "m->last = t + h * 1.0;"), before="char more[999];")
    with pytest.raises(UsageError, match="FMU of component 'a', SHA-256"):
        run(two(tmp_path / "q.ssp", fmu), tmp_path / "b", go_on)
    root = system("root", constant("a", 1.0), gain("c", 1.0), links=(link("a.y1", "c.u1"),))
    with pytest.raises(UsageError, match=r"component '[bc]'"):
        run(package(tmp_path / "r.ssp", root, {"resources/L.fmu": fmus[2]}, step=0.01), tmp_path / "b", go_on)
    with zipfile.ZipFile(tmp_path / "p.ssp") as old, zipfile.ZipFile(tmp_path / "s.ssp", "w") as new:
        for name in old.namelist():
            turned = b'<ssc:LinearTransformation factor="2"/></ssd:Connection>'
            new.writestr(name, old.read(name).replace(b"</ssd:Connection>", turned))
    with pytest.raises(UsageError, match=r"connection a\.y1 -> b\.u1: \[1\.0, 0\.0.*\[2\.0, 0\.0"):
        run(tmp_path / "s.ssp", tmp_path / "b", go_on)


def rewritten_state(path, target, name, change):
    """The state with another content of one of its parts."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for part in old.namelist():
            new.writestr(part, change(old.read(part)) if part == name else old.read(part))
    return target


def test_what_is_no_state_of_this_is_refused_and_nothing_is_lost(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2])
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True, method="nepce"))
    (tmp_path / "text.zip").write_text("no archive")
    state = tmp_path / "a" / "state.zip"
    changed = {
        "platform: Plan9": ("state.json", lambda c: c.replace(b'"platform": "', b'"platform": "Plan9 ')),
        "schema": ("state.json", lambda c: c.replace(b'"schema": 1', b'"schema": 2')),
        "damaged": ("state.json", lambda c: c.replace(b'"steps"', b'"stops"')),
        "damaged ": ("values.npy", lambda c: c[:100]),
        "damaged  ": ("values.npy", lambda c: b"\x80\x04K\x01."),  # a pickle
    }
    for told, (name, change) in changed.items():
        other = rewritten_state(state, tmp_path / "other.zip", name, change)
        with pytest.raises(UsageError, match=told.strip()):
            run(path, tmp_path / "b", Options(resume=other, method="nepce"))
    for wrong, told in (("text.zip", "no saved state"), ("none", "no such file"), (".", "there is no state.zip in it")):
        with pytest.raises(UsageError, match=told):
            run(path, tmp_path / "b", Options(resume=tmp_path / wrong))
    kept = lines(tmp_path / "a")
    with pytest.raises(UsageError, match="--out"):
        run(path, tmp_path / "a", Options(resume=state, method="nepce"))
    assert lines(tmp_path / "a") == kept
    run(path, tmp_path / "a")
    assert not state.exists()  # it is none of this run


def test_a_coupling_that_remembers_something_else_is_refused(tmp_path):
    """What is known of outputs that do not say what they answer to is that of the run before."""
    fmu = native.linear(tmp_path, 2, through=None)
    root = system("root", gain("a", -3.0), gain("b", 0.5), links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))
    state = json.loads(zipfile.ZipFile(tmp_path / "a" / "state.zip").read("state.json"))
    assert {name: found["y1"] for name, found in state["answers"].items()} == {"a": ["u1"], "b": ["u1"]}
    unknown = rewritten_state(tmp_path / "a" / "state.zip", tmp_path / "u.zip", "state.json",
                              lambda c: json.dumps({**json.loads(c), "answers": {}}).encode())  # fmt: skip
    with pytest.raises(UsageError, match="algebraic loop"):
        run(path, tmp_path / "b", Options(resume=unknown))


@pytest.mark.parametrize("isolate", [False, True])
def test_what_cannot_be_saved_is_named_before_anything_runs(fmus, tmp_path, isolate, capsys):
    dumb = redescribed(fmus[2], tmp_path / "dumb.fmu", (' canSerializeFMUstate="true"', ""))
    files = {"resources/L.fmu": fmus[1], "resources/D.fmu": dumb, "resources/G.fmu": fmus[2]}
    root = system("root", constant("a", 1.0), gain("b", 1.0, source="resources/D.fmu"),
                  gain("c", 1.0, source="resources/G.fmu"))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, files)
    with pytest.raises(UsageError, match=r"component 'a': FMI 1\.0 .*component 'b': .*canSerializeFMUstate") as error:
        run(path, tmp_path / "out", Options(save_state=True, isolate=isolate))
    assert "'c'" not in str(error.value)
    assert not (tmp_path / "out").exists()
    assert main([str(path), "--check", "--save-state"]) == 2
    assert "canSerializeFMUstate" in capsys.readouterr().err


@pytest.mark.parametrize("isolate", [False, True])
def test_an_fmu_that_does_not_keep_what_it_declares_is_told_at_once(tmp_path, isolate):
    fmu = rewritten(
        tmp_path, 2, ("int fmi2SerializeFMUstate(Model *m, Model *s, char *b, size_t n) { memcpy(b, s, n); return 0; }",
                      "int fmi2SerializeFMUstate(Model *m, Model *s, char *b, size_t n) { return 3; }"))  # fmt: skip
    path = two(tmp_path / "p.ssp", fmu)
    with pytest.raises(SimulationError, match="component 'a', serializeFMUstate"):
        run(path, tmp_path / "out", Options(save_state=True, isolate=isolate))
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["steps"] == 0
    assert not (tmp_path / "out" / "state.zip").exists()


def test_an_fmu_that_does_not_take_its_state_is_named(fmus, tmp_path):
    begin = "int fmi2DeSerializeFMUstate(Model *m, const char *b, size_t n, Model **s) {"
    fmu = rewritten(tmp_path, 2, (begin, f"{begin} return 3;"))
    path = two(tmp_path / "p.ssp", fmu)
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))
    with pytest.raises(SimulationError, match="component 'a', deSerializeFMUstate"):
        run(path, tmp_path / "b", Options(resume=tmp_path / "a"))


@pytest.mark.parametrize("more", [(), ("--isolate",)])
def test_an_fmu_that_crashes_on_a_state_of_another_process_is_named(tmp_path, more):
    """Its state holds an address."""
    fmu = rewritten(
        tmp_path, 2, ("double first, last;", "double first, last; int *own;"),
        ("    reset(m);", "    reset(m); m->own = (int *)m;"),
        ("int fmi2SetFMUstate(Model *m, Model *s) {",
         "int fmi2SetFMUstate(Model *m, Model *s) { if (s->own != (int *)m) *(volatile int *)8 = 1;"),
    )  # fmt: skip
    path = two(tmp_path / "p.ssp", fmu)
    run(path, tmp_path / "a", Options(stop_time=0.5, save_state=True))
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--no-plot", "--out", str(tmp_path / "b")]
    ended = subprocess.run([*command, "--resume", str(tmp_path / "a"), *more], capture_output=True, text=True)
    assert ended.returncode == 1
    assert ended.stderr.startswith("cosim-master: component 'a' crashed (SIGSEGV)")
    assert ended.stderr.count("\n") == 1
    summary = json.loads((tmp_path / "b" / "summary.json").read_text())
    assert (summary["status"], summary["steps"]) == ("failed", 0)
