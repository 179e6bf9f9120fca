"""report.html of a toy: self-contained, readable for each verdict, and as a browser shows it."""

import re
from concurrent.futures import Executor, Future
from copy import copy
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from deepsea_cosim.core.errors import OutputError
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.report import write_report
from deepsea_cosim.gap.report.numbers import change, given, percent, pretty, short, with_interval
from deepsea_cosim.gap.report.plots import decimate
from deepsea_cosim.gap.report.series import Dependence
from deepsea_cosim.gap.result.diagnosis import make
from deepsea_cosim.gap.selection.posterior import NONE, UNKNOWN
from threadpoolctl import threadpool_limits

from tests import browser
from tests.toys import package

from .oscillator import campaign, measure

NASTY = """pool <script>alert("1")</script> & 'ß' $_{"""
EVENT = """[[run.event]]
connector = "o.x"
target = 0.0
within = 0.2
after = 0.5
std = 0.05
at_most = 3.9
"""


class Inline(Executor):
    """Runs jobs at once, in this process."""

    def submit(self, function, /, *args, **kwargs):
        future = Future()
        future.set_result(function(*args, **kwargs))
        return future


@pytest.fixture(scope="module")
def rubbing(toys, tmp_path_factory):
    """The diagnosis of a machine that rubs: a run held out, two fitted, one of them with an event."""
    folder = tmp_path_factory.mktemp("report")
    runs = [measure(seed, lambda t, x, v: -0.4 * np.tanh(v / 0.01))[:201] for seed in (1, 2, 3)]
    path = campaign(folder, toys, runs, more=EVENT)
    package(folder / "toy.ssp", {"o": toys / "Oscillator.fmu"}, stop=4.0, step=4e-3)
    text = path.read_text().replace('"run0.csv"', '"run0.csv"\nuse = "holdout"\nparameters = { "o.d" = 3.0 }')
    path.write_text(text.replace('name = "toy"', f"name = '''{NASTY}'''"))
    with threadpool_limits(1):
        return diagnose(read(path), Inline())


def with_verdict(d, effects):
    """The same diagnosis with another cause first."""
    top = next(c for c in d.causes if c.effects == effects)
    rest = [replace(c, probability=0.1 / (len(d.causes) - 1)) for c in d.causes if c is not top]
    return replace(d, causes=[replace(top, probability=0.9), *rest])


