"""mypy over the packages under the names that they are installed with.

    python .ci/check_types.py [mypy's options]

The distribution gives the folders core, gap, ... names below `deepsea_cosim` (pyproject.toml, package-dir), which mypy
does not read. So this links them as build/types/deepsea_cosim/<folder>; which of them are checked, and how strictly,
stands in [tool.mypy].
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).parent.parent


def link_packages() -> None:
    """Make build/types/deepsea_cosim with a link to each top folder of the distribution."""
    folders = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"]
    tree = REPOSITORY / "build" / "types" / "deepsea_cosim"
    tree.mkdir(parents=True, exist_ok=True)
    door = folders.pop("deepsea_cosim")
    places = {path.split("/")[0]: REPOSITORY / path.split("/")[0] for path in folders.values()}
    places |= {path.name: path for path in (REPOSITORY / door).glob("*.py")}
    for name, path in places.items():
        if not (tree / name).exists():
            (tree / name).symlink_to(path, target_is_directory=path.is_dir())


if __name__ == "__main__":
    link_packages()
    sys.exit(subprocess.run([sys.executable, "-m", "mypy", *sys.argv[1:]], cwd=REPOSITORY).returncode)
