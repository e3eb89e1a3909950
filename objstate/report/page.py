"""One result as one HTML page that needs neither a server nor a network."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, tzinfo
from typing import Any

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.evaluation import LatestState, latest_states
from objstate.evaluation.states import Coordinate, TrueCourse, true_courses
from objstate.geometry import FloatArray
from objstate.order import natural_key
from objstate.report.accuracy import accuracy
from objstate.report.candidates import candidate_outlines, candidates_table
from objstate.report.course import weak
from objstate.report.document import page_head, section, warnings_list, whole_page
from objstate.report.events import events_table
from objstate.report.judgement import Judged, fact, headline, judged, tallied
from objstate.report.markup import element, text
from objstate.report.material import Material
from objstate.report.plan import Shape, draw_plan, plan_buttons, shape_of
from objstate.report.reading import moment, span
from objstate.report.settings import provenance
from objstate.report.states import states_table
from objstate.report.strips import Axis, strip, time_axis
from objstate.report.timeline import (
    clutter_moments,
    object_moments,
    robot_moments,
    scan_moments,
    step_for,
    stretches,
    true_values,
)
from objstate.report.words import warnings

LEGEND = (
    ("leaf", "estimate"),
    ("faded", "last believed, not near now"),
    ("interval", "90 % interval"),
    ("wrong", "wrong by the truth"),
    ("truth", "truth"),
    ("scan", "scan"),
    ("clutter", "not in the building"),
    ("way", "robot's path"),
    ("way lost", "robot lost"),
)
LAYERS = ("clutter", "scan")  # paths of the plan that can be switched off; their ids
WITH_TRUTH = ("wrong", "truth")
SPEEDS = (1, 2, 5, 10, 20, 50, 100)  # times real time
PLAYED_IN = 20.0  # s; default duration of playing a log
WIDE = 2.2  # width by height from which a plan stands above the strips instead of beside them
KEYS = (
    "Space plays; ← → go a second, with Shift ten; Home, End; + − 0 zoom; < > change the speed; "
    "/ filters the objects. Drag the plan to move it, Ctrl and the wheel zoom."
)


def report_page(material: Material, zone: tzinfo = UTC, robot_radius: float | None = None) -> str:
    """The page of one result; dates by the clock of ``zone``."""
    latest = latest_states(
        material.estimates, material.truth or (), material.lost, material.symmetry
    )
    verdicts = judged(latest, material.symmetry)
    items = list(material.building.objects.values())
    shapes = [shape_of(item, material.laser_height) for item in items]
    body = "".join(
        [
            _head(material, zone),
            _facts(material, latest, verdicts),
            warnings_list([text(each) for each in warnings(material, latest)]),
            _workbench(material, latest, verdicts, items, shapes, robot_radius),
            _events(material),
            _candidates(material),
            accuracy(material, latest),
            provenance(material.summary),
        ]
    )
    return whole_page(f"objstate: {material.folder.name}", body, _moving(material, items, shapes))


def _candidates(material: Material) -> str:
    if not material.candidates:
        return ""
    explained = (
        "Obstacles that stayed in place, with the probability of being an object rather than a "
        "person who waits. The outline is dashed on the plan. objstate world adopt keeps it under "
        "a name."
    )
    return section(
        "Not in the building",
        element("p", text(explained)),
        candidates_table(material.candidates, material.begin_ns),
        name="candidates",
    )


def _head(material: Material, zone: tzinfo) -> str:
    logs = ", ".join(log["path"].rpartition("/")[2] for log in material.summary["inputs"]["logs"])
    said = f"{logs}, {moment(material.begin_ns, zone)}, {span(material.duration)}"
    return page_head(material.folder.name, said)


def _facts(material: Material, latest: Sequence[LatestState], verdicts: Sequence[Judged]) -> str:
    observed = {state.estimate.object for state in latest if state.estimate.observed}
    course = material.course
    facts = [
        fact(share_text(course.localized), "of the time localized", weak(course.localized)),
        fact(f"{course.driven:.0f} m", "driven while localized" if material.lost else "driven"),
        *(
            [fact(f"{len(observed)} of {len(material.building.objects)}", "objects observed")]
            if material.building.objects
            else []
        ),
        *headline(tallied((each.state.estimate.object, each) for each in verdicts)),
    ]
    return element("div", *facts, class_="facts")


def share_text(share: float) -> str:
    """A share in whole percents; 0 and 100 only for none and all."""
    if 0.0 < share < 1.0:
        return f"{min(max(share, 0.01), 0.99):.0%}"
    return f"{share:.0%}"


def _workbench(
    material: Material,
    latest: Sequence[LatestState],
    verdicts: Sequence[Judged],
    items: Sequence[MovableObject],
    shapes: list[Shape],
    robot_radius: float | None,
) -> str:
    """The plan, and beside or below it the objects' states and what was believed of them."""
    drawing = draw_plan(
        material.building,
        shapes,
        material.course,
        material.laser_height,
        material.true_path,
        robot_radius,
        _reached(material, items),
        candidate_outlines(material.candidates),
    )
    numbers = {item.name: index for index, item in enumerate(items)}
    shape = "wide-plan" if _is_wide(drawing) else ""
    return element(
        "div",
        element(
            "section",
            element("div", drawing, element("p", id="hidden"), class_="viewport figure",
                    data_name="plan"),
            _controls(material),
            _legend(material),
            class_="stage",
        ),
        element(
            "div",
            section("Objects", states_table(material, latest, verdicts, numbers), name="objects"),
            _histories(material, items),
            class_="side",
        )
        if latest
        else "",
        class_=f"workbench {shape if latest else 'bare'}".strip(),
    )  # fmt: skip


