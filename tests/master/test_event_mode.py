"""FMI 3.0: what FMUs are told of event mode, early return and intermediate update, and what is said of clocks."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import run

from benchmarks import native

from ..packages import component, package, system
from .parts import redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

INSTANTIATE = "Bool events, Bool early, const unsigned *r, size_t n, void *e, void *log, void *update) {\n"
CLOCK = (
    '<Clock name="tick" valueReference="1500" causality="input" variability="discrete" intervalVariability="constant" '
    'intervalDecimal="0.1"/>'
)


def fmu_with(folder, *changes, described=()):
    """The native FMU of FMI 3.0 with replacements in its source, each of which must apply, and its description."""
    text = (native.HERE / "fmus" / "linear.c").read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    folder.mkdir()
    (folder / "own.c").write_text(text)
    fmu = native.packed(folder / "own.fmu", 3, native.compiled(folder / "own.c", 3, folder / "L.so"))
    return redescribed(fmu, folder / "L.fmu", *described)


def clocked(folder, *changes, event_mode=True):
    """An FMU with a periodic input clock on which its output y6 hangs."""
    y6 = '<Float64 name="y6" valueReference="15" causality="output" variability="'
    able = 'canGetAndSetFMUState="true"'
    return fmu_with(folder, *changes, described=(
        (able, f'{able} hasEventMode="{str(event_mode).lower()}"'),
        (f'{y6}continuous"', f'{y6}discrete" clocks="1500"'),
        ('<Float64 name="time"', f'{CLOCK}<Float64 name="time"'),
    ))  # fmt: skip


def alone(tmp_path, fmu):
    return package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu")), {"resources/L.fmu": fmu})


REFUSES = {
    "its first step": (1, ("    (void)keep;\n    *event = ", "    (void)keep;\n    return 3;\n    *event = ")),
    "to be instantiated": (2, (INSTANTIATE, f"{INSTANTIATE}    if (!events) return 0;\n")),
}
"""The exit code, and what is changed in the FMU's source."""


@pytest.mark.parametrize("isolate", [(), ("--isolate",)])
@pytest.mark.parametrize("refused", REFUSES)
def test_the_check_and_the_error_name_event_mode(tmp_path, capsys, refused, isolate):
    code, change = REFUSES[refused]
    path = alone(tmp_path, clocked(tmp_path / "f", change))
    assert main([str(path), "--check"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if "event mode" in line]
    assert len(told) == 1
    assert told[0].startswith("warning: component 'a'")
    assert "'tick'" in told[0]
    assert "'y6'" in told[0]
    assert main([str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet", *isolate]) == code
    error = capsys.readouterr().err.splitlines()[-1]
    assert "component 'a'" in error
    assert "event mode" in error


def test_one_that_runs_without_it_runs_and_is_told(tmp_path):
    summary = run(alone(tmp_path, clocked(tmp_path / "f")), tmp_path / "out").summary
    assert summary["status"] == "ok"
    assert sum("event mode" in w and "'y6'" in w for w in summary["warnings"]) == 1


def test_clocks_without_event_mode_are_the_business_of_the_fmu(tmp_path):
    found = check(alone(tmp_path, clocked(tmp_path / "f", event_mode=False)))
    assert not found.errors
    assert [w for w in found.warnings if "'tick'" in w and "event mode" not in w]


def test_event_mode_without_clocks_is_no_matter(tmp_path):
    """The FMU then handles its events in its steps, as the standard has it."""
    able = 'canGetAndSetFMUState="true"'
    fmu = fmu_with(tmp_path / "f", described=((able, f'{able} hasEventMode="true"'),))
    assert not [w for w in check(alone(tmp_path, fmu)).warnings if "event mode" in w]


def test_nothing_is_asked_of_fmus_that_the_table_says_is_not_supported(tmp_path):
    """No event mode, no early return, no intermediate update: else this FMU gives no instance."""
    refuses = INSTANTIATE + "    if (events || early || n || update) return 0;\n"
    path = alone(tmp_path, fmu_with(tmp_path / "f", (INSTANTIATE, refuses)))
    assert run(path, tmp_path / "out").summary["steps"] == 10


def test_an_early_return_that_nobody_allowed_ends_the_run_with_its_time(tmp_path, capsys):
    early = "    *last = m->last;\n", "    *last = m->last; *early = t > 0.45;\n"
    path = alone(tmp_path, fmu_with(tmp_path / "f", early))
    assert main([str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet"]) == 1
    assert "component 'a' came back early from its step at t = 0.5 s" in capsys.readouterr().err
