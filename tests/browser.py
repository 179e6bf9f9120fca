"""A page as a headless Chromium shows it, where that is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np

available = shutil.which("chromium") is not None


def pixels(page: Path, folder: Path, height: int = 3000) -> np.ndarray:
    """The page (height, width, 3); what the browser writes goes into the folder."""
    from PIL import Image

    target = folder / "page.png"
    flags = [
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
        "--disable-background-networking", "--disable-component-update", f"--user-data-dir={folder / 'profile'}",
        "--hide-scrollbars", f"--window-size=1200,{height}", f"--screenshot={target}",
    ]  # fmt: skip
    subprocess.run(["chromium", *flags, page.as_uri()], check=True, capture_output=True, timeout=60)
    return np.asarray(Image.open(target).convert("RGB"))
