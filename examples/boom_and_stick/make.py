"""Builds boom_and_stick.ssp: an arm of its own from arm.xml, and two cylinders that move it.

    python examples/boom_and_stick/make.py build        # after: cosim-fmus build --out build
    cosim-master build/boom_and_stick.ssp
"""

from __future__ import annotations

import sys
from pathlib import Path

from deepsea_cosim.fmus.build_arm import build_arm
from deepsea_cosim.ssp.packer import pack

HERE = Path(__file__).parent


def make(folder: Path) -> Path:
    """Build the arm and pack it with the hydraulics that is in the folder; returns the package."""
    arm = build_arm(HERE / "arm.xml", folder, HERE / "water.toml", name="BoomAndStick", say=print)
    fmus = {f"resources/{path.name}": path for path in (arm, folder / "DeepseaHydraulics.fmu")}
    return pack(HERE / "SystemStructure.ssd", HERE / "parameters.ssv", fmus, folder / "boom_and_stick.ssp")


if __name__ == "__main__":
    print(make(Path(sys.argv[1] if len(sys.argv) > 1 else "build")))
