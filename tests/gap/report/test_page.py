"""The page: every verdict, nothing loaded from elsewhere, strangers' names as text, what a browser makes of it."""

import re
import tomllib
from html.parser import HTMLParser
from pathlib import Path

import pytest
from deepsea_cosim.core import vendored
from deepsea_cosim.core.errors import OutputError
from deepsea_cosim.gap import report
from deepsea_cosim.gap.report import render, write_report
from deepsea_cosim.gap.report.page import SECTIONS

from .made import HEADLINES, NASTY, VERDICTS, diagnosis, signals, unexplained

EVENT = {
    "run": "run01", "event": "x reaches 0.2", "limit": "", "measured": 7.625, "std": 0.02, "delivered": 6.206,
    "calibrated": 7.729, "explained": 7.634,
}  # fmt: skip
CONTRAST = {**EVENT, "runs": ["run01", "run02"], "changed": "viscosity", "measured": 0.447}
CURVE = {
    "id": "friction_curve", "what": "piston friction", "effect": "coulomb_friction", "x": "m/s", "y": "N",
    "points": [[-0.1, -500.0], [0.0, 0.0], [0.1, 510.0]], "probability": 0.93,
    "band95": [[-550.0, -450.0], [-20.0, 20.0], [450.0, 560.0]],
    "plain": [[-0.1, -480.0], [0.0, 0.0], [0.1, 480.0]], "knots": [[-0.1, -20.0], [0.1, 30.0]],
}  # fmt: skip


