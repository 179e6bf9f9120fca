"""Gets the public measurements whose licence allows it into a data folder, from the commits that were used.

    python -m benchmarks.real.fetch --data DATA_FOLDER

What is there already is left alone. For now these are the records of the servo joint (Rhoban/bam, Apache 2.0) and of
the magnetorheological damper (DanielMaurelE/vRTHS_AMBC_MRdamper, MIT).
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from . import mr_damper, servo_joint

SITE = "https://raw.githubusercontent.com"


@dataclass(frozen=True)
class Source:
    """Where in the data folder a file belongs, where it comes from, and how many readings it has."""

    target: str
    repository: str
    commit: str
    path: str
    readings: int

    def address(self, site: str) -> str:
        """Of the file as that commit has it."""
        return f"{site}/{self.repository}/{self.commit}/{quote(self.path)}"


def _servo(name: str, commit: str, readings: int) -> Source:
    return Source(f"{servo_joint.FOLDER}/{name}", "Rhoban/bam", commit, f"data_raw_feetech/{name}", readings)


SOURCES = (
    _servo("2024-10-26_12h23m27.json", "d13c05771e2112b34b60ddccc9f226fef2cf7477", 286),
    _servo("2024-10-26_12h23m42.json", "d13c05771e2112b34b60ddccc9f226fef2cf7477", 354),
    _servo("2024-10-26_12h24m55.json", "d13c05771e2112b34b60ddccc9f226fef2cf7477", 273),
    _servo("2024-10-26_12h27m27.json", "7860487731559a92edfabc1ce6a250770401032e", 273),
    Source(
        mr_damper.FILE,
        "DanielMaurelE/vRTHS_AMBC_MRdamper",
        "8751c95d233df91120b7d7bb48b564a063d27486",
        "Cap7_ModeloMR/BoucWen Ajuste 1/Preprocesamiento-sinusoidales/Preprocesados/2mm5Hz1A.txt",
        450,
    ),
)


def _readings(source: Source, text: str) -> int:
    if source.target.endswith(".json"):
        return len(json.loads(text)["entries"])
    return sum(1 for line in text.splitlines() if line.strip())


def fetch(data: Path, site: str = SITE) -> int:
    """Get what is missing; returns how many files that were. Raises OSError, and ValueError for another file."""
    got = 0
    for source in SOURCES:
        target = data / source.target
        if target.exists():
            continue
        address = source.address(site)
        with urllib.request.urlopen(address, timeout=30) as answer:
            text = answer.read().decode()
        if (found := _readings(source, text)) != source.readings:
            raise ValueError(f"{address}: {found} readings instead of {source.readings}")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text)
        got += 1
    return got


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    p = argparse.ArgumentParser(prog="benchmarks.real.fetch", description=__doc__.splitlines()[0])
    p.add_argument("--data", type=Path, required=True, help="folder for the measured data")
    p.add_argument("--site", default=SITE, help="where they are; for copies")
    options = p.parse_args(arguments)
    try:
        print(f"{fetch(options.data, options.site)} files")
    except (OSError, ValueError, KeyError) as error:
        print(f"not fetched: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
