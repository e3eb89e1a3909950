"""The page in a real browser: what is dragged, clicked and typed is saved."""

from __future__ import annotations

import csv
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from objstate.building import load_building
from objstate.building.model import Kind
from objstate.editing import edit_app, edit_page, subject_of
from objstate.geometry import FloatArray

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

POINTS = np.array([[2.5, 0.0], [2.0, 0.9]])


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as api:
        chromium = api.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@dataclass
class Desk:
    """The page, and where its building is saved."""

    page: Any
    folder: Path
    faults: list[str]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a place of the building (m) lies on the screen, px."""
        found = self.page.evaluate(
            """([x, y]) => { const p = new DOMPoint(x, y).matrixTransform(
            document.getElementById("doors").getScreenCTM()); return [p.x, p.y]; }""",
            [x, y],
        )
        return found[0], found[1]

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag between two places of the building, m."""
        self.page.mouse.move(*self.at(*start))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(*end), steps=4)
        self.page.mouse.up()

    def click(self, x: float, y: float) -> None:
        self.page.mouse.click(*self.at(x, y))

    def doors(self) -> dict[str, dict[str, str]]:
        """The table, once it was saved."""
        playwright.expect(self.page.locator("#said")).to_have_text("saved")
        with (self.folder / "doors.csv").open() as file:
            return {row["door"]: row for row in csv.DictReader(file)}

    def hinge(self, name: str) -> FloatArray:
        self.doors()
        return load_building(self.folder / "room.urdf")[name].hinge


@pytest.fixture
def desk(browser: Any, folder: Path) -> Iterator[Desk]:
    uvicorn = pytest.importorskip("uvicorn", reason="Uvicorn is not installed")
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        port = listening.getsockname()[1]
        config = uvicorn.Config(edit_app(subject_of(folder), POINTS), log_level="error")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        while not server.started:
            time.sleep(0.01)
        page, faults = opened(browser, f"http://127.0.0.1:{port}/")
        yield Desk(page, folder, faults)
        page.close()
        assert faults == []
        server.should_exit = True
        thread.join()


def opened(browser: Any, address: str) -> tuple[Any, list[str]]:
    page = browser.new_page(viewport={"width": 1300, "height": 800})
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text))
    page.goto(address)
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page, faults


def test_a_hinge_snaps_to_the_end_of_a_wall_and_the_leaf_goes_along(desk: Desk) -> None:
    desk.drag((2.0, 0.0), (2.03, 0.07))  # the wall's corner is at (2, 0.05)
    assert desk.hinge("left") == pytest.approx([2, 0.05], abs=1e-3)
    assert float(desk.doors()["left"]["width_m"]) == pytest.approx(1.0)


def test_a_free_edge_sets_width_and_bearing(desk: Desk) -> None:
    desk.page.keyboard.down("Alt")
    desk.drag((3.0, 0.0), (2.0, 1.2))
    desk.page.keyboard.up("Alt")
    row = desk.doors()["left"]
    assert float(row["width_m"]) == pytest.approx(1.2, abs=0.02)
    assert float(row["closed_bearing_deg"]) == pytest.approx(90, abs=1)


def test_three_clicks_add_a_door_that_opens_to_the_third(desk: Desk) -> None:
    desk.page.keyboard.press("a")
    for place in ((1.0, 4.05), (1.9, 4.05), (1.4, 4.6)):
        desk.click(*place)
    row = desk.doors()["door_01"]
    assert float(row["hinge_x"]) == pytest.approx(1.0, abs=0.02)
    assert float(row["width_m"]) == pytest.approx(0.9, abs=0.03)
    assert row["opens"] == "ccw"
    assert desk.page.locator("#rows tr").count() == 2


def test_what_was_done_is_undone_and_done_again(desk: Desk) -> None:
    desk.page.keyboard.press("d")
    assert desk.doors()["left"]["opens"] == "cw"
    desk.page.keyboard.press("Control+z")
    assert desk.doors()["left"]["opens"] == "ccw"
    desk.page.keyboard.press("Control+y")
    assert desk.doors()["left"]["opens"] == "cw"


def test_a_flipped_hinge_leaves_the_doorway_and_the_side_to_which_it_opens(desk: Desk) -> None:
    desk.page.keyboard.press("f")
    row = desk.doors()["left"]
    assert (float(row["hinge_x"]), float(row["hinge_y"])) == pytest.approx((3, 0))
    assert abs(float(row["closed_bearing_deg"])) == pytest.approx(180)
    assert row["opens"] == "cw"


