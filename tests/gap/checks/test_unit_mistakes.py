"""A channel in another unit than it says is asked about; a machine that differs from its model is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from deepsea_cosim.core.units import convert
from deepsea_cosim.gap.campaign.campaign import CampaignError, Channel
from deepsea_cosim.gap.checks.campaign_sanity import _check_swapped
from deepsea_cosim.gap.checks.unit_mistakes import check_units
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.settings import DEFAULT

T = np.linspace(0.0, 20.0, 800)
NOISE = 1e-3
"""Of a channel, as a share of its span."""


def stroke(lag: float = 0.0) -> np.ndarray:
    """Out and back, with a swing on it; between 0 and 1.1."""
    t = T - lag
    return np.clip(t - 2.0, 0.0, 5.0) / 5.0 - np.clip(t - 11.0, 0.0, 4.0) / 4.0 + 0.05 * np.sin(3.0 * t)


def problem(*channels: tuple[str, str, np.ndarray, np.ndarray]) -> tuple[Any, np.ndarray]:
    """Problem and nominal model of channels: unit in the campaign, own unit, readings as numbers, model (n,) each."""
    made, blocks, units, models = [], [], {}, []
    for k, (given, own, numbers, model) in enumerate(channels):
        name = f"m.{'xyz'[k]}"
        made.append(Channel(f"channel{k}", name, given))
        units[name] = own
        y = convert(numbers, given, own)
        noise = NOISE * float(np.ptp(y))
        y = y + np.random.default_rng(k).normal(0.0, noise, len(T))
        blocks.append(RawBlock(0, k, name, T, y, noise, None, True))
        models.append(model)
    campaign = SimpleNamespace(outputs=made, inputs=[], file="campaign.toml")
    p = SimpleNamespace(
        settings=DEFAULT, campaign=campaign, observations=gather(blocks), units=units, runs=[], scenario_stop=None
    )
    return p, np.concatenate(models)


@pytest.mark.parametrize(
    ("given", "own", "true", "size"),
    [
        ("mm", "m", "inch", 0.2),
        ("mm", "m", "cm", 0.2),
        ("bar", "Pa", "psi", 1e7),
        ("MPa", "Pa", "bar", 1e7),
        ("psi", "Pa", "bar", 1e7),
        ("L/min", "m3/s", "gal/min", 1e-3),
        ("N", "N", "lbf", 8e3),
        ("kgf", "N", "N", 8e3),
        ("deg", "rad", "rad", 0.7),
        ("mm/s", "m/s", "inch/s", 0.05),
    ],
)
def test_another_size(given: str, own: str, true: str, size: float) -> None:
    machine, model = size * (1.05 * stroke(0.1) + 0.01), size * stroke()
    p, nominal = problem((given, own, convert(machine, own, true), model))
    with pytest.raises(CampaignError) as error:
        check_units(p, nominal)
    text = str(error.value)
    assert text.startswith("campaign.toml: channel 'channel0'")
    assert f"is it in {true}?" in text
    assert "'unit'" in text
    assert "\n" not in text


def test_what_a_machine_could_do_as_well_is_remarked_on() -> None:
    p, nominal = problem(("cm", "m", 20.0 * stroke(0.05) / 2.54, 0.2 * stroke()))
    (warning,) = check_units(p, nominal)
    assert "'channel0'" in warning
    assert "is it in inch?" in warning


@pytest.mark.parametrize(
    ("given", "true"), [("degC", "K"), ("K", "degC"), ("K", "degF"), ("degF", "K")]
)
@pytest.mark.parametrize("warms", [0.5, 6.0, 40.0])
def test_another_zero(given: str, true: str, warms: float) -> None:
    """Temperatures of oil that warms by little or by much."""
    machine, model = 293.15 + warms * (0.9 * stroke(0.3) + 0.1), 293.15 + warms * stroke()
    p, nominal = problem((given, "K", convert(machine, "K", true), model))
    with pytest.raises(CampaignError, match=f"is it in {true}[?]"):
        check_units(p, nominal)


@pytest.mark.parametrize(("given", "true"), [("degC", "degF"), ("degF", "degC")])
def test_a_machine_may_be_as_warm_as_fahrenheit_looks(given: str, true: str) -> None:
    p, nominal = problem((given, "K", convert(300.0 + 6.0 * stroke(0.3), "K", true), 300.0 + 6.0 * stroke()))
    (warning,) = check_units(p, nominal)
    assert f"is it in {true}?" in warning


@pytest.mark.parametrize(
    "given", ["mm", "cm", "inch", "bar", "psi", "kgf", "lbf", "L/min", "gal/min", "deg", "degC", "degF"]
)
@pytest.mark.parametrize(
    "machine",
    [
        stroke(), 0.6 * stroke(0.2), 1.8 * stroke(), stroke(1.0), 0.2 * stroke(4.0) + 0.3, stroke() + 0.3,
        stroke() + 4.0 * np.sin(7.0 * T), 3.0 * np.sin(2.0 * T), np.where(T < 9.0, 0.02 * stroke(), stroke()),
    ],
    ids=["right", "weak", "strong", "late", "stuck and late", "off", "swings", "another", "stuck"],
)  # fmt: skip
def test_machines_that_differ_are_not_asked_about(given: str, machine: np.ndarray) -> None:
    own = {"mm": "m", "cm": "m", "inch": "m", "bar": "Pa", "psi": "Pa", "L/min": "m3/s", "gal/min": "m3/s",
           "deg": "rad", "degC": "K", "degF": "K"}.get(given, "N")  # fmt: skip
    zero = 293.15 if own == "K" else 0.0
    p, nominal = problem((given, own, convert(10.0 * machine + zero, own, given), 10.0 * stroke() + zero))
    assert check_units(p, nominal) == []


def test_a_wrong_unit_is_no_swap_of_columns() -> None:
    """In one of two pressures a tenth is missing: the other column is nearer to its model, but not the other way."""
    a, b = 7.7e6 + 1e5 * stroke(), 1e7 + 1e5 * stroke()
    p, nominal = problem(("bar", "Pa", a / 1e5, a), ("bar", "Pa", b / 1e6, b))
    _check_swapped(p, nominal)
    with pytest.raises(CampaignError, match="is it in MPa"):
        check_units(p, nominal)


def test_swapped_columns() -> None:
    a, b = 7.7e6 + 1e5 * stroke(), 1e7 + 1e5 * stroke()
    p, nominal = problem(("bar", "Pa", b / 1e5, a), ("bar", "Pa", a / 1e5, b))
    with pytest.raises(CampaignError, match="'channel0' and 'channel1' seem to be swapped"):
        _check_swapped(p, nominal)