def _reached(material: Material, items: Sequence[MovableObject]) -> FloatArray:
    """(n, 2) m, corners of wherever furniture was believed to stand."""
    import polars as pl

    found = [np.zeros((0, 2))]
    for item in items:
        if item.kind is not Kind.PLANAR:
            continue
        own = material.looks.filter(pl.col("object") == item.name)
        radius = float(np.hypot(*item.upright_mesh.vertices[:, :2].T).max(initial=0.0))
        x, y = (own.filter(pl.col("coordinate") == c)["median"].to_numpy() for c in "xy")
        if len(x) and len(y):
            low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
            found.append(np.stack([low - radius, high + radius]))
    return np.concatenate(found)


def _is_wide(drawing: str) -> bool:
    return float(drawing.partition("--aspect:")[2].partition('"')[0]) > WIDE


def _controls(material: Material) -> str:
    last = int(10 * material.duration)
    slider = (
        f'<input type="range" id="time" min="0" max="{last}" value="{last}" '
        'aria-label="seconds of the log, in tenths">'
    )
    usual = min(SPEEDS, key=lambda speed: abs(speed - material.duration / PLAYED_IN))
    speeds = (
        element("option", f"{speed}×", value=speed, selected="" if speed == usual else None)
        for speed in SPEEDS
    )
    lost = (
        element("i", style=f"left:{100 * a:.2f}%;width:{max(100 * (b - a), 0.3):.2f}%")
        for a, b in _shares(material)
    )
    return element(
        "div",
        element("button", "play", id="play", type="button", title="space"),
        element("select", *speeds, id="speed", aria_label="speed of playing", title="speed: < >"),
        element("div", slider, element("div", *lost, class_="track"), class_="slider"),
        element("output", id="clock", for_="time"),
        element("span", plan_buttons(), class_="zoom"),
        element(
            "button", "follow", id="follow", type="button", aria_pressed="true",
            title="keep the robot in view when zoomed in",
        ),
        class_="controls",
    )  # fmt: skip


def _shares(material: Material) -> list[tuple[float, float]]:
    """When the robot was lost, as shares of the log."""
    whole = max(1e9 * material.duration, 1.0)
    begin = material.begin_ns
    return [
        (max(0.0, (a - begin) / whole), min(1.0, (b - begin) / whole)) for a, b in material.lost
    ]


