"""The page in a real browser, where there is one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.conftest import Serve, Service
from tests.service.test_live import robot

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

__all__ = ["robot"]
FAULTS: list[str] = []


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as api:
        chromium = api.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


def opened(browser: Any, service: Service, width: int = 1280, scheme: str = "light") -> Any:
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.on("console", lambda told: page.faults.append(told.text))
    page.goto(f"{service.address}/#token={service.token}")
    page.wait_for_selector("#objects tbody tr")
    return page


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_it_shows_what_is_believed(browser: Any, taught: Service, width: int, scheme: str) -> None:
    page = opened(browser, taught, width, scheme)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert service_words(taught) in page.locator("#objects tbody tr").inner_text()
    assert page.url == f"{taught.address}/"  # the token isn't left in the address
    page.locator("#objects tbody tr").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("#passage:has-text('probability')")
    assert page.locator("#chosen .history path.median").get_attribute("d")
    turned = page.locator("g.object .estimate").get_attribute("transform")
    assert turned.startswith("rotate(")
    assert page.faults == []
    page.close()


def service_words(service: Service) -> str:
    closed = service.ask("/v1/objects/door").json["attributes"]["closed"]["true"]
    return f"closed {round(100 * closed)} %" if closed >= 0.5 else "open"


def test_time_goes_back_to_before_anything_was_known(browser: Any, taught: Service) -> None:
    page = opened(browser, taught)
    page.locator("#time").fill("999")
    page.wait_for_function("document.getElementById('clock').textContent !== 'now'")
    page.locator("#time").fill("0")
    page.wait_for_selector("#objects tbody tr:has-text('never')")
    page.keyboard.press("End")
    page.wait_for_function("document.getElementById('clock').textContent === 'now'")
    page.wait_for_selector("#objects tbody tr:not(:has-text('never'))")
    assert page.faults == []
    page.close()


def test_without_a_token_it_shows_nothing(browser: Any, taught: Service) -> None:
    page = browser.new_page()
    page.goto(taught.address)
    page.wait_for_selector("#login:visible")
    page.locator("#token").fill("objstate_wrong")
    page.keyboard.press("Enter")
    page.wait_for_selector("#said.wrong:has-text('token')")
    assert "door" not in page.content().split("<script")[0]
    page.close()


def test_a_log_is_dropped_and_estimated_and_a_person_corrects_it(
    browser: Any, serve: Serve, hall: tuple[Path, Path]
) -> None:
    service = serve()
    page = opened(browser, service)
    page.locator("#files").set_input_files(str(hall[1]))
    page.wait_for_selector("#drives td:has-text('done')", timeout=120_000)
    page.locator("#objects tbody tr").click()
    page.locator("#chosen button:has-text('it is open')").click()
    page.wait_for_selector("#chosen li:has-text('a person at the page')")
    assert page.faults == []
    page.close()


def test_a_live_robot_is_drawn(browser: Any, serve: Serve, robot: int) -> None:
    service = serve(None, "--foxglove", f"r1=ws://127.0.0.1:{robot}")
    page = opened(browser, service)
    page.wait_for_selector("#robots g.robot", state="attached", timeout=120_000)
    assert page.locator("#scan").get_attribute("d")
    assert "r1" in page.locator("#robot-list").inner_text()
    assert page.faults == []
    page.close()