def test_a_door_is_made_to_slide_and_to_turn_again(desk: Desk) -> None:
    desk.page.keyboard.press("s")
    row = desk.doors()["left"]
    assert (row["opens"], row["upper_limit_deg"], row["upper_limit_m"]) == ("slides", "", "1.0")
    desk.page.locator("#in-angle").fill("0.4")
    assert desk.page.locator("#doors .shown").get_attribute("d") == "M1.600,0.000L2.600,0.000"
    desk.page.keyboard.press("d")  # to the other side
    assert float(desk.doors()["left"]["hinge_x"]) == pytest.approx(3.0)
    desk.page.fill("#in-upper", "0.8")
    desk.page.keyboard.press("Enter")
    desk.doors()
    leaf = load_building(desk.folder / "room.urdf")["left"]
    assert (leaf.kind, leaf.upper) == (Kind.SLIDING, pytest.approx(0.8))
    desk.page.select_option("#in-sense", "1")
    row = desk.doors()["left"]
    assert (row["opens"], row["upper_limit_deg"]) == ("ccw", "90.0")


def test_a_page_that_is_loaded_again_shows_what_was_decided(desk: Desk) -> None:
    desk.page.keyboard.press("n")
    assert desk.doors() == {}
    desk.page.reload()
    assert desk.page.locator("#rows tr").get_attribute("class") == "rejected chosen"
    desk.page.keyboard.press("y")
    assert list(desk.doors()) == ["left"]


def test_a_page_that_shows_an_earlier_state_says_so(desk: Desk, browser: Any) -> None:
    second = browser.new_page()
    second.goto(desk.page.url)
    desk.page.keyboard.press("ArrowUp")
    assert desk.hinge("left") == pytest.approx([2.0, 0.01])
    second.keyboard.press("ArrowRight")
    playwright.expect(second.locator("#said")).to_contain_text("reload")
    assert desk.hinge("left") == pytest.approx([2.0, 0.01])
    second.reload()
    second.keyboard.press("ArrowRight")
    playwright.expect(second.locator("#said")).to_have_text("saved")
    assert desk.hinge("left") == pytest.approx([2.01, 0.01])
    second.close()


def test_doors_are_rejected_accepted_renamed_and_found(desk: Desk) -> None:
    desk.page.keyboard.press("n")
    assert desk.doors() == {}
    desk.page.keyboard.press("y")
    assert list(desk.doors()) == ["left"]
    desk.page.fill("#in-name", "kitchen")
    desk.page.keyboard.press("Enter")
    assert list(desk.doors()) == ["kitchen"]
    desk.page.fill("#search", "bath")
    assert desk.page.locator("#rows tr").count() == 0
    desk.page.fill("#search", "KIT")
    assert desk.page.locator("#rows tr").count() == 1


def test_a_name_that_another_object_has_is_not_taken(desk: Desk) -> None:
    desk.page.fill("#in-name", "desk")
    desk.page.keyboard.press("Enter")
    assert desk.page.locator("#said").text_content() == "'desk' is the name of another"
    assert desk.page.locator("#rows th").text_content() == "left"


@pytest.mark.parametrize(
    ("field", "typed", "told"),
    [
        ("width", "0", "'width, m' must be 0.2 to 5 m, not 0"),
        ("width", "900", "'width, m' must be 0.2 to 5 m, not 900"),
        ("upper", "400", "'opens up to, deg or m' must be 7 to 359 degrees, not 400"),
        ("x", "", "'hinge x, m' must be -100000000 to 100000000 m"),
    ],
)
def test_why_a_number_is_refused_is_told(desk: Desk, field: str, typed: str, told: str) -> None:
    before = desk.page.input_value(f"#in-{field}")
    desk.page.fill(f"#in-{field}", typed)
    desk.page.keyboard.press("Enter")
    assert desk.page.locator("#said").text_content() == f"not changed: {told}"
    assert desk.page.input_value(f"#in-{field}") == before
    assert not (desk.folder / "doors.csv").exists()


def test_numbers_and_arrows_move_a_hinge(desk: Desk) -> None:
    desk.page.fill("#in-x", "2.1")
    desk.page.keyboard.press("Enter")
    desk.page.keyboard.press("ArrowUp")
    assert desk.hinge("left") == pytest.approx([2.1, 0.01])


def test_the_leaf_is_shown_at_an_angle_without_a_change(desk: Desk) -> None:
    desk.page.locator("#in-angle").fill("90")
    d = desk.page.locator("#doors .shown").get_attribute("d")
    assert d == "M2.000,0.000L2.000,1.000"
    assert not (desk.folder / "doors.csv").exists()


def test_the_page_alone_downloads_its_table(browser: Any, folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(edit_page(subject_of(folder), POINTS))
    page, faults = opened(browser, file.as_uri())
    page.keyboard.press("d")
    with page.expect_download() as download:
        page.click("#download")
    assert Path(download.value.path()).read_text().splitlines()[1:] == ["left,2,0,0,cw,1,100"]
    assert page.locator("image.density").count() == 1
    assert faults == []
    page.close()
