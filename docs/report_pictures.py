"""Pictures of HTML pages as a desktop browser shows them, without a screen."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

DESKTOP = (1280, 900)


def photograph(pages: Mapping[Path, Path], *, size: tuple[int, int] = DESKTOP) -> None:
    """Save the first screen of every page as a PNG.

    Parameters
    ----------
    pages
        The pictures to write, by HTML file.
    size
        Width and height of the window in pixels.

    Raises
    ------
    RuntimeError
        If there is no Chromium.
    """
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium")
    if chromium is None:
        raise RuntimeError("no browser: install Debian's chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"], timeout=90_000)
        window = browser.new_page(viewport={"width": size[0], "height": size[1]})
        for page, picture in pages.items():
            window.goto(page.resolve().as_uri())
            window.screenshot(path=picture)
        browser.close()
