"""Result folders written for tests, and what the data in a page say."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from deepsea_cosim.master.results import open_writer
from deepsea_cosim.master.results.columns import TIME, Column

SUMMARY = {
    "package": "plant.ssp", "status": "ok", "error": None, "method": "jacobi", "order": ["a", "b"],
    "start_time_s": 0.0, "stop_time_s": 1.0, "step_s": 0.1, "steps": 10, "coupling": [], "warnings": [],
}  # fmt: skip


def record(path: Path, columns: Mapping[str, tuple], times=None) -> Path:
    """A result file; columns: (values, type, unit) by name, or values alone."""
    full = {name: c if isinstance(c, tuple) else (c, "float", None) for name, c in columns.items()}
    count = len(next(iter(full.values()))[0])
    times = np.arange(count) / 10.0 if times is None else np.asarray(times, float)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = open_writer(path, [TIME, *(Column(name, type, unit) for name, (_, type, unit) in full.items())])
    kinds = {"float": float, "integer": np.int64, "unsigned": np.uint64, "boolean": bool}
    writer.write([times, *(list(v) if t == "text" else np.asarray(v, kinds[t]) for v, t, _ in full.values())])
    writer.close(True)
    return path


def result_folder(folder: Path, columns: Mapping[str, tuple], times=None, file: str = "results.csv", **summary) -> Path:
    """A result folder as a run leaves it."""
    record(folder / file, columns, times)
    full = {name: c if isinstance(c, tuple) else (c, "float", None) for name, c in columns.items()}
    told = {
        **SUMMARY, "columns": ["time", *full], "units": {"time": "s", **{n: u for n, (_, _, u) in full.items() if u}},
        "types": {n: t for n, (_, t, _) in full.items() if t != "float"}, "connections": [],
        "parameters": {}, **summary,
    }  # fmt: skip
    (folder / "summary.json").write_text(json.dumps(told))
    (folder / "manifest.json").write_text(json.dumps({"options": {"results": file}}))
    return folder


class Scripts(HTMLParser):
    """The scripts of a page, and the names of all tags."""

    def __init__(self, text: str):
        super().__init__()
        self.scripts, self.tags, self._inside = [], [], False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._inside = tag == "script"
        if self._inside:
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._inside = False

    def handle_data(self, data):
        if self._inside:
            self.scripts[-1] += data


def content(page: Path) -> dict:
    """The data in a page."""
    text = page.read_text(encoding="utf-8")
    assert not re.search(r'(src|href)="', text), "it needs a network"
    scripts = Scripts(text).scripts
    assert len(scripts) == 3
    return json.loads(scripts[1])


def times(run: dict) -> np.ndarray:
    return np.frombuffer(base64.b64decode(run["t"]), "<f8")


def values(told: dict, name: str, run: int = 0) -> np.ndarray:
    """Points of a column as the page's script reads them, in the file's unit."""
    place = next(s for s in told["signals"] if s["name"] == name)["places"][run]
    column = told["runs"][run]["columns"][place]
    if "value" in column:
        return np.full(len(times(told["runs"][run])), column["value"])
    return np.frombuffer(base64.b64decode(column["points"]), "<f4").astype(float) + column["middle"]
