"""Builds published_arm.ssp: the arm of Gymnasium's Pusher, and two cylinders that move it. README.md says more.

    python examples/published_arm/make.py build         # after: cosim-fmus build --out build
    cosim-master build/published_arm.ssp
"""

from __future__ import annotations

import sys
from pathlib import Path

from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.fmus.build_arm import build_arm
from deepsea_cosim.ssp.packer import pack

HERE = Path(__file__).parent
MODEL = Path("gymnasium:envs/mujoco/assets/pusher_v5.xml")


def make(folder: Path, model: Path = MODEL) -> Path:
    """Build the arm and pack it with the hydraulics that is in the folder; returns the package."""
    arm = build_arm(
        model, folder, HERE / "water.toml", name="PusherArm", say=print, cylinders=HERE / "cylinders.toml"
    )
    fmus = {f"resources/{path.name}": path for path in (arm, folder / "DeepseaHydraulics.fmu")}
    return pack(HERE / "SystemStructure.ssd", HERE / "parameters.ssv", fmus, folder / "published_arm.ssp")


if __name__ == "__main__":
    try:
        print(make(Path(sys.argv[1] if len(sys.argv) > 1 else "build")))
    except PackageError as error:
        sys.exit(str(error))
