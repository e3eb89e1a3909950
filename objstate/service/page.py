"""The page of a service: the building as it is believed to be, now and at any moment that is stored."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from objstate.building.model import Building
from objstate.report.document import Addition, page_head, section, whole_page
from objstate.report.markup import element, table, text
from objstate.report.plan import framed, object_markup, plan_buttons, shape_of

HEIGHT = 0.3  # m above the floor, where many robots carry their laser
KEYS = (
    "/ filters the objects, ↑ ↓ choose one; ← → go back and forth in time, End is now; + − 0 zoom. "
    "Drag the plan to move it, Ctrl and the wheel zoom. Drop logs anywhere."
)
LEGEND = (
    ("leaf", "believed now"),
    ("faded", "not seen for long"),
    ("interval", "90 % interval"),
    ("way", "robot"),
    ("scan", "its scan"),
)
OBJECTS = ("object", "state", "90 % interval", "last seen")
DRIVES = ("drive", "robot", "came", "state")


@cache
def service_page() -> str:
    """The page. It holds nothing of the building: that is asked for with a token."""
    login = element(
        "form",
        element("label", "Token", '<input type="password" id="token" autocomplete="off" required>'),
        element("button", "show", type="submit"),
        element(
            "p",
            "`objstate serve` prints the first token; `objstate serve token make` makes others.",
        ),
        id="login",
        hidden="",
    )
    body = (
        page_head("objstate", "")
        + element("p", "", id="said", role="status", aria_live="polite")
        + login
        + element("div", _facts(), _workbench(), id="shown", hidden="")
    )
    addition = Addition(_asset("service.js"), _asset("service.css"), connects=True)
    return whole_page("objstate", body, addition=addition)


def plan_words(building: Building) -> dict[str, Any]:
    """The plan of a building as SVG, and how states move what is on it."""
    items = list(building.objects.values())
    shapes = [shape_of(item, HEIGHT) for item in items]
    drawn = [object_markup(shape, index) for index, shape in enumerate(shapes)]
    drawn += [element("path", d="", class_="scan", id="scan"), element("g", id="robots")]
    return {
        "building": building.name,
        "svg": framed(building, shapes, np.zeros((0, 2)), HEIGHT, drawn, "plan"),
        "objects": [
            {
                "name": item.name,
                "kind": item.kind.value,
                "motion": shape.motion,
                "coordinates": list(item.coordinates),
                "home": item.home.round(4).tolist(),
            }
            for item, shape in zip(items, shapes, strict=True)
        ],
    }


def _facts() -> str:
    names = ("open", "closed", "unsure", "robots", "drives")
    return element("div", *(element("div", id=f"fact-{name}") for name in names), class_="facts")


def _workbench() -> str:
    slider = (
        '<input type="range" id="time" min="0" max="1000" value="1000" aria-label="moment" '
        'aria-valuetext="now">'
    )
    stage = element(
        "section",
        element("div", element("p", id="hidden"), class_="viewport", id="viewport"),
        element(
            "div",
            element("div", slider, class_="slider"),
            element("output", "now", id="clock", for_="time"),
            element("button", "now", id="now", type="button", aria_pressed="true"),
            element("span", plan_buttons(), class_="zoom"),
            class_="controls",
        ),
        element(
            "p",
            *(element("span", element("i", class_=kind), text(told)) for kind, told in LEGEND),
            class_="legend",
        ),
        element("p", text(KEYS), class_="keys"),
        class_="stage",
    )
    side = element(
        "div",
        element("section", id="chosen", aria_label="the chosen object", hidden=""),
        section(
            "Objects",
            '<input type="search" class="filter" id="filter" placeholder="filter" '
            'aria-label="show objects that contain">',
            table(OBJECTS, [], "states", "objects"),
        ),
        section("Look at next", element("div", id="next")),
        section("Robots", element("div", id="robot-list")),
        section("Drives", _upload(), table(DRIVES, [], "", "drives"), element("ul", id="aside")),
        class_="side",
    )
    return element("div", stage, side, class_="workbench")


def _upload() -> str:
    chosen = '<input type="file" id="files" multiple>'
    label = element("label", "Send logs: choose them, or drop them here. ", chosen)
    return element("div", label, element("ul", id="uploads"), id="drop")


def _asset(name: str) -> str:
    return files("objstate.service").joinpath("assets", name).read_text(encoding="utf-8")
