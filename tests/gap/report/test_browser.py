"""The page in a browser, where playwright and a Chromium are: charts, pointer, zoom, print."""

import shutil

import pytest
from deepsea_cosim.gap.report import write_report

from .made import diagnosis, signals

sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """(page at 1366x768, messages of its console)."""
    path = write_report(diagnosis(), signals(), tmp_path_factory.mktemp("browser"))
    with sync_api.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        messages = []
        page.on("console", lambda m: messages.append(m.text))
        page.on("pageerror", lambda e: messages.append(str(e)))
        page.goto(path.as_uri())
        yield page, messages
        browser.close()


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
