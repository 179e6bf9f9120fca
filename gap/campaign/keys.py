"""The keys of campaign.toml and of a catalogue of effects: what each of them is, for readers and for editors."""

from __future__ import annotations

from ...core.json_schema import (
    ABOVE_ZERO,
    NOT_NEGATIVE,
    NUMBER,
    NUMBERS,
    SCALARS,
    SWITCH,
    TEXT,
    TEXTS,
    TWO_NUMBERS,
    Key,
    Keys,
    Schema,
    file_schema,
    one_of,
    table,
    tables,
)

FILE: Keys = {
    "delimiter": Key(TEXT, "what stands between the columns of the run files; found out if it is not stated"),
    "decimal": Key(one_of(".", ","), "decimal point or comma of the run files; found out if it is not stated"),
    "time_unit": Key(TEXT, "unit of the run files' times; s unless the file says another one"),
    "start": Key({}, 'what 0 s of the model is in the file: seconds, a time stamp, or "first" for its first reading'),
}
"""How run files are written: for all of them at the top, or in a run."""

CHANNEL: Keys = {
    "column": Key(TEXT, "column of the run files", needed=True),
    "connector": Key(TEXT, "component.connector of the model", needed=True),
    "unit": Key(TEXT, "unit of the column, such as mm, bar, degC", needed=True),
    "noise_std": Key(ABOVE_ZERO, "standard deviation of its noise, in `unit`; estimated if it is not stated"),
    "role": Key(one_of("output", "input"), "output: compared (default); input: drives the model"),
    "clock_jitter": Key(NOT_NEGATIVE, "how far the times of its readings are off [s], standard deviation"),
    "model_form_scatter": Key(NOT_NEGATIVE, "what a good model of it may miss, in `unit`, standard deviation"),
    "faulty_readings": Key(one_of("leave_out", "keep"), "what becomes of single values far off, drop-outs, stuck ones"),
    "scale": Key(NUMBER, "what 1 in the column is in `unit`, of a sensor in volts; -1: the other sign"),
}
EVENT: Keys = {
    "connector": Key(TEXT, "component.connector that comes to its target", needed=True),
    "target": Key(NUMBER, "where it comes to stay, in the FMU's unit", needed=True),
    "within": Key(ABOVE_ZERO, "how near that is, in the FMU's unit", needed=True),
    "after": Key(NOT_NEGATIVE, "from when the time is counted [s]", needed=True),
    "until": Key(NUMBER, "until when it stays [s]; the end of the run if it is not stated"),
    "first": Key(SWITCH, "true: when it comes there for the first time, whether it stays or not"),
    "std": Key(ABOVE_ZERO, "standard deviation of the reading [s]", needed=True),
    "time": Key(NOT_NEGATIVE, "the reading [s], counted from `after`; or at_most, or at_least"),
    "at_most": Key(NOT_NEGATIVE, "it took no longer [s]"),
    "at_least": Key(NOT_NEGATIVE, "it took that long [s], or longer"),
}
RUN: Keys = {
    "file": Key(TEXT, "run file, relative to this file: text, MATLAB, TDMS, MDF 4 or Parquet"),
    "parameters": Key(SCALARS, 'conditions: parameters by address, such as { "depth" = 11000.0 }'),
    "use": Key(one_of("fit", "holdout"), "fit, or holdout to test what was found"),
    "event": Key(tables(EVENT), "measured moments"),
    "stop_time": Key(ABOVE_ZERO, "end of a run without a file [s]"),
    "name": Key(TEXT, "what it is called; the file's name if it is not stated"),
    **FILE,
}
FACTOR: Keys = {"factor": Key(NUMBER, "up to so many times as large or as small", needed=True)}
CAMPAIGN_BASE: Keys = {
    "parameter": Key(TEXT, "address of a parameter that is not exactly known", needed=True),
    "tolerance": Key({"oneOf": [{"type": "number", "minimum": 0, "exclusiveMaximum": 1}, table(FACTOR)]},
                     "a share of its value (0: it is exact), or { factor = 3 }", needed=True),
}  # fmt: skip
CAMPAIGN: Keys = {
    "name": Key(TEXT, "what the campaign is called"),
    "system": Key(TEXT, "package of the model, .ssp or .fmu, relative to this file", needed=True),
    "effects": Key(TEXT, "a catalogue other than the package's, relative to this file"),
    "channel": Key(tables(CHANNEL), "what was measured"),
    "run": Key(tables(RUN), "the runs", needed=True),
    "base": Key(tables(CAMPAIGN_BASE), "how well base parameters are known, on top of the catalogue's"),
    "accept": Key(TEXTS, "effects that are known to be there: refitted with the base"),
    "max_runs": Key(ABOVE_ZERO, "how many runs are taken at most; 2000 if it is not stated"),
    "max_megabytes": Key(ABOVE_ZERO, "size of the run files together up to which they are read; 1000 by default"),
    **FILE,
}

QUANTITIES = ("bias", "scale", "lag", "delay", "drift", "curvature")
SHAPES = ("split",)
"""What forms of a sensor's effect have beyond the plain one."""

NOTES: Keys = {
    "equation": Key(TEXT, "its equation, for people"),
    "source": Key(TEXT, "where the equation comes from, for people"),
    "test": Key(TEXT, "what test holds it, for people"),
}
"""What an entry may say of an effect for people; no number hangs on it."""

