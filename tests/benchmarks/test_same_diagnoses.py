"""The comparison of diagnoses; and the code of another tree runs as it is, without modules of the installed one."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.same_diagnoses import commits
from benchmarks.same_diagnoses.__main__ import REPOSITORY, SOURCES
from benchmarks.same_diagnoses.campaigns import CAMPAIGNS
from benchmarks.same_diagnoses.compare import diagnosis_differences, text_differences
from benchmarks.same_diagnoses.made import cut

DIAGNOSIS = {
    "gap": {"per_channel": {"arm.x_h": {"rms_after": 0.1}}, "after": 1.0},
    "causes": [{"effects": ["a"], "gap_after": 1.5}, {"effects": [], "gap_after": float("nan")}],
    "timing": {"wall_s": 3.0, "stages": {"reading": 0.1}, "simulations": 90},
}


def changed(**parts):
    return {**DIAGNOSIS, **parts}


def test_wall_times_alone_may_differ():
    later = changed(timing={"wall_s": 4.0, "stages": {"else": 2.0}, "simulations": 90})
    assert diagnosis_differences(DIAGNOSIS, later) == []


@pytest.mark.parametrize(
    ("later", "field", "before", "after"),
    [
        (changed(timing={"wall_s": 3.0, "simulations": 91}), "timing/simulations", "90", "91"),
        (changed(gap={"per_channel": {"arm.x_h": {"rms_after": 0.1}}, "after": 1}), "gap/after", "1.0", "1"),
        (changed(more=[]), "more", "(missing)", "[]"),
        (changed(causes=[DIAGNOSIS["causes"][0], {"effects": [], "gap_after": 0.0}]),
         "causes/1/gap_after", "nan", "0.0"),
        (changed(gap={"per_channel": {"arm.x_h": {"rms_after": 0.1 + 2e-17}}, "after": 1.0}),
         "gap/per_channel/arm.x_h/rms_after", "0.1", "0.10000000000000002"),
    ],
)  # fmt: skip
def test_what_differs_in_the_last_digit_is_told(later, field, before, after):
    (found,) = diagnosis_differences(DIAGNOSIS, later)
    assert (found.field, found.before, found.after) == (field, before, after)


def test_a_field_may_have_another_name():
    later = changed(causes=[{"effects": c["effects"], "left": c["gap_after"]} for c in DIAGNOSIS["causes"]])
    later["budget"] = later.pop("gap")
    names = {"causes/*/gap_after": "causes/*/left", "gap": "budget"}
    assert diagnosis_differences(DIAGNOSIS, later, names) == []
    assert len(diagnosis_differences(DIAGNOSIS, later)) == 8


def test_a_sum_in_another_order_is_told_from_another_method():
    (rounded,) = diagnosis_differences({"gap": 1.0}, {"gap": 1.0 + 1e-12})
    (other,) = diagnosis_differences({"gap": 1.0}, {"gap": "none"})
    assert 5e-13 < rounded.size < 2e-12
    assert other.size == math.inf


def test_lines_that_differ():
    (found,) = text_differences("a.ssv", "one\ntwo\n", "one\nthree\n")
    assert (found.field, found.before, found.after) == ("a.ssv line 2", "two", "three")
    assert text_differences("a.ssv", "one\n", "one\ntwo\n")[0].before == "(missing)"


@pytest.fixture
def other_tree(tmp_path):
    """A source tree whose deepsea_cosim.gap has one module only."""
    (tmp_path / "tree" / "gap").mkdir(parents=True)
    (tmp_path / "tree" / "gap" / "__init__.py").touch()
    (tmp_path / "tree" / "gap" / "only_here.py").touch()
    text = '[tool.setuptools.package-dir]\n"deepsea_cosim.gap" = "gap"\n"deepsea_cosim.gap.report" = "gap/report"\n'
    (tmp_path / "tree" / "pyproject.toml").write_text(text)
    return tmp_path / "tree"


@pytest.mark.parametrize(
    ("module", "there"),
    [("deepsea_cosim.gap.only_here", True), ("deepsea_cosim.gap.cli", False), ("deepsea_cosim.master.cli", False)],
)
def test_the_code_of_a_tree_is_not_merged_with_the_installed_code(other_tree, tmp_path, module, there):
    code = commits.prepared(other_tree, None, tmp_path / "links")
    done = subprocess.run([sys.executable, "-c", f"import {module}"], env=code.environment, capture_output=True)
    assert (done.returncode == 0) == there


def test_a_catalogue_is_cut_to_a_few_effects():
    a, b = ('[[base]]\nparameter = "a"\n', '[[base]]\nparameter = "b"\n')
    form = '[[effect.form]]\nid = "bent"\n[[effect.form.parameter]]\naddress = "bend"\n'
    one, two = (f'[[effect]]\nid = "{i}"\n[[effect.parameter]]\naddress = "{i}"\n{form}' for i in ("one", "two"))
    curve = '[[curve]]\nid = "free"\neffects = ["one"]\n[curve.plain]\nc = [1]\n'
    sensor, region = '[[sensor]]\nid = "late"\n', "[[region]]\n"
    whole = f"# head\n{a}{b}{one}{two}{curve}{sensor}{region}"
    assert cut(whole, ("two",), ("b",)) == f"# head\n{b}{two}{region}"
    assert cut(whole, ("one", "late"), ("a", "b")) == f"# head\n{a}{b}{one}{curve}{sensor}{region}"


LOADED = """
import sys
from pathlib import Path
import benchmarks.same_diagnoses.campaigns
files = [m.__file__ for m in list(sys.modules.values()) if getattr(m, "__file__", None)]
print(*files, *(name for name in sys.modules if name.startswith("deepsea_cosim")), sep="\\n")
"""


def test_measurements_depend_on_known_files_and_on_nothing_that_is_compared():
    done = subprocess.run([sys.executable, "-c", LOADED], cwd=REPOSITORY, capture_output=True, text=True, check=True)
    loaded = done.stdout.splitlines()
    ours = {p.relative_to(REPOSITORY).as_posix() for p in map(Path, loaded) if p.is_relative_to(REPOSITORY)}
    ours = {name for name in ours if name.startswith(("benchmarks/", "tests/")) and (REPOSITORY / name).stat().st_size}
    assert not [name for name in loaded if name.startswith("deepsea_cosim")]
    assert {"benchmarks/blind/plant.py", "tests/gap/oscillator.py"} <= ours
    assert ours - {"benchmarks/same_diagnoses/campaigns.py"} <= set(SOURCES)


def test_names_of_campaigns_are_their_own():
    assert len({small.name for small in CAMPAIGNS}) == len(CAMPAIGNS) == 12
