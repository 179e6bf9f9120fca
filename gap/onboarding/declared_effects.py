"""The catalogue of a package that has none: what its FMUs say of their own effects, and the usual ones of sensors.

A parameter whose description ends in `@effect {JSON}` says so; `fmus/effect_forms.py` writes that, any FMU can.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...master.simulation.session import Session
from ..campaign.campaign import CampaignError
from ..settings import ONBOARDING
from .model import Model, Parameter
from .toml_text import quoted

MARK = "@effect "

SENSORS = """
[[sensor]]
id = "sensor_bias"
text = "a sensor reads a constant too much"
group = "offset"
quantity = "bias"
neutral = 0.0
bounds = [-0.05, 0.05]      # shares of its channel's span
prior = 0.004

[[sensor]]
id = "sensor_scale"
text = "a sensor reads in the wrong proportion"
group = "sensor"
quantity = "scale"
neutral = 1.0
bounds = [0.9, 1.1]
prior = 0.02

[[sensor]]
id = "sensor_delay"
text = "a sensor's samples arrive late"
group = "timing"
quantity = "delay"
neutral = 0.0
bounds = [0.0, {most:.3g}]        # [s]; usual: 1.5 sample intervals
prior = {usual:.3g}
"""

HEAD = """#:schema ./effects.schema.json
# What the machine may have and the model lacks, as parameters of the FMUs. Format: docs/gap.md.
# neutral: exactly absent; prior: the usual size; bounds: the range of a fit.

schema = 1
"""

NONE_DECLARED = """
# ? Which parameters are effects that a real machine may have? Below are those that are 0 as delivered; take those that
# are effects, and give each a range and a usual size."""

PROPOSED = """
# [[effect]]
# id = {id}
# text = {text}
# group = {id}                # what a single run can hardly tell apart has one name
# [[effect.parameter]]
# address = {address}
# neutral = 0
# bounds = [0, 5]             # ?
# prior = 0.3                 # ?
"""


def said(p: Parameter) -> dict[str, Any] | None:
    """What a parameter says of its effect, or None. Raises `CampaignError` for what is no JSON object."""
    _, found, rest = p.description.partition(MARK)
    if not found:
        return None
    try:
        data = json.loads(rest)
        return {**{key: data[key] for key in ("id", "text", "group", "neutral", "bounds", "prior")}, **data}
    except (ValueError, KeyError, TypeError) as error:
        raise CampaignError(f"{p.address}: its description ends in '{MARK}', but {error!r} is wrong with it") from None


def rows(parameters: Sequence[Parameter]) -> str:
    """The rows [[effect]] of all parameters that say of which effect they are; "" where none does."""
    made: dict[str, list[tuple[str, dict[str, Any]]]] = {}
    ids: dict[str, str] = {}
    for p in parameters:
        if (data := said(p)) is not None:
            component = p.address.partition(".")[0]
            id = data["id"] if ids.setdefault(data["id"], component) == component else f"{component}_{data['id']}"
            made.setdefault(id, []).append((p.address, data))
    lines = []
    for id, entries in made.items():
        _, main = next((e for e in entries if not e[1].get("shape")), entries[0])
        lines += ["", "[[effect]]", f"id = {quoted(id)}", f"text = {quoted(main['text'])}"]
        lines.append(f"group = {quoted(main['group'])}")
        for address, data in entries:
            lines += ["[[effect.parameter]]", f"address = {quoted(address)}", f"neutral = {data['neutral']!r}"]
            lines += [f"bounds = {data['bounds']!r}", f"prior = {data['prior']!r}"]
            if data.get("shape"):
                lines += [f"starts = {data['starts']!r}", "shape = true"]
    return "\n".join(lines) + "\n" if lines else ""


def catalogue(parameters: Sequence[Parameter], interval: float) -> str:
    """A whole effects.toml; interval: between readings [s]."""
    return (
        HEAD
        + (rows(parameters) or _proposed(parameters))
        + SENSORS.format(most=ONBOARDING.most_sensor_delay * interval, usual=ONBOARDING.sensor_delay * interval)
    )


def _proposed(parameters: Sequence[Parameter]) -> str:
    """Rows, as comments, of parameters that look like effects."""
    rows = [
        PROPOSED.format(
            id=quoted(p.address.rpartition(".")[2]), text=quoted(p.description or "?"), address=quoted(p.address)
        )
        for p in parameters
        if p.value == 0.0 and isinstance(p.value, float)
    ]
    return NONE_DECLARED + "".join(rows or [PROPOSED.format(id='"?"', text='"?"', address='"component.parameter"')])


def table_of(package: Path) -> str:
    """The effects.toml of a package, of what its FMUs declare."""
    with Session(package) as session:
        model = Model(session, package)
        return catalogue(model.parameters, model.step or ONBOARDING.usual_interval)
