"""The page in a real browser, where there is one: it draws, fits, and follows the slider."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from objstate.report import write_report

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as api:
        chromium = api.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


def opened(browser: Any, result: Path, width: int, scheme: str, where: str = "") -> Any:
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(write_report(result).absolute().as_uri() + where)
    assert faults == []
    return page


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_the_page_fits_and_draws(browser: Any, result: Path, width: int, scheme: str) -> None:
    page = opened(browser, result, width, scheme)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    box = page.locator("#plan").bounding_box()
    assert box["width"] >= width - 50
    smallest = page.evaluate(
        "Math.min(...[...document.querySelectorAll('main *')].filter(e => e.childElementCount === 0"
        " && e.textContent.trim() && e.tagName !== 'text' && e.tagName !== 'title')"
        ".map(e => parseFloat(getComputedStyle(e).fontSize)))"
    )
    assert smallest >= 11  # px
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    bright = sum(map(int, re.findall(r"\d+", paper)[:3])) > 380
    assert bright == (scheme == "light")
    page.click("#theme")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != paper


def test_the_slider_moves_door_and_robot(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1280, "light", "#t=0.2")
    leaf = page.locator("g.object").first.locator(".estimate")
    at_first, robot = leaf.get_attribute("transform"), page.locator("#robot")
    stood = robot.get_attribute("transform")
    page.locator("#time").fill("9999")  # beyond the end
    angle = re.match(r"rotate\((\S+) 2 2\)", leaf.get_attribute("transform"))
    assert angle
    assert float(angle[1]) == pytest.approx(
        -34.4, abs=3.0
    )  # 0.6 rad about an axis that points down
    assert leaf.get_attribute("transform") != at_first
    assert robot.get_attribute("transform") != stood
    assert "seen" in page.locator("article output").first.text_content()
    page.locator(".map").first.click(position={"x": 1, "y": 5})
    assert page.locator("#clock").text_content() == "0.0 s"
