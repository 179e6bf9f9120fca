"""docs/accuracy.md has a row for every shipped scenario, with the method and the step that it comes with."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from deepsea_cosim.fmus.build import SYSTEMS, system_folder
from deepsea_cosim.master.algorithms import choose_method

PAGE = Path(__file__).parents[2] / "docs" / "accuracy.md"
SHIPPED = [(system, path.stem) for system in SYSTEMS for path in sorted(system_folder(system).glob("*.ssv"))]


def rows():
    """Method, step [ms] and x_h error [mm] by scenario."""
    row = re.compile(r"^\| `(\w+)` \| ([\w-]+) \| ([\d.]+) ms \| ([\d.]+) mm \| [\d.]+ kPa \(([\d.]+) %\) \|$", re.M)
    return {name: (method, float(step), float(x)) for name, method, step, x, _ in row.findall(PAGE.read_text())}


def suggested(system):
    """Method and step [s] of a system's annotation."""
    text = (system_folder(system) / "SystemStructure.ssd").read_text()
    (master,) = re.findall(r"<Master [^>]*>", text)
    method = re.search(r'method="([^"]+)"', master)
    return choose_method(None, method and method[1]), float(re.search(r'stepSize="([^"]+)"', master)[1])


def test_there_is_no_row_too_many():
    assert set(rows()) == {name for _, name in SHIPPED}


@pytest.mark.parametrize(("system", "scenario"), SHIPPED)
def test_every_scenario_is_on_the_page_as_it_is_shipped(system, scenario):
    method, step, x = rows()[scenario]
    assert (method, step) == (suggested(system)[0], pytest.approx(1e3 * suggested(system)[1]))
    assert x <= 0.05, "the step that a scenario suggests holds 0.05 mm"
