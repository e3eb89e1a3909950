"""The page on which a building's doors are put right: one HTML file."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from objstate.building.inspection import DEFAULT_HEIGHT
from objstate.building.model import Building
from objstate.building.outline import outline
from objstate.editing.drives import Picture, picture
from objstate.editing.rows import DoorRow, row_of
from objstate.editing.subject import Subject
from objstate.geometry import FloatArray
from objstate.report.document import Addition, page_head, section, warnings_list, whole_page
from objstate.report.markup import element, polyline, text
from objstate.report.plan import framed, plan_buttons, shape_of

MARGIN = 1.0  # m around the walls, in which scan points are drawn
KEYS = (
    "j k next, previous door; y n accept, reject; a add by three clicks (hinge, free edge, the "
    "side to which it opens); f flip the hinge's side, d the direction; s a door that slides, or "
    "turns; arrows move it by 1 cm; Ctrl+Z, Ctrl+Y undo, redo; / search; + − 0 zoom. Drag a hinge "
    "or a free edge; with Alt nothing snaps."
)


@dataclass(frozen=True)
class SavedState:
    """What a page tells the server that it saves to."""

    token: str  # by which the server knows its own pages
    revision: str  # of the saved state that the page shows


def edit_page(
    subject: Subject,
    points: FloatArray,
    saved: SavedState | None = None,
    height: float = DEFAULT_HEIGHT,
) -> str:
    """The page for a building, over points (n, 2) m of drives.

    With ``saved`` it saves to the server that it came from; without, it offers its table as a
    download. ``height`` is that of the laser, m.
    """
    building = subject.building
    walls = outline(building.walls, height)
    low, high = _bounds(walls)
    shown = picture(points, low, high)
    title = f"Doors of {building.name}"
    said = (
        f"{len(subject.rows)} doors, {shown.points if shown else 0} scan points; saved to "
        f"{subject.out}"
        if saved
        else f"{len(subject.rows)} doors, {shown.points if shown else 0} scan points"
    )
    plan = framed(building, [], np.zeros((0, 2)), height, _drawn(building, shown, height), "plan")
    stage = element(
        "div",
        element("div", plan, element("p", "", id="hidden"), class_="viewport"),
        element("div", plan_buttons(), _buttons(), class_="controls"),
        element("p", KEYS, class_="keys"),
        class_="stage",
    )
    side = element("div", _form(), _list(), class_="side")
    data = _data(subject, walls, saved)
    addition = Addition(_asset("edit.js"), _asset("edit.css"), connects=saved is not None)
    head = page_head(title, said) + warnings_list([text(each) for each in subject.warnings])
    body = head + element("div", stage, side, class_="workbench")
    return whole_page(title, body, data, addition=addition)


def _data(subject: Subject, walls: FloatArray, saved: SavedState | None) -> dict[str, Any]:
    taken = [name for name, item in subject.building.objects.items() if row_of(item) is None]
    return {
        "doors": [_row(row) for row in _ordered(subject.rows)],
        "walls": walls.reshape(-1, 4).round(4).tolist(),
        "names": taken,
        "token": None if saved is None else saved.token,
        "revision": None if saved is None else saved.revision,
    }


def _row(row: DoorRow) -> dict[str, Any]:
    return row.model_dump()


def _ordered(rows: list[DoorRow]) -> list[DoorRow]:
    """Undecided candidates first, the most probable at the top; others in their order."""
    return sorted(
        rows, key=lambda row: -(row.probability or 0.0) if row.decision == "open" else 1.0
    )


def _drawn(building: Building, shown: Picture | None, height: float) -> list[str]:
    """What lies over the walls: scan points, objects that aren't edited, and room for the doors."""
    others = [
        "".join(polyline(ring, closed=True) for ring in shape_of(item, height).hull)
        for item in building.objects.values()
        if row_of(item) is None
    ]
    image = (
        ""
        if shown is None
        else element(
            "image",
            href=shown.url,
            x=f"{shown.x:.3f}",
            y=f"{-shown.y - shown.height:.3f}",
            width=f"{shown.width:.3f}",
            height=f"{shown.height:.3f}",
            transform="scale(1 -1)",
            preserveAspectRatio="none",
            class_="density",
        )
    )
    return [
        image,
        *(element("path", d=each, class_="ghost") for each in others),
        element("g", id="doors"),
        element("path", d="", id="drawing", class_="leaf"),
    ]


def _buttons() -> str:
    named = (
        ("add", "add a door"), ("undo", "undo"), ("redo", "redo"), ("points", "scan points"),
        ("download", "download doors.csv"),
    )  # fmt: skip
    written = "".join(element("button", label, id=name, type="button") for name, label in named)
    return written + element("output", "", id="said")


def _form() -> str:
    """The fields of the selected door."""
    fields = (
        ("name", "name", "text", ""),
        ("x", "hinge x, m", "number", "0.01"),
        ("y", "hinge y, m", "number", "0.01"),
        ("bearing", "closed bearing, deg", "number", "0.5"),
        ("width", "width, m", "number", "0.01"),
        ("upper", "opens up to, deg or m", "number", "any"),
    )
    inputs = [
        element("label", label, element("input", id=f"in-{name}", type=kind, step=step or None))
        for name, label, kind, step in fields
    ]
    opens = element(
        "label",
        "opens",
        element(
            "select",
            element("option", "counter-clockwise", value="1"),
            element("option", "clockwise", value="-1"),
            element("option", "slides", value="0"),
            id="in-sense",
        ),
    )
    angle = element(
        "label",
        "show the leaf at, deg or m",
        element("input", id="in-angle", type="range", min="0", max="90", step="1", value="0"),
        element("output", "0", id="angle"),
        class_="wide-field",
    )
    named = (
        ("accept", "accept (y)"), ("reject", "reject (n)"), ("flip", "flip hinge (f)"),
        ("turn", "flip direction (d)"), ("slide", "slides or turns (s)"),
    )  # fmt: skip
    buttons = [element("button", label, id=name, type="button") for name, label in named]
    return section(
        "Door",
        element("form", *inputs, opens, angle, id="form"),
        element("div", *buttons, class_="buttons"),
    )


def _list() -> str:
    search = element(
        "input",
        id="search",
        class_="filter",
        type="search",
        placeholder="search",
        aria_label="search",
    )
    columns = ("door", "probability", "decision", "width, m", "opens")
    head = element("tr", *(element("th", each, scope="col") for each in columns))
    table = element("table", element("thead", head), element("tbody", id="rows"))
    return section("Doors", search, element("div", table, class_="wide"))


def _bounds(walls: FloatArray) -> tuple[FloatArray, FloatArray]:
    if not len(walls):
        return np.zeros(2), np.ones(2)
    points = walls.reshape(-1, 2)
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _asset(name: str) -> str:
    return files("objstate.editing").joinpath("assets", name).read_text(encoding="utf-8")
