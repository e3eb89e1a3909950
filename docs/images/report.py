"""Draws docs/images/report.png: the report of the sample log, in a browser.

    .venv/bin/python docs/images/report.py out/corridor    # after make run

Needs the extra ``browser`` and a Chromium.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from objstate.report import write_report

PICTURE = Path(__file__).with_suffix(".png")
PATH = Path("logs/corridor.path.tum")
MOMENT = 16.6  # s, when one door is still vague
WIDTH, HEIGHT = 1280, 880  # px


def main(result: str) -> None:
    """Write the report to a temporary place and take its picture."""
    with tempfile.TemporaryDirectory() as scratch:
        page = write_report(result, Path(scratch) / "report.html", true_path=PATH)
        with sync_playwright() as api:
            browser = api.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox"]
            )
            shown = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
            shown.goto(f"{page.as_uri()}#t={MOMENT}")
            shown.evaluate("new Promise(done => setTimeout(done, 200))")
            shown.screenshot(path=PICTURE)
            browser.close()


if __name__ == "__main__":
    main(sys.argv[1])
