"""Builds the FMU of a user's own arm from an MJCF model."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from ..core.errors import PackageError
from ..core.files import make_folder
from .build import Model, Way, build_fmu
from .description import variable_tables

TEXT = """# {name}

An arm made by `cosim-fmus arm` from an MJCF model: {joints} joints, moved by the cylinders {tendons}. Each cylinder
takes its force `<cylinder>.F` (positive extends) and gives displacement `.x`, velocity `.v` and `.F_hold`, the force
that holds it at rest at t = 0; connect them to `F_h`, `x_h`, `v_h` and `F_hold` of a DeepseaHydraulics. Forces are held
during a step. Contacts, joint limits and other constraints of the model are not acted on.

In the water, each with the drag coefficient, the inertia coefficient, length and diameter in metres:

{wet}
"""


def place(path: Path) -> Path:
    """Where a model is: the path itself, or for PACKAGE:path/in/it that in an installed Python package."""
    package, colon, inside = str(path).partition(":")
    if path.exists() or not colon or len(package) == 1 or not all(part.isidentifier() for part in package.split(".")):
        return path
    try:
        found = find_spec(package)
    except ModuleNotFoundError:  # of a package in which it would be
        found = None
    if found is None or not found.submodule_search_locations:
        raise PackageError(f"{path}: no Python package '{package}' is installed here: pip install {package}")
    return Path(next(iter(found.submodule_search_locations))) / inside


def build_arm(
    path: Path, folder: Path, water: Path | None = None, dry: bool = False, name: str = "", pose: str = "",
    say: Callable[[str], None] = lambda text: None, way: Way | None = None, cylinders: Path | None = None,
) -> Path:  # fmt: skip
    """Build <name>.fmu of an MJCF file into `folder`; see `mechanics.own_arm.reading` for the rest.

    path: also PACKAGE:path/in/it of a Python package that is installed.
    """
    from ..mechanics.own_arm.reading import read
    from ..mechanics.own_arm.remarks import bare_bodies, loose_joints, not_acted_on, without_direction
    from ..mechanics.own_arm.simulation import OwnArm
    from ..mechanics.own_arm.variables import table_of
    from .own_scene import scene_of

    arm = read(place(path), water, dry, name, pose, cylinders)
    at_rest = OwnArm(arm, table_of(arm).parameters({}))
    if points := without_direction(at_rest):
        raise PackageError(
            f"{path}: cylinder {points[0]}: base and eye are in one place at the start, which leaves it no direction; "
            "move one of them, or start in another pose (--pose)"
        )
    if loose := loose_joints(at_rest):
        say(f"no cylinder moves {', '.join(loose)}: what hangs there swings as it likes; held = [...] in a table for "
            "--cylinders holds it")  # fmt: skip
    if arm.wet and (bare := bare_bodies(at_rest)):
        say(f"the water does not act on {', '.join(bare)}: no geom of these bodies is in it, or only a mesh, which "
            "carries no loads")  # fmt: skip
    if left := not_acted_on(place(path), [name for name, _ in arm.joints]):
        say(f"not acted on: {'; '.join(left)}")
    make_folder(folder)
    lines = [f"* {w.geom}: {w.C_D:g}, {w.C_M:g}, {w.length:.4g}, {w.diameter:.4g}" for w in arm.wet] or ["* nothing"]
    text = TEXT.format(name=arm.name, joints=len(arm.joints), tendons=", ".join(arm.tendons), wet="\n".join(lines))
    model = Model(
        arm.name, ("own_arm", "arm_model"), ("core", "mechanics"), ("numpy", "numba", "mujoco"),
        text + "\n" + variable_tables(table_of(arm)), scene_of(at_rest),
    )  # fmt: skip
    content = f"from __future__ import annotations\n\nDATA = {arm.as_data()!r}\n".encode()
    made = build_fmu(model, folder, say, way, sources={"fmus/arm_model.py": content})
    say(f"{made}: cylinders {', '.join(arm.tendons)}; {len(arm.joints)} joints; in the water: "
        f"{', '.join(w.geom for w in arm.wet) or 'nothing'}")  # fmt: skip
    return made
