"""What a package wants said after its run."""

import json

import pytest
from deepsea_cosim.core.display_units import DisplayUnits, display_units
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.answers import Answers, _significant
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..commands import code
from ..packages import package, system
from .parts import linear

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

HALF = """
<Value name="half" unit="s" is="reaches(a.y1, 0.5, 0.001)"/><Value name="k" unit="m" is="2 * signal('a.D[1,1]')"/>
<Value name="never" unit="s" is="reaches(a.y1, 5, 0.001)"/>
<Say>It is half way after {half}, of {k:2}.</Say><Say if="half &gt; 1">Late.</Say><Say if="half &lt; 1">In time.</Say>
<Say>It arrives after {never}.</Say><Say if="missing(never)">It does
   not arrive.</Say>
"""
CLOCK = {"A": [[0, 1], [0, 0]], "B": [[0], [0]], "C": [[1, 0]], "x0": [0, 1], "D": [[1.0]]}
"""y = t."""


def clock(fmus, path, answers, **options):
    return package(path, system("root", linear("a", **CLOCK)), {"resources/L.fmu": fmus[2]}, answers=answers, **options)


def test_numbers_and_sentences(fmus, tmp_path, capsys):
    path = clock(fmus, tmp_path / "p.ssp", HALF)
    assert code(main, [str(path), "--out", str(tmp_path / "out"), "--no-plot"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[:3] == ["It is half way after 0.499 s, of 2000 mm.", "In time.", "It does not arrive."]
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["answers"]
    assert found["values"] == {
        "half": {"value": pytest.approx(0.499), "unit": "s"}, "k": {"value": 2.0, "unit": "m"},
        "never": {"value": None, "unit": "s"},
    }  # fmt: skip
    assert found["sentences"] == told[:3]


def test_a_package_without_any_says_nothing(fmus, tmp_path):
    result = run(clock(fmus, tmp_path / "p.ssp", ""), tmp_path / "out", Options())
    assert result.answers is None
    assert "answers" not in result.summary


@pytest.mark.parametrize(
    ("answers", "words"),
    [('<Value name="a" is="a.z1"/>', "'a' is not told: there is no signal or parameter 'a.z1'; did you mean"),
     ('<Value name="a" is="1 +"/>', "'1 +' is no formula"),
     ('<Value name="a" is="a.y1"/>', "it is a signal, no number"),
     ("<Say>{b}</Say>", "the sentence is not said: there is no value 'b'"),
     ("<Say>{end:0}</Say>", "the sentence is not said: '{end:0}' is no place of a value; expected {name}, or"),
     ("<Say>{end:12}</Say>", "the sentence is not said: '{end:12}' is no place of a value; expected {name}, or"),
     ('<Say if="x &gt; 1">So.</Say>', "the sentence is not said: there is no signal or parameter 'x'")],
)  # fmt: skip
def test_what_cannot_be_told_is_a_warning_with_its_place(fmus, tmp_path, answers, words):
    """Once, and the rest is told."""
    path = clock(fmus, tmp_path / "p.ssp", answers + '<Value name="end" is="final(a.y1)"/><Say>At {end}.</Say>')
    result = run(path, tmp_path / "out", Options())
    (warning,) = result.summary["warnings"]
    assert warning.startswith("SystemStructure.ssd, line ")
    assert words in warning
    assert result.answers.texts(DisplayUnits()) == ["At 1.00."]
    if "no number" not in words:  # that shows in the run
        assert any(words in text for text in check(path).warnings)


@pytest.mark.parametrize(
    ("answers", "words"),
    [("<Tell/>", "<Tell> is no part of <Answers>"), ('<Value name="a"/>', "lacks the attribute 'is'")],
)
def test_what_is_no_answer_is_refused(fmus, tmp_path, answers, words):
    with pytest.raises(PackageError, match=words):
        run(clock(fmus, tmp_path / "p.ssp", answers), tmp_path / "out", Options())


def test_a_part_of_a_run_does_not_answer(fmus, tmp_path):
    """A time from the start would be one from where it goes on."""
    path = clock(fmus, tmp_path / "p.ssp", HALF, stop=2.0)
    run(path, tmp_path / "a", Options(stop_time=1.0, save_state=True))
    assert run(path, tmp_path / "b", Options(resume=tmp_path / "a")).answers is None


@pytest.mark.parametrize(
    ("x", "digits", "text"),
    [(7.6371, 3, "7.64"), (11000.0, 4, "11000"), (3000.0, 4, "3000"), (0.0, 3, "0"), (-0.01234, 2, "-0.012"),
     (199.96, 3, "200"), (5.0, 3, "5.00"), (1.5e-9, 3, "1.5e-09"), (20.0, 3, "20.0"), (1e9, 3, "1e+09")],
)  # fmt: skip
def test_digits(x, digits, text):
    assert _significant(x, digits) == text


def test_units_of_the_reader():
    found = Answers({"P": (2e7, "Pa"), "share": (0.5, ""), "none": (0.0, "m")}, ("{P} {share} {none}",))
    assert found.texts(DisplayUnits()) == ["20.0 MPa 0.500 0 m"]
    assert found.texts(display_units("bar")) == ["200 bar 0.500 0 m"]
