"""The page in a browser, where playwright and a Chromium are: signals, zoom, cursors, the system's diagram."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.page.write import write_page

from ...browser import CHROMIUM, opened_page
from .made import result_folder

pytest.importorskip("playwright.sync_api", reason="no playwright")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")

T = np.arange(2001) / 100.0
COLUMNS = {
    "a.x": (0.001 * T, "float", "m"), "a.y": (0.002 * T, "float", "m"), "b.u": (0.001 * T, "float", "m"),
    "b.F": (5.0 * T**2, "float", "N"), "b.on": (T > 10.0, "boolean", None),
    "b.s": (np.where(T > 5.0, "late", "<i>early</i>").tolist(), "text", None),
}  # fmt: skip


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """(page at 1366x768, messages of its console)."""
    folder = tmp_path_factory.mktemp("browser")
    links = [["a.x", "b.u"], ["b.F", "a.F"]]
    path = write_page(result_folder(folder / "run", COLUMNS, T, connections=links))
    with opened_page(path) as shown:
        yield shown


def number(text):
    return float(text.split()[0].replace("−", "-"))


def cell(page, name, which):
    return page.locator(f".legend tr:has(.name[title='{name}']) td.{which}").inner_text()


def test_a_person_at_the_page(opened):
    page, messages = opened
    assert page.locator("#panels canvas").count() == 2  # what drives something: a length and a force
    page.fill("#search", "a.y")
    assert page.locator("#list label:visible").count() == 1
    page.check("#list label:visible input")
    page.fill("#search", "")
    assert page.locator("#panels canvas").count() == 2  # a.y is a length, too
    page.fill("#a", "4")
    page.press("#a", "Enter")
    page.fill("#b", "9")
    page.press("#b", "Enter")
    page.wait_for_timeout(60)
    assert [number(cell(page, "a.y", w)) for w in "abd"] == [8.0, 18.0, 10.0]  # mm
    assert [number(cell(page, "b.F", w)) for w in "abd"] == [0.08, 0.405, 0.325]  # kN
    assert "5 s" in page.inner_text("#dt")

    over = page.locator("#panels .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    middle = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.25 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], middle, steps=4)
    page.mouse.up()
    page.wait_for_timeout(60)
    low, high = page.evaluate("page.range")
    assert [low, high] == pytest.approx([5.0, 10.0], abs=0.05)
    assert page.evaluate("page.panels.map((p) => [p.plot.scales.x.min, p.plot.scales.x.max])") == [[low, high]] * 2
    page.mouse.click(box["x"] + 0.5 * box["width"], middle)
    page.wait_for_timeout(60)
    assert float(page.input_value("#a")) == pytest.approx(7.5, abs=0.05)
    assert number(page.inner_text("#t")) == pytest.approx(7.5, abs=0.05)
    assert number(cell(page, "b.F", "at")) == pytest.approx(0.005 * 7.5**2, rel=0.02)
    page.keyboard.down("Shift")  # pan
    page.mouse.move(box["x"] + 0.5 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], middle, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    page.wait_for_timeout(60)
    assert page.evaluate("page.range") == pytest.approx([4.0, 9.0], abs=0.05)
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], middle)
    page.wait_for_timeout(60)
    assert page.evaluate("page.range") == [0.0, 20.0]
    assert not messages


def test_the_diagram_has_the_values(opened):
    page, messages = opened
    page.locator("#slider").fill("500")
    page.wait_for_timeout(60)
    assert page.locator("#diagram .box").count() == 2
    assert page.locator("#diagram .wire").count() == 2
    assert sorted(page.locator("#diagram .value").all_text_contents()) == ["0.5 kN", "10 mm"]
    assert not messages


def test_switches_and_texts(opened):
    page, messages = opened
    for name in ("b.on", "b.s"):
        page.evaluate(f"page.choose('{name}', true)")
    for t, on, word in ((2.0, "false", "<i>early</i>"), (12.0, "true", "late")):
        page.evaluate(f"page.set_time('at', {t})")
        page.wait_for_timeout(60)
        assert (cell(page, "b.on", "at"), cell(page, "b.s", "at")) == (on, word)
    assert page.locator("#panels i").count() == 0
    assert not messages


def test_nothing_is_wider_than_the_page(opened):
    page, _ = opened
    assert page.evaluate("document.documentElement.scrollWidth") <= 1366


@pytest.mark.parametrize("columns", [{"a.x": [1.5]}, {"a.x": []}, {"a.x": [np.nan, np.nan]}, {"a.x": [1.0, np.inf]}])
def test_little_to_see_is_no_error(opened, tmp_path, columns):
    page, messages = opened
    page.goto(write_page(result_folder(tmp_path / "run", columns)).as_uri())
    page.wait_for_timeout(60)
    assert page.locator("#panels canvas").count() == 1
    assert not messages
