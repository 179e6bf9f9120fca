"""The page of a long run in Chromium: its size, the time to make it, to load it, and of a frame at zoom and pan.

    python -m benchmarks.page [--rows 1000000] [--signals 40] [--format csv|parquet|h5]

The signals swing at different rates with noise on top, so that no point can be left out. Needs playwright and a
Chromium; without, it tells the sizes only.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import perf_counter

import numpy as np
from deepsea_cosim.master.page.write import write_page
from deepsea_cosim.master.results import open_writer
from deepsea_cosim.master.results.columns import TIME, Column

BLOCK = 50_000
SHOWN = 12
"""Signals that are drawn, in panels of four units."""

FRAMES = """
async (work) => {
  const took = [], steps = work === "zoom" ? 60 : 120;
  const [first, last] = page.whole, width = last - first;
  page.reset();
  await new Promise(requestAnimationFrame);
  if (work === "pan") page.show_range(first, first + 0.3 * width);
  await new Promise((done) => setTimeout(done, 200));
  for (let k = 0; k < steps; k++) {
    if (work === "zoom") page.zoom(k < steps / 2 ? 0.8 : 1.25, first + 0.4 * width);
    else if (work === "pan") page.pan(k < steps / 2 ? 0.02 : -0.02);
    else page.set_time("at", first + (k / steps) * width);
    const begin = performance.now();
    await new Promise(requestAnimationFrame);   // the page draws in this one
    await new Promise((done) => setTimeout(done, 0));
    took.push(performance.now() - begin);
  }
  took.sort((a, b) => a - b);
  return [took[took.length >> 1], took[Math.floor(0.95 * took.length)]];
}
"""
"""Median and 95th percentile [ms] from asking for a view to its being drawn; a screen of 60 Hz has 16.7 ms."""


def make_folder(folder: Path, rows: int, signals: int, suffix: str) -> None:
    """A result folder of a run that never was."""
    names = [f"{'ab'[k % 2]}.y{k}" for k in range(signals)]
    units = {name: ("m", "Pa", "N", "m3/s")[k % 4] for k, name in enumerate(names)}
    file = f"results.{suffix}"
    writer = open_writer(folder / file, [TIME, *(Column(name, "float", units[name]) for name in names)])
    noise = np.random.default_rng(1)
    for first in range(0, rows, BLOCK):
        t = np.arange(first, min(first + BLOCK, rows)) * 1e-3
        writer.write([t, *(np.sin((1 + k) * t / 50.0) + 0.1 * noise.normal(size=len(t)) for k in range(signals))])
    writer.close(True)
    summary = {
        "package": "long.ssp", "order": ["a", "b"], "units": units, "connections": [["a.y0", "b.u"], ["b.y1", "a.u"]],
    }  # fmt: skip
    (folder / "summary.json").write_text(json.dumps(summary))
    (folder / "manifest.json").write_text(json.dumps({"options": {"results": file}}))


def in_chromium(path: Path) -> Mapping[str, float] | None:
    """Times [ms] by what they are of; None without a browser."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    if chromium is None:
        return None
    found = {}
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(path.as_uri())
        loading = "performance.getEntriesByType('navigation')[0].loadEventEnd"
        page.wait_for_function(f"{loading} > 0")
        found["load, with the first signals drawn"] = page.evaluate(loading)
        begin = perf_counter()
        page.evaluate(f"page.choose_all(page.signals.slice(0, {SHOWN}).map((s) => s.name))")
        page.evaluate("new Promise(requestAnimationFrame)")
        found[f"draw {SHOWN} signals for the first time"] = 1e3 * (perf_counter() - begin)
        for work in ("zoom", "pan", "hover"):
            median, late = page.evaluate(FRAMES, work)
            found[f"a frame, {work}, median"], found[f"a frame, {work}, 95 %"] = median, late
        browser.close()
    return found


def main() -> None:
    """Entry point."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--rows", type=int, default=1_000_000)
    p.add_argument("--signals", type=int, default=40)
    p.add_argument("--format", choices=("csv", "parquet", "h5"), default="csv")
    options = p.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        make_folder(folder, options.rows, options.signals, options.format)
        begin = perf_counter()
        path = write_page(folder)
        took, memory = perf_counter() - begin, getrusage(RUSAGE_SELF).ru_maxrss / 1024
        size = (folder / f"results.{options.format}").stat().st_size
        print(f"{options.rows} rows x {options.signals} signals, {1e-6 * size:.0f} MB of {options.format}")
        print(f"  {'page':<40}{1e-6 * path.stat().st_size:>8.1f} MB")
        print(f"  {'to make it':<40}{took:>8.1f} s, {memory:.0f} MB of memory at the most")
        for what, milliseconds in (in_chromium(path) or {}).items():
            print(f"  {what:<40}{milliseconds:>8.1f} ms")


if __name__ == "__main__":
    main()
