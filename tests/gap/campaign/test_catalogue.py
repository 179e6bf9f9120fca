import tomllib
import zipfile
from math import inf

import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.gap.campaign.read_catalogue import load_from_package, parse

GOOD = """
[[effect]]
id = "rub"
text = "it rubs"
group = "friction"
[[effect.parameter]]
address = "m.F_c"
neutral = 0
bounds = [0, 10]
prior = 1.5
also = ["n.F_c"]
[[base]]
parameter = "m.k"
tolerance = 0.05
"""


def test_reading():
    catalogue = parse(GOOD)
    (effect,) = catalogue.effects
    assert effect.main.values(3.0) == {"m.F_c": 3.0, "n.F_c": 3.0}
    assert (effect.main.low, effect.main.high, effect.main.prior) == (0.0, 10.0, 1.5)
    assert catalogue.effect("rub") is effect
    assert catalogue.effect("other") is None
    assert catalogue.base[0].tolerance == 0.05
    assert effect.longest_step == inf
    short = parse(GOOD.replace('group = "friction"', 'group = "friction"\nlongest_step = 2e-3'))
    assert short.effects[0].longest_step == 2e-3


def test_shipped_catalogue(built):
    with zipfile.ZipFile(built / "deepsea_11km.ssp") as package:
        shipped = tomllib.loads(package.read("resources/effects.toml").decode())
    catalogue = load_from_package(built / "deepsea_11km.ssp")
    assert [e.id for e in catalogue.effects] == [e["id"] for e in shipped["effect"]]
    assert len(catalogue.effects) >= 30
    assert [s.id for s in catalogue.sensors] == [s["id"] for s in shipped["sensor"]]
    assert catalogue.effect("current_unsteady").main.address == "arm.effect.current_unsteady.amplitude"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("neutral = 0", "neutral = 11", "lies outside the bounds"),
        ("neutral = 0", "", "'neutral' is missing"),
        ("bounds = [0, 10]", "bounds = [10, 0]", "the lower first"),
        ("prior = 1.5", "prior = 0", "has to be positive"),
        ("[[effect.parameter]]", "longest_step = 0\n[[effect.parameter]]", "has to be positive"),
        ("prior = 1.5", 'prior = "much"', "wrong type"),
        ("tolerance = 0.05", "tolerance = 5", "between 0 and 1"),
        ('id = "rub"', "id = 3", "wrong type"),
        ("also", "shape = true\nalso", "not a shape"),
        ("also", "frequency = true\nalso", "'frequency' is for a 'shape' that is not negative"),
        ("[[effect]]", "[[effect", "not valid TOML"),
    ],
)
def test_faults_name_the_entry(old, new, message):
    with pytest.raises(PackageError, match=message) as error:
        parse(GOOD.replace(old, new, 1), "my.toml")
    assert str(error.value).startswith("my.toml")
    assert "\n" not in str(error.value)


def test_double_and_empty():
    with pytest.raises(PackageError, match="listed twice"):
        parse(GOOD + GOOD)
    with pytest.raises(PackageError, match="no effects"):
        parse("")


SENSOR = """
[[sensor]]
id = "late"
text = "samples arrive late"
group = "timing"
quantity = "delay"
neutral = 0.0
bounds = [0.0, 0.1]
prior = 0.015
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD + SENSOR + SENSOR.replace('"late"', '"later"'), "two sensor entries are a delay"),
        (GOOD + SENSOR.replace('"delay"', '"scale"'), "a scale is absent at 1"),
        (GOOD + SENSOR.replace("neutral = 0.0", "neutral = 0.01"), "a delay is absent at 0"),
        (GOOD + SENSOR.replace("[0.0,", "[-0.1,"), "a delay cannot be negative"),
        (GOOD + '[[base]]\nparameter = "o.m"\ntolerance = 0.1\n' * 2, "is listed twice"),
    ],
)
def test_entries_that_would_hide_each_other(text, message):
    with pytest.raises(PackageError, match=message):
        parse(text)


CURVE = """
[[curve]]
id = "rubbing"
text = "how it rubs"
effects = ["rub"]
x = "m/s"
y = "N"
knots = [-1, 0.1, 1]
parameters = ["m.y1", "m.y2", "m.y3"]
prior = 20
formula = "F_c * tanh(x)"
names = { F_c = "m.F_c" }
"""


def test_a_curve_is_read():
    (curve,) = parse(GOOD + CURVE).curves
    assert curve.knots == (-1.0, 0.1, 1.0)
    assert curve.names == {"F_c": "m.F_c"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[-1, 0.1, 1]", "[-1, 1, 0.1]", "in rising order"),
        ("[-1, 0.1, 1]", "[-1, 1]", "three numbers at least"),
        ('"m.y1", ', "", "2 addresses for 3 knots"),
        ('["rub"]', "[]", "has to name what the curve can be a form of"),
        ('["rub"]', '["hum"]', "'hum', which is no effect here"),
        ("m.y1", "m.F_c", "effect rub and curve rubbing both have 'm.F_c'"),
        ("m.y1", "m.y2", "'m.y2' twice"),
        ("{ F_c", "{ x", "for each name in the formula other than x"),
        ("prior = 20", "prior = 0", "has to be positive"),
        ("knots =", "nodes =", "nodes"),
        (CURVE, CURVE + CURVE, "listed twice"),
    ],
)
def test_faults_of_a_curve(old, new, message):
    with pytest.raises(PackageError, match=message):
        parse(GOOD + CURVE.replace(old, new, 1))