def _entry(kind: str, label: str) -> str:
    """A line of the legend; layers of it can be switched off and on."""
    shown = element("i", class_=kind), text(label)
    if kind not in LAYERS:
        return element("span", *shown)
    switch = f'<input type="checkbox" checked data-layer="{kind}">'
    return element("span", element("label", switch, *shown))


def _legend(material: Material) -> str:
    left_out = set() if material.truth or material.true_path else set(WITH_TRUTH)
    left_out |= set() if material.scans is not None and len(material.scans) else {"scan"}
    left_out |= set() if len(material.clutter) else {"clutter"}
    left_out |= set() if material.lost else {"way lost"}
    left_out |= set() if material.building.objects else {"leaf", "faded", "interval", "wrong"}
    entries = (_entry(kind, label) for kind, label in LEGEND if kind not in left_out)
    return element("p", *entries, class_="legend") + element("p", text(KEYS), class_="keys")


def _histories(material: Material, items: Sequence[MovableObject]) -> str:
    """A card for each object that the robot was near to, with a strip for each coordinate."""
    axis = Axis(material.begin_ns, material.duration)
    courses = true_courses(material.truth or ())
    near = set(material.estimates["object"])
    ordered = sorted(enumerate(items), key=lambda pair: natural_key(pair[1].name))
    cards = [
        _card(material, item, index, courses, axis) for index, item in ordered if item.name in near
    ]
    explained = (
        "The stronger the blue, the more probable the state; paler where no scan was near. The "
        "line is the median, the orange edges are the 90 % interval, the marks below the moments at "
        "which a beam reached the object. Hatched: the robot was lost. Touch a strip to see its "
        "moment on the plan."
    )
    return section(
        "What was believed, over time",
        element("p", text(explained)),
        element("div", *cards, class_="cards"),
        name="histories",
    )


def _card(
    material: Material,
    item: MovableObject,
    index: int,
    courses: dict[Coordinate, TrueCourse],
    axis: Axis,
) -> str:
    import polars as pl

    events = [event for event in material.events if event.object == item.name]
    strips = []
    for coordinate in item.coordinates:
        rows = (pl.col("object") == item.name) & (pl.col("coordinate") == coordinate)
        strips.append(
            strip(
                coordinate,
                material.posteriors.filter(rows),
                material.looks.filter(rows),
                courses.get((item.name, coordinate)),
                axis,
                coordinate if len(item.coordinates) > 1 else "",
                material.lost,
                [each.stretch for each in events if each.coordinate == coordinate],
            )
        )
    return element(
        "article",
        element("h3", element("span", text(item.name)), element("output", data_object=index)),
        *strips,
        time_axis(axis),
        data_object=index,
        class_="figure",
        data_name=item.name,
    )


def _events(material: Material) -> str:
    if not material.events:
        return ""
    table = events_table(material.events, material.begin_ns)
    return section("What was moved", table)


def _moving(
    material: Material, items: Sequence[MovableObject], shapes: Sequence[Shape]
) -> dict[str, Any]:
    """What the page's script needs to draw any moment."""
    begin, looks = material.begin_ns, material.looks
    step = step_for(looks)
    truth = true_values(material.truth or (), begin)
    data: dict[str, Any] = {
        "duration": round(material.duration, 1),
        "lost": stretches(material.lost, begin),
        "searching": material.course.searching,
        "robot": robot_moments(material.path, begin),
        "objects": [
            {
                "name": item.name,
                "motion": shape.motion,
                "coordinates": item.coordinates,
                "home": item.home.round(4).tolist(),
                "order": material.symmetry.get(item.name, 1),
                "truth": truth.get(item.name, {}),
                **object_moments(looks, begin, item.name, item.coordinates, step),
            }
            for item, shape in zip(items, shapes, strict=True)
        ],
    }
    if material.true_path is not None:
        data["trueRobot"] = robot_moments(material.true_path, begin)
    if material.scans is not None and len(material.scans):
        data["scans"] = scan_moments(material.scans, material.path, begin)
    if len(material.clutter):
        data["clutter"] = clutter_moments(material.clutter, begin)
    return data
