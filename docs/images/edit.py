"""Draws docs/images/edit.png: the three doors of Wean Hall, added by three clicks each.

    .venv/bin/python docs/images/edit.py ../shared/data/wean-hall out/wean

Needs the extra ``browser`` and a Chromium. Writes the table that the page downloads to the second
folder.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

from objstate.building.door_table import Door, read_doors
from objstate.editing import edit_page, subject_of
from objstate.editing.drives import points_of

PICTURE = Path(__file__).with_suffix(".png")
SEEN = (
    Path(__file__).parents[2] / "benchmarks" / "wean_hall_doors.csv"
)  # where leaves of both runs meet
MIDDLE, METRES = (51.6, 39.2), 9.0  # shown, and how wide
SHOWN_AT = 58  # degrees, WL2 in run 2
WIDTH, HEIGHT = 1280, 720  # px


def main(data: str, out: str) -> None:
    """Add the doors as a person does, take the picture, and download the table."""
    wean = Path(data)
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as api:
        subject = subject_of(wean / "wean.yaml", Path(scratch) / "building")
        points = points_of([wean / "run1.mcap", wean / "run2.mcap"], subject.building)
        file = Path(scratch) / "edit.html"
        file.write_text(edit_page(subject, points), encoding="utf-8")
        browser = api.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(file.as_uri())
        _zoom(page)
        for door in read_doors(SEEN):
            _add(page, door)
        page.keyboard.press("k")
        page.locator("#in-angle").fill(str(SHOWN_AT))
        page.mouse.move(WIDTH / 2, 5)  # off the plan
        page.evaluate("new Promise(done => setTimeout(done, 200))")
        page.screenshot(path=PICTURE)
        Image.open(PICTURE).quantize().save(PICTURE, optimize=True)
        with page.expect_download() as download:
            page.click("#download")
        Path(out).mkdir(parents=True, exist_ok=True)
        download.value.save_as(Path(out) / "doors.csv")
        browser.close()


def _zoom(page: Any) -> None:
    """Show the doors."""
    page.evaluate(
        """([x, y, width]) => { const plan = plans.get(document.getElementById("plan"));
        const height = width * plan.box.height / plan.box.width;
        plan.show({ x: x - width / 2, y: -y - height / 2, width, height }); }""",
        [*MIDDLE, METRES],
    )


def _add(page: Any, door: Door) -> None:
    """Click the hinge, the free edge, and a place to which the door opens; then name it."""
    way = door.width * np.array([np.cos(door.closed_bearing), np.sin(door.closed_bearing)])
    aside = door.sense * np.array([-way[1], way[0]])
    page.keyboard.press("a")
    for x, y in (door.hinge, door.hinge + way, door.hinge + (way + aside) / 2):
        place = page.evaluate(
            """([x, y]) => { const p = new DOMPoint(x, y).matrixTransform(
            document.getElementById("doors").getScreenCTM()); return [p.x, p.y]; }""",
            [float(x), float(y)],
        )
        page.keyboard.down("Alt")
        page.mouse.click(*place)
        page.keyboard.up("Alt")
    page.fill("#in-name", door.name)
    page.keyboard.press("Enter")


if __name__ == "__main__":
    main(*sys.argv[1:])