class Page(HTMLParser):
    """What a test wants to know of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.texts, self.inside = [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in ("meta", "br", "input", "img"):
            self.inside.append(tag)

    def handle_endtag(self, tag):
        while self.inside and self.inside.pop() != tag:
            pass

    def handle_data(self, data):
        for tag in set(self.inside):
            self.texts[tag] = self.texts.get(tag, "") + data

    def all(self, tag):
        return [a for t, a in self.tags if t == tag]

    @property
    def sections(self):
        return [a["id"] for a in self.all("section")]

    @property
    def words(self):
        return " ".join(self.texts["main"].replace("\u00a0", " ").split())


@pytest.fixture(scope="module", params=VERDICTS)
def page(request):
    """(verdict, text, parsed page)."""
    text = render(diagnosis(request.param), signals(request.param))
    return request.param, text, Page(text)


def test_the_verdict_and_the_budget_come_first(page):
    verdict, _, parsed = page
    assert parsed.texts["h1"] == HEADLINES[verdict].split(". ")[0]
    assert parsed.all("body")[0]["class"] == verdict
    assert parsed.sections[:2] == ["headline", "budget"]
    order = [s.id for s in SECTIONS]
    assert parsed.sections == [s for s in order if s in parsed.sections]
    assert "curves" not in parsed.sections
    assert "events" not in parsed.sections


def test_needs_nothing_else(page):
    _, text, parsed = page
    assert len(text.encode()) < 2e6
    assert not parsed.all("link")
    assert not re.search(r"@import|url\(", parsed.texts["style"])
    for tag, attributes in parsed.tags:
        for name in ("src", "srcset", "data", "poster"):
            assert name not in attributes, tag
        assert re.fullmatch(r"#\w+|calibrated\.ssv|diagnosis\.json", attributes.get("href", "#x")), tag
        if tag == "a" and attributes["href"].startswith("#"):
            assert attributes["href"][1:] in [a.get("id") for _, a in parsed.tags]


def test_drawings_are_told_in_words(page):
    parsed = page[2]
    assert all(a.get("aria-label") or a.get("aria-hidden") for a in parsed.all("svg"))
    assert all(a["title"] for a in parsed.all("abbr"))


def test_tells_what_matters():
    words = Page(render(diagnosis(), signals())).words
    for told in ("62 %", "56 to 66 %", "510 N (430 to 600 N; without the effect 0 N)", "0.426 mm", "run03 (held out)",
                 "depth 11000 m", "One more run with depth = 6000 m.",
                 "6.10 times the noise (RMS) that no refit closes: clearly apart",
                 "97 % sure, now it is 58 %",
                 "2.200 × 10⁻⁵ m²/s", "27 of the 30 effects", "nepce, macro step 2.00 ms (8.00 ms in the search)",
                 "70 to 77 %", "0.38 times the noise; that is taken out",
                 "unequal lands", "foretold by the other runs"):  # fmt: skip
        assert told in words, told
    assert words.count("run02: the clock is 3 % off") == 1


def test_cautions_stand_beside_the_verdict_once():
    said = ["Not finished: stopped while refinement.", "a.F stands at the end of the allowed range."]
    whole = " ".join([HEADLINES["explained"], *said])
    data = diagnosis("explained", headline=whole, cautions=said, finished=False, unfinished_stage="refinement")
    data["hypotheses"][0] |= {"status": "stalled", "probability": 0.4}
    parsed = Page(render(data, signals("explained")))
    assert parsed.texts["li"].startswith("".join(said))
    before = parsed.words[: parsed.words.index("Budget of the gap")]
    for told in (*said, "did not come to its end", "40 % only"):
        assert before.count(told) == 1, told


def test_moments_and_curves_have_sections_where_there_are_some():
    data = diagnosis(events=[EVENT, {**EVENT, "limit": "at most"}], contrasts=[CONTRAST], curves=[CURVE])
    parsed = Page(render(data, signals()))
    assert {"events", "curves"} <= set(parsed.sections)
    for told in ("7.625", "at most 7.625", "7.634 (0.45)", "run01 − run02", "piston friction", "93 %",
                 "the plain form of coulomb_friction"):
        assert told in parsed.words, told


def test_from_a_diagnosis_folder_alone():
    parsed = Page(render(diagnosis()))
    assert "signals" not in parsed.sections
    assert not parsed.all("script")
    assert "4.26 × 10⁻⁴ m" in parsed.words


def test_a_bare_diagnosis_reads():
    data = diagnosis(
        "unexplained", where=[], replay=[], effects={}, hypotheses=[], warnings=[], next_experiment=None,
        next_channel=None, calibration={"moved": {}}, observations=[],
    )  # fmt: skip
    data["budget"] |= {"per_channel": {}, "per_run": {}, "per_region": {}, "parts": [unexplained(1.0, 9.7)]}
    data["numerics"] = {**data["numerics"], "step_error": None}
    parsed = Page(render(data))
    assert parsed.sections == ["headline", "budget", "left", "next", "method"]


def test_strangers_names_are_only_text():
    def renamed(value):
        if isinstance(value, dict):
            return {k.replace("run01", NASTY): renamed(v) for k, v in value.items()}
        if isinstance(value, list):
            return [renamed(v) for v in value]
        return value.replace("run01", NASTY).replace("text of", NASTY) if isinstance(value, str) else value

    data = renamed(diagnosis(campaign=NASTY, headline=NASTY, warnings=[NASTY]))
    text = render(data, signals())
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u202e]", text)
    assert len(Page(text).all("script")) == 3


def test_a_name_in_the_embedded_series_ends_no_script():
    made = signals()
    evil = made.channels[0].__class__("arm.x_h", "</script><script>alert(1)</script>", "mm", 1e3)
    text = render(diagnosis(), made.__class__(made.system, (evil, *made.channels[1:]), made.runs))
    assert "</script><script>alert" not in text
    assert len(Page(text).all("script")) == 3


def test_all_that_the_page_is_made_of_is_in_the_distribution():
    folders = Path(report.__file__).parent / "templates", Path(vendored.__file__).parent / "vendor"
    settings = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["tool"]["setuptools"]
    packed = {path for pattern in settings["package-data"]["*"] for f in folders for path in f.parent.glob(pattern)}
    for file in (p for folder in folders for p in folder.iterdir()):
        assert file in packed, file
    assert any("LICENSE" in p.name for p in packed)


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_report(diagnosis(), signals(), tmp_path / "file")


def test_sets_of_effects_are_told_with_their_forms():
    data = diagnosis()
    effect = data["hypotheses"][0]["effects"][0]
    data["hypotheses"][0]["forms"] = {effect: "unequal_lands"}
    assert f"{effect} [unequal_lands]" in Page(render(data)).words


def test_a_tolerance_that_is_a_factor_is_told_as_one(tmp_path):
    data = diagnosis()
    name, moved = next(iter(data["calibration"]["moved"].items()))
    moved |= {"tolerance": 9.0, "tolerance_factor": 10.0}
    page = write_report(data, signals(), tmp_path).read_text(encoding="utf-8")
    assert "× or ÷\u00a010" in page
    assert "900" not in page[page.index(name) :][:600]
