"""The code of docs/python.md runs as it stands there."""

import re
from pathlib import Path

import deepsea_cosim
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
CAMPAIGN = "campaign/campaign.toml"
"""What the block of the diagnosis reads, which tests/gap has in small."""


def test_the_code_runs(built, tmp_path, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "build").symlink_to(built, target_is_directory=True)
    monkeypatch.setattr(deepsea_cosim, "build_fmus", lambda out: sorted(Path(out).glob("*.ssp")))
    space = {}
    ran = [block for block in BLOCKS if CAMPAIGN not in block]
    assert len(ran) == len(BLOCKS) - 1
    for block in ran:
        exec(compile(block, str(PAGE), "exec"), space)
    assert max(space["frame"]["arm.x_h"]) == pytest.approx(0.15, abs=0.005)
    assert space["x"] == pytest.approx(0.1, abs=0.005)
    assert space["found"].frame()["out"].notna().sum() >= 4
    assert space["observation"].shape == (2,)
    assert {path.name for path in tmp_path.glob("*.png")} == {"stroke.png", "out.png"}
    space["env"].close()
