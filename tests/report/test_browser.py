"""The page in a real browser, where there is one: it draws, fits, and follows the slider."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from objstate.report import write_batch_report, write_report
from tests.report.pages import renamed

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as api:
        chromium = api.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


def opened(
    browser: Any, result: Path, width: int, scheme: str, where: str = "", height: int = 800
) -> Any:
    return shown(browser, write_report(result), width, scheme, where, height)


def shown(
    browser: Any, file: Path, width: int, scheme: str = "light", where: str = "", height: int = 800
) -> Any:
    """A page of the browser with a report in it, whose script met no error."""
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text))
    page.goto(file.absolute().as_uri() + where)
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert faults == []
    return page


def boxes(page: Any, selector: str) -> list[dict[str, float]]:
    """Where the elements that are shown stand, px."""
    found = [each.bounding_box() for each in page.locator(selector).all() if each.is_visible()]
    return [box for box in found if box]


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
    assert "seen at" in page.locator("article output").first.text_content()
    page.locator(".map").first.click(position={"x": 1, "y": 5})
    assert page.locator("#clock").text_content() == "0.0 s"


def test_plan_and_controls_fit_on_the_screen_of_a_laptop(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1440, "light", height=900)
    for selector in ("#plan", "#time", "#play", "#clock", ".legend"):
        (box,) = boxes(page, selector)
        assert box["y"] + box["height"] <= 900, selector
    everything = page.evaluate(
        """() => { const b = document.querySelector('#plan').getBoundingClientRect();
        return [...document.querySelectorAll('#plan .wall, #plan .leaf')].every(e => {
        const r = e.getBoundingClientRect();
        return r.left >= b.left && r.right <= b.right && r.top >= b.top && r.bottom <= b.bottom; }) }"""
    )
    assert everything


@pytest.mark.parametrize("width", [1440, 390])
def test_names_on_the_plan_cover_neither_one_another_nor_the_edge(
    browser: Any, result: Path, width: int
) -> None:
    page = opened(browser, result, width, "light")
    names, (plan,) = boxes(page, "#plan text.name"), boxes(page, "#plan")
    assert names
    for k, one in enumerate(names):
        assert one["x"] >= plan["x"]
        assert one["x"] + one["width"] <= plan["x"] + plan["width"]
        for other in names[:k]:
            apart_x = (
                one["x"] + one["width"] <= other["x"] or other["x"] + other["width"] <= one["x"]
            )
            apart_y = (
                one["y"] + one["height"] <= other["y"] or other["y"] + other["height"] <= one["y"]
            )
            assert apart_x or apart_y


def test_the_scan_of_the_moment_is_drawn_where_its_beams_ended(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1280, "light")
    ends = re.findall(r"M([-\d.]+),([-\d.]+)h0", page.locator("#scan").get_attribute("d"))
    assert len(ends) > 30
    assert page.locator("#scan").is_visible()
    page.locator("[data-layer=scan]").uncheck()
    assert not page.locator("#scan").is_visible()
    near = [
        min(abs(float(x) + 1.95), abs(float(x) - 5.95), abs(float(y) + 1.95), abs(float(y) - 1.95))
        for x, y in ends
    ]
    assert sorted(near)[len(near) // 2] < 0.05
    moved = page.locator("#scan").get_attribute("d")
    page.keyboard.press("Home")
    assert page.locator("#scan").get_attribute("d") != moved


@pytest.mark.parametrize("where", ["", "#t=1", "#t=2.3"])
def test_table_and_strip_and_plan_say_the_same_of_one_moment(
    browser: Any, result: Path, where: str
) -> None:
    page = opened(browser, result, 1280, "light", where)
    index = page.locator("article").first.get_attribute("data-object")
    row = page.locator(f"table.states tr[data-object='{index}']").first
    if page.locator(f"article[data-object='{index}'] .map").count() == 1:
        mean, seen = row.locator(".median").text_content(), row.locator(".seen").text_content()
    else:
        index = page.locator("article", has_text="office_door").get_attribute("data-object")
        row = page.locator(f"table.states tr[data-object='{index}']").first
        mean, seen = row.locator(".median").text_content(), row.locator(".seen").text_content()
    readout = page.locator(f"article[data-object='{index}'] output").text_content()
    assert readout.startswith(f"{mean} (")
    assert readout.endswith(f"seen at {seen}" if seen != "never" else "not seen yet")
    assert (
        mean.split(", ")[-1]
        in page.locator(f"#plan text.name[data-object='{index}']").text_content()
    )


def test_keys_move_and_zoom_and_play(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1280, "light")
    clock = page.locator("#clock")
    last = float(clock.text_content().split()[0])
    page.keyboard.press("ArrowLeft")
    assert float(clock.text_content().split()[0]) == pytest.approx(last - 1.0)
    page.keyboard.press("Home")
    assert clock.text_content() == "0.0 s"
    whole = page.locator("#plan").get_attribute("viewBox")
    page.keyboard.press("+")
    assert page.locator("#plan").get_attribute("viewBox") != whole
    page.keyboard.press("0")
    assert page.locator("#plan").get_attribute("viewBox") == whole
    speed = page.locator("#speed").input_value()
    page.keyboard.press(">")
    assert float(page.locator("#speed").input_value()) > float(speed)
    page.keyboard.press(" ")
    playwright.expect(clock).not_to_have_text("0.0 s")


def test_the_plan_zooms_out_and_fits_again(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1280, "light")
    width = "document.getElementById('plan').viewBox.baseVal.width"
    whole = page.evaluate(width)
    page.click(".smaller")
    assert page.evaluate(width) > 1.2 * whole
    page.click(".fit")
    page.click(".larger")
    assert page.evaluate(width) < whole / 1.2
    page.click(".fit")
    assert page.evaluate(width) == pytest.approx(whole)


def test_pointing_at_a_strip_tells_its_moment_and_marks_the_object(
    browser: Any, result: Path
) -> None:
    page = opened(browser, result, 1280, "light")
    page.locator(".map").first.hover()
    index = page.locator("article").first.get_attribute("data-object")
    assert page.locator("#plan g.object.pointed").get_attribute("data-object") == index
    assert re.match(r"\d+\.\d s", page.locator(".tip").text_content())


def test_tables_are_sorted_and_filtered_by_hand(browser: Any, batch: Path) -> None:
    page = shown(browser, write_batch_report(batch), 1280)
    names = page.locator("section", has_text="Logs").first.locator("tbody th")
    assert names.all_text_contents() == ["broken", "first", "second"]
    page.locator("thead button", has_text="log").first.click()
    page.locator("thead button", has_text="log").first.click()
    assert names.all_text_contents() == ["second", "first", "broken"]


def test_a_figure_is_saved_as_an_svg_that_stands_alone(
    browser: Any, result: Path, tmp_path: Path
) -> None:
    page = opened(browser, result, 1280, "light")
    for number, words in ((0, "office_door"), (1, "seen")):
        with page.expect_download() as download:
            page.locator(".export").nth(number).click()
        file = tmp_path / f"{number}.svg"
        download.value.save_as(file)
        root = ElementTree.fromstring(file.read_text(encoding="utf-8"))
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert words in "".join(root.itertext())
        assert "var(" not in file.read_text(encoding="utf-8")
        assert len(shown(browser, file, 800).screenshot()) > 2000


def test_a_page_prints(browser: Any, result: Path) -> None:
    page = opened(browser, result, 1280, "dark")
    assert page.pdf(format="A4").startswith(b"%PDF")
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not page.locator(".controls").is_visible()


def test_names_from_outside_run_nothing(browser: Any, result: Path, tmp_path: Path) -> None:
    shutil.copytree(result.parent, tmp_path / "drive")
    renamed(tmp_path / "drive" / "out", "chest", "<img src=x onerror=document.title='hit'>")
    page = opened(browser, tmp_path / "drive" / "out", 1280, "light")
    page.locator("g.object").last.hover(force=True)
    page.locator("article").last.hover()
    assert "hit" not in page.title()
    assert page.locator("img").count() == 0
    blocked = page.evaluate(
        """() => new Promise(done => {
        addEventListener('securitypolicyviolation', () => done(true));
        document.body.insertAdjacentHTML('beforeend', '<b onclick="document.title=1">');
        document.body.lastElementChild.click();
        setTimeout(() => done(false), 1000); })"""
    )
    assert blocked
