"""The page in a browser, where playwright and a Chromium are: charts, pointer, zoom, print."""


import pytest
from deepsea_cosim.gap.report import write_report

from ...browser import CHROMIUM, opened_page
from .made import diagnosis, signals

pytest.importorskip("playwright.sync_api", reason="no playwright")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """(page at 1366x768, messages of its console)."""
    path = write_report(diagnosis(), signals(), tmp_path_factory.mktemp("browser"))
    with opened_page(path) as shown:
        yield shown


def times(page):
    """Time at the pointer as every chart tells it."""
    first = "u => u.querySelector('.u-legend .u-value').innerText"
    return page.evaluate(f"Array.from(document.querySelectorAll('.uplot')).map({first})")


def test_charts_answer_pointer_and_zoom(opened):
    page, messages = opened
    assert page.locator("#charts canvas").count() == 6
    over = page.locator("#charts .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    middle = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.5 * box["width"], middle)
    page.wait_for_timeout(100)
    told = page.locator("#charts .u-legend").all_inner_texts()
    assert all("mm" in t or "bar" in t for t in told)
    assert {round(float(t.split()[0])) for t in times(page)} == {11}  # half of 22 s, in all charts
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], middle, steps=4)
    page.mouse.up()
    page.mouse.move(box["x"] + 2, middle)
    page.wait_for_timeout(100)
    assert {round(float(t.split()[0])) for t in times(page)} == {11}  # the left end now, in every chart
    page.click("#chart-reset")
    page.mouse.move(box["x"] + 2, middle)
    page.wait_for_timeout(100)
    assert {round(float(t.split()[0])) for t in times(page)} == {0}
    assert not messages


def test_run_channel_and_curves_are_chosen(opened):
    page, messages = opened
    page.select_option("#chart-run", index=1)
    page.select_option("#chart-channel", index=4)
    assert page.locator("#charts canvas").count() == 1  # a measured input has no residual
    page.select_option("#chart-channel", index=0)
    page.uncheck("[data-curve=delivered]")
    assert page.locator("#charts canvas").count() == 6
    assert page.locator("#charts .u-series.u-off").count() == 6
    page.check("[data-curve=delivered]")
    assert not messages


def test_nothing_is_wider_than_the_page(opened):
    page, _ = opened
    assert page.evaluate("document.documentElement.scrollWidth") <= 1366


def test_prints_on_paper(opened):
    page, messages = opened
    printed = page.pdf(prefer_css_page_size=True)
    assert printed.startswith(b"%PDF")
    assert not messages
