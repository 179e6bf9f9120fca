"""A page as a headless Chromium shows it, where that is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

available = shutil.which("chromium") is not None

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@contextmanager
def opened_page(path: Path) -> Iterator[tuple[Any, list[str]]]:
    """A page as playwright drives it, at 1366x768, and the messages of its console."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        messages: list[str] = []
        page.on("console", lambda m: messages.append(m.text))
        page.on("pageerror", lambda e: messages.append(str(e)))
        page.goto(path.as_uri())
        yield page, messages
        browser.close()


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
