"""Every entry of a campaign and of a catalogue replaced by something else: a one-line fault, or it goes through."""

import copy
import json
import tomllib

import jsonschema
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.keys import SCHEMAS
from deepsea_cosim.gap.campaign.read import read, take
from deepsea_cosim.gap.campaign.read_catalogue import parse

from .test_campaign import CAMPAIGN, table
from .test_catalogue import GOOD

CATALOGUE = (
    GOOD.replace("prior = 1.5", "prior = 1.5\nshape = false\nstarts = [1]")
    + """
[[sensor]]
id = "off"
text = "it is off"
group = "sensor"
quantity = "bias"
neutral = 0
bounds = [-1, 1]
prior = 0.1
[[region]]
text = "fast"
signal = "m.v"
above = 1
rate = true
[[experiment]]
parameter = "m.k"
values = [1, 2]
[[measurable]]
connector = "m.v"
noise_std = 0.1
[estimation]
parameters = { "m.tol" = 1 }
"""
)

MORE = """
[[run]]
file = "run1.csv"
use = "holdout"
name = "again"
[[run.event]]
connector = "arm.x_h"
target = 1
within = 0.1
after = 0
std = 0.1
time = 1
until = 3
first = true
"""

WRONG = (3, -1.5, float("nan"), float("inf"), True, "x", "", [], [3], ["x"], [[1]], {}, {"a": {"b": 1}}, [{}])


def toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


def whole(data):
    return "".join(f"{json.dumps(k)} = {toml(v)}\n" for k, v in data.items())


def mutants(data):
    """The data with each entry, at any depth, replaced or left out; everything else as it is."""

    def places(x, path=()):
        for key in x if isinstance(x, dict) else range(len(x)):
            yield (*path, key)
            if isinstance(x[key], (dict, list)):
                yield from places(x[key], (*path, key))

    for path in places(data):
        for value in (*WRONG, None):
            made = copy.deepcopy(data)
            at = made
            for key in path[:-1]:
                at = at[key]
            if value is None:
                del at[path[-1]]
            else:
                at[path[-1]] = value
            yield whole(made)


def survives(act):
    """Whether the action goes through; a fault has to be one line."""
    try:
        act()
    except CosimError as error:
        told = str(error)
    else:
        return True
    assert told
    assert "\n" not in told
    return False


def accepted(name, text):
    """Whether an editor finds nothing wrong with the text."""
    return jsonschema.Draft7Validator(SCHEMAS[name]).is_valid(tomllib.loads(text))


def agrees(name, texts, made):
    """An editor marks nothing that can be read, and most of what cannot."""
    marked = [not accepted(name, text) for text in texts]
    assert not any(reads and mark for reads, mark in zip(made, marked, strict=True))
    assert sum(marked) > 0.7 * made.count(False)


def test_catalogue():
    texts = list(mutants(take.parse(CATALOGUE, "")))
    made = [survives(lambda text=text: parse(text)) for text in texts]
    assert accepted("effects.schema.json", CATALOGUE)
    agrees("effects.schema.json", texts, made)
    assert parse(CATALOGUE).base
    assert made.count(False) > 0.8 * len(made) > 300


@pytest.mark.filterwarnings("error")
def test_campaign(tmp_path):
    (tmp_path / "s.ssp").write_bytes(b"x")
    (tmp_path / "run1.csv").write_text(table())
    path = tmp_path / "campaign.toml"

    def reads(text):
        path.write_text(text)
        return survives(lambda: read(path))

    assert reads(CAMPAIGN + MORE)
    texts = list(mutants(take.parse(CAMPAIGN + MORE, "")))
    made = [reads(text) for text in texts]
    assert accepted("campaign.schema.json", CAMPAIGN + MORE)
    agrees("campaign.schema.json", texts, made)
    assert made.count(False) > 0.8 * len(made) > 300
