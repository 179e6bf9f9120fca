"""docs/effects.md is that of the catalogue, and the tests that it names are there."""

from pathlib import Path

import pytest

from .test_effects_catalogue import CATALOGUE

REPOSITORY = Path(__file__).parents[2]
PAGE = (REPOSITORY / "docs" / "effects.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("entry", [*CATALOGUE["effect"], *CATALOGUE["sensor"]], ids=lambda e: e["id"])
def test_every_effect_says_its_equation_and_its_test_and_stands_on_the_page(entry):
    path, _, name = entry["test"].partition("::")
    assert f"def {name}(" in (REPOSITORY / path).read_text()
    row = next(line for line in PAGE.splitlines() if line.startswith(f"| **{entry['id']}**<br>{entry['text']} | "))
    assert f" | {entry['equation'].replace('|', chr(92) + '|')} | " in row
    for p in entry.get("parameter", ()):
        assert f"`{p['address']}`" in row
        assert f"{p['neutral']:g}; {p['bounds'][0]:g} to {p['bounds'][1]:g}; {p['prior']:g}" in row
    for f in entry.get("form", ()):
        assert f["text"] in row