class Page(HTMLParser):
    """What a test wants to know of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.texts, self.inside = [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in ("img", "meta", "wbr", "br"):
            self.inside.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        while self.inside and self.inside.pop() != tag:
            pass

    def handle_data(self, data):
        for tag in self.inside:
            self.texts[tag] = self.texts.get(tag, "") + data

    def all(self, tag):
        return [a for t, a in self.tags if t == tag]


@pytest.fixture(scope="module", params=["explained", "none", "unknown"])
def page(request, rubbing, tmp_path_factory):
    """(kind, contents of diagnosis.json, path, text, parsed page) for every verdict."""
    d = rubbing
    if request.param != "explained":
        d = with_verdict(d, NONE if request.param == "none" else UNKNOWN)
    data = make(d)
    path = write_report(d, data, tmp_path_factory.mktemp(request.param))
    text = path.read_text(encoding="utf-8")
    return request.param, data, path, text, Page(text)


def test_verdict_comes_first(page):
    kind, data, _, _, parsed = page
    verdicts = {"explained": "explained", "none": "no_significant_gap", "unknown": "unknown_effect"}
    assert data["verdict"] == verdicts[kind]
    assert parsed.texts["h1"].strip() == data["sentence"]
    headings = [t for t, _ in parsed.tags if t in ("h1", "h2", "h3", "h4")]
    assert headings[0] == "h1"
    assert headings.count("h1") == 1
    assert parsed.all("body")[0]["class"] == kind


def test_needs_nothing_else(page):
    _, _, path, text, parsed = page
    assert not parsed.all("script")
    assert not parsed.all("link")
    assert not re.search(r"@import|url\(", parsed.texts["style"])
    for tag, attributes in parsed.tags:
        for name in ("src", "href", "srcset", "data", "poster"):
            value = attributes.get(name)
            assert value is None or re.match(r"data:image/|#\w+$|calibrated\.ssv$|diagnosis\.json$", value), tag
    assert path.stat().st_size < 3e6
    assert "<script>alert" not in text


def test_pictures_have_words(page):
    parsed = page[4]
    images = parsed.all("img")
    assert len(images) >= 3  # a channel in three runs
    assert all(len(a["alt"]) > 20 for a in images)
    assert all(a.get("aria-label") or a.get("aria-hidden") for a in parsed.all("svg"))
    assert all(f'id="{a["href"][1:]}"' in page[3] for a in parsed.all("a") if a["href"].startswith("#"))


def test_tells_what_matters(page):
    kind, data, _, _, parsed = page
    body = " ".join(parsed.texts["body"].split())
    assert f"{data['gap']['before']:.2f}"[:3] in body
    assert "run0 (held out)" in body
    assert "o.x reaches 0" in body
    assert "≤ 3.90" in body
    assert "o.m" in body
    assert "halving the step" in body
    if kind == "explained":
        assert "F_c = " in body
        assert "the slide rubs" in body
        assert "with the cause" in body
    if kind == "none":
        assert "with the cause" not in body
        assert body.index("Refitted base parameters") < body.index("Where the gap lies")
    if kind == "unknown":
        assert body.index("What nothing in the catalogue explains") < body.index("Measured against simulated")


def test_a_folder_that_cannot_be_written(rubbing, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_report(rubbing, make(rubbing), tmp_path / "file")


def test_bare_diagnosis(rubbing, tmp_path):
    """No regions, replays, screening, next run, warnings: every section still reads."""
    s = copy(rubbing.study)
    s.screened = []
    d = replace(rubbing, study=s, masks={}, replays=[], next=None, warnings=[])
    assert "could explain as much as 1%" in write_report(d, make(d), tmp_path).read_text(encoding="utf-8")


@pytest.mark.skipif(not browser.available, reason="no chromium")
def test_browser_shows_it(page, tmp_path):
    kind, _, path, _, _ = page
    pixels = browser.pixels(path, tmp_path).reshape(-1, 3)
    tone = {"explained": (0, 114, 178), "none": (0, 121, 90), "unknown": (179, 71, 0)}[kind]
    assert (np.abs(pixels.astype(int) - tone).max(1) < 3).sum() > 1000  # badge and rule in the colour of the verdict


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (short(0.0), "0"),
        (short(-0.012345), "−0.0123"),
        (short(123456.0), "1.23 × 10⁵"),
        (short(8.2e-5, 2), "8.2 × 10⁻⁵"),
        (short(999.96), "1000"),
        (given(1400000000.0), "1.4 × 10⁹"),
        (given(True), "true"),
        (given(3000.0), "3000"),
        (percent(0.003), "<1%"),
        (percent(0.9999), ">99%"),
        (percent(1.0), "100%"),
        (percent(-0.25), "−25%"),
        (change(-0.0001), "0%"),
        (change(0.0312), "+3.1%"),
        (pretty("m3/(s.Pa)"), "m³/(s·Pa)"),
        (pretty("1"), ""),
        (with_interval(249.57, (246.5, 252.6)), ("249.6", "246.5 to 252.6", "")),
        (with_interval(3.66e-4, (1.4e-4, 5.9e-4)), ("3.7", "1.4 to 5.9", " × 10⁻⁴")),
        (with_interval(2.0e7, (1.9999e7, 2.0001e7)), ("2.0000", "1.9999 to 2.0001", " × 10⁷")),
        (with_interval(0.0, (0.0, 0.0)), ("0", "0 to 0", "")),
    ],
)
def test_numbers(shown, expected):
    assert shown == expected


def test_decimation_keeps_peaks():
    t = np.linspace(0.0, 1.0, 20000)
    y = np.zeros_like(t)
    y[[1234, 17000]] = 5.0, -3.0
    ts, ys = decimate(t, y)
    assert len(ts) < 1600
    assert (ys.max(), ys.min()) == (5.0, -3.0)
    assert (ts[0], ts[-1]) == (0.0, 1.0)
    assert (np.diff(ts) > 0).all()


@pytest.mark.parametrize("odd", [False, True])
def test_a_narrow_dependence_is_seen(odd):
    """A wave of a few millimetres along a path that is taken to and fro."""
    t = np.arange(0.0, 40.0, 0.02)
    x = 50.0 * (1.0 - np.cos(2 * np.pi * t / 13.0))
    way = np.sign(np.gradient(x)).astype(int)
    wave = np.sin(2 * np.pi * x / 20.0) * (way if odd else 1)
    e = wave + np.random.default_rng(0).normal(0.0, 0.1, len(t))
    fold = (t / 2.0).astype(int) % 5
    found = Dependence("x", "mm", "x", "mm", x, e, way, fold, 0.1)
    assert found.share > 0.85
    assert found.odd == odd
    noise = Dependence("x", "mm", "x", "mm", x, np.random.default_rng(1).normal(size=len(t)), way, fold, 0.1)
    assert noise.share < 0.05
