"""Changes to files by their structure. Every function takes random numbers and returns the changed bytes."""

from __future__ import annotations

import io
import json
import random
import tomllib
import zipfile
from collections.abc import Callable
from copy import deepcopy
from typing import Any

from lxml import etree

Mutator = Callable[[random.Random, bytes], bytes]

NASTY = (
    "", " ", "0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "1_0", "\u0661", "0x10", "1,5", "true", "None",
    "9" * 400, "a" * 5000, "\x1b[2J", "../../../etc/passwd", "/dev/zero", "%n%s%s", "{0}", "${HOME}",
    "resources/none.fmu", "a.b.c", "..", "\u202ename", "\ufffe", "<x/>", "]]>", "'", '"', "[1,1]", "x[0]", "1 2 3",
    "\U0001f600",
)  # fmt: skip
"""Texts in the place of attributes, values and cells."""


def xml(rng: random.Random, content: bytes) -> bytes:
    """One to three changes of a document: of attributes, of elements, of text."""
    root = etree.fromstring(content)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        elements = [e for e in root.iter() if isinstance(e.tag, str)]
        element = rng.choice(elements)
        kind = rng.randrange(10)
        if kind <= 3 and element.attrib:
            _change(element, rng.choice(list(element.attrib)), rng.choice(NASTY))
        elif kind == 4 and element.attrib:
            del element.attrib[rng.choice(list(element.attrib))]
        elif kind == 5 and element.getparent() is not None:
            element.getparent().remove(element)
        elif kind == 6 and element.getparent() is not None:
            element.addnext(deepcopy(element))
        elif kind == 7:
            rng.choice(elements).append(deepcopy(element)) if len(elements) < 5000 else None
        elif kind == 8 and element.attrib:
            other = rng.choice([e for e in elements if e.attrib])
            _change(element, rng.choice(list(element.attrib)), rng.choice(list(other.attrib.values())))
        elif kind == 9:
            element.tag = rng.choice(elements).tag
        else:
            _change(element, rng.choice(("name", "unit", "value", "x")), rng.choice(NASTY))
    made: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return made if rng.random() < 0.93 else bytes_of(rng, made)


def _change(element: etree._Element, name: str, value: str) -> None:
    try:
        element.set(name, value)
    except ValueError:  # what XML cannot hold
        element.set(name, "\ufffd")


def toml(rng: random.Random, content: bytes) -> bytes:
    """Values, keys and tables changed, left out or doubled."""
    data = tomllib.loads(content.decode())
    others = (3, -1.5, float("nan"), float("inf"), True, 10**30, [], [3], ["x"], [[1]], {}, {"a": {"b": 1}})
    values = (*others, *NASTY)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(data))
        at, key = rng.choice(places)
        kind = rng.randrange(5)
        if kind <= 2:
            at[key] = rng.choice(values)
        elif kind == 3 and isinstance(at, dict):
            at[rng.choice(NASTY) or "x"] = at.pop(key)
        elif isinstance(at, list):
            at.append(deepcopy(at[key])) if rng.random() < 0.5 else at.pop(key)
        else:
            del at[key]
    made = "".join(f"{json.dumps(k)} = {_toml(v)}\n" for k, v in data.items()).encode("utf-8", "replace")
    return made if rng.random() < 0.93 else bytes_of(rng, made)


def _places(x: Any) -> Any:
    for key in list(x) if isinstance(x, dict) else range(len(x)):
        yield x, key
        if isinstance(x[key], (dict, list)) and x[key]:
            yield from _places(x[key])


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return {"nan": "nan", "inf": "inf"}.get(repr(value), repr(value))
    return json.dumps(value)


def csv(rng: random.Random, content: bytes) -> bytes:
    """Cells, columns and rows of a table changed, left out, doubled or out of order; other marks and encodings."""
    rows = [line.split(",") for line in content.decode().splitlines()]
    for _ in range(rng.choice((1, 1, 2, 3))):
        if not rows:
            break
        row, kind = rng.choice(rows[: rng.choice((1, 2, len(rows)))]), rng.randrange(8)
        if kind <= 2 and row:
            row[rng.randrange(len(row))] = rng.choice(NASTY)
        elif kind == 3 and row:
            row.pop(rng.randrange(len(row)))
        elif kind == 4:
            rows.insert(rng.randrange(len(rows) + 1), list(row))
        elif kind == 5:
            column, factor = rng.randrange(len(rows[0]) or 1), rng.choice((1e-9, 1e-3, 1e3, 1e9, -1.0, 0.0))
            for r in rows[1:]:
                if column < len(r):
                    r[column] = _times(r[column], factor)
        elif kind == 6:
            rng.shuffle(rows)
        else:
            rows = rows[: rng.randrange(len(rows) + 1)]
    text = rng.choice((",", ",", ",", ";", "\t", " ")).join(("",)) or ","
    made = rng.choice(("\n", "\n", "\r\n", "\r")).join(text.join(row) for row in rows)
    encoding = rng.choice(("utf-8", "utf-8", "utf-8", "utf-8", "utf-16", "latin-1", "utf-8-sig"))
    out = made.encode(encoding, "replace")
    return out if rng.random() < 0.9 else bytes_of(rng, out)


def _times(cell: str, factor: float) -> str:
    try:
        return repr(float(cell) * factor)
    except ValueError:
        return cell


def archive(rng: random.Random, content: bytes) -> bytes:
    """A zip archive whose entries are renamed, doubled, emptied or cut; or whose bytes are."""
    if rng.random() < 0.4:
        return bytes_of(rng, content)
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as target:
        entries = source.infolist()
        chosen = rng.choice(entries)
        for entry in entries:
            data, name = source.read(entry), entry.filename
            if entry is not chosen:
                target.writestr(name, data)
                continue
            kind = rng.randrange(8)
            if kind == 0:
                names = "../out", "/abs", "a/../../b", "C:\\x", "a\\b", " ", "x" * 300, "nul\x00x"
                target.writestr(rng.choice(names), data)
            elif kind == 1:
                target.writestr(name, data)
                target.writestr(name, b"other")
            elif kind == 2:
                target.writestr(name, b"")
            elif kind == 3:
                target.writestr(name, data[: len(data) // 2])
            elif kind == 4:
                link = zipfile.ZipInfo(name)
                link.external_attr = 0o120777 << 16
                target.writestr(link, "/etc/passwd")
            elif kind == 5:
                target.writestr(name + "/", b"")
            elif kind == 6:
                target.writestr(name, bytes(30_000_000))
    return made.getvalue()


def bytes_of(rng: random.Random, content: bytes) -> bytes:
    """Bytes changed, left out, doubled or cut off."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 3, 10))):
        if not data:
            break
        at, kind = rng.randrange(len(data)), rng.randrange(5)
        if kind == 0:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.randrange(1, 20)]
        elif kind == 2:
            data[at:at] = bytes(rng.randrange(256) for _ in range(rng.randrange(1, 8)))
        elif kind == 3:
            data[at:at] = data[at : at + rng.randrange(1, 200)]
        else:
            del data[at:]
    return bytes(data)