_HEAD: Keys = {
    "id": Key(TEXT, "what it is called in results", needed=True),
    "text": Key(TEXT, "a short sentence that ends in no stop", needed=True),
}
_RANGE: Keys = {
    "neutral": Key(NUMBER, "the value at which it is exactly absent", needed=True),
    "bounds": Key(TWO_NUMBERS, "least and greatest value", needed=True),
    "prior": Key(ABOVE_ZERO, "usual deviation from neutral where a machine has the effect", needed=True),
}
_STARTS: Keys = {"starts": Key(NUMBERS, "values at which a fit of a shape begins, and at which a form shows")}
_GROUP: Keys = {"group": Key(TEXT, "effects that measurements hardly tell apart, such as friction", needed=True)}
PARAMETER: Keys = {
    "address": Key(TEXT, "component.parameter", needed=True), **_RANGE,
    "also": Key(TEXTS, "addresses that take the same value"),
    "shape": Key(SWITCH, "true: it has no effect of its own while the others are neutral"), **_STARTS,
    "period": Key(SWITCH, "true: it is a time after which something comes again"),
    "frequency": Key(SWITCH, "true: it is a shape in proportion to which something swings"),
}  # fmt: skip
FORM: Keys = {**_HEAD, "parameter": Key(tables(PARAMETER), "what it has beyond the plain form", needed=True)}
EFFECT: Keys = {
    **_HEAD, **_GROUP, "parameter": Key(tables(PARAMETER), "its parameters", needed=True),
    "form": Key(tables(FORM), "other forms of it, tried where it is in"),
    "longest_step": Key(ABOVE_ZERO, "macro step [s] beyond which the coupling is not stable where it is in"), **NOTES,
}  # fmt: skip
CURVE: Keys = {
    **_HEAD, "effects": Key(TEXTS, "effects that it can be a free form of", needed=True),
    "x": Key(TEXT, "what the curve is drawn over, with its unit", needed=True),
    "y": Key(TEXT, "what it gives, with its unit", needed=True),
    "knots": Key({**NUMBERS, "minItems": 3}, "where its values stand, in rising order", needed=True),
    "knots_of": Key(TEXT, "a parameter that the knots are shares of"),
    "parameters": Key(TEXTS, "an address for the value at each knot", needed=True),
    "prior": Key(ABOVE_ZERO, "usual size of its values", needed=True),
    "formula": Key(TEXT, "a formula in x to draw the plain form beside it"),
    "names": Key({"type": "object", "additionalProperties": TEXT}, "addresses of the formula's other names"),
}  # fmt: skip
SENSOR_FORM: Keys = {
    **_HEAD, "quantity": Key(one_of(*SHAPES), "what it has beyond the plain form", needed=True), **_RANGE,
    "starts": Key(NUMBERS, "values at which it shows", needed=True),
}  # fmt: skip
SENSOR: Keys = {
    **_HEAD, **_GROUP, "quantity": Key(one_of(*QUANTITIES), "what of the reading is off", needed=True), **_RANGE,
    "form": Key(tables(SENSOR_FORM), "other forms of it"), **NOTES,
}  # fmt: skip
BASE: Keys = {
    "parameter": Key(TEXT, "address of a parameter that is not exactly known", needed=True),
    "tolerance": Key({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}, "a share of its value",
                     needed=True),
}  # fmt: skip
REGION: Keys = {
    "text": Key(TEXT, "what the region is called", needed=True),
    "signal": Key(TEXT, "component.connector that tells it", needed=True),
    "above": Key(NUMBER, "it is above that there"), "below": Key(NUMBER, "it is below that there"),
    "rate": Key(SWITCH, "true: its rate is meant"), "size": Key(SWITCH, "true: its absolute value is meant"),
}  # fmt: skip
EXPERIMENT: Keys = {
    "parameter": Key(TEXT, "address of a condition that a further run could change", needed=True),
    "values": Key({**NUMBERS, "minItems": 1}, "values that it could take", needed=True),
}
MEASURABLE: Keys = {
    "connector": Key(TEXT, "component.connector that could be measured", needed=True),
    "noise_std": Key(ABOVE_ZERO, "noise of a usual sensor there, in the FMU's unit", needed=True),
}
ESTIMATION: Keys = {"parameters": Key({"type": "object"}, "settings of runs at longer steps, by address", needed=True)}
CATALOGUE: Keys = {
    "schema": Key({"type": "integer"}, "version of the format"),
    "effect": Key(tables(EFFECT), "what a real machine may have that the model lacks"),
    "curve": Key(tables(CURVE), "free curves of effects"),
    "sensor": Key(tables(SENSOR), "effects of a measurement, possible in every channel"),
    "base": Key(tables(BASE), "parameters that are known within a tolerance: refitted in every candidate"),
    "region": Key(tables(REGION), "parts of a run in which a gap may lie"),
    "experiment": Key(tables(EXPERIMENT), "conditions that a further run could change"),
    "measurable": Key(tables(MEASURABLE), "what could be measured, too"),
    "estimation": Key({"oneOf": [table(ESTIMATION), {"type": "object", "maxProperties": 0}]}, "settings of estimates"),
}

SCHEMAS: dict[str, Schema] = {
    "campaign.schema.json": file_schema("campaign.toml of deepsea-cosim", CAMPAIGN),
    "effects.schema.json": file_schema("effects.toml of deepsea-cosim", CATALOGUE),
}
"""For editors, by the names of the files that `cosim-gap schema` writes."""
