"""One result as one HTML page that needs neither a server nor a network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from objstate.building.model import MovableObject
from objstate.evaluation import LatestState, latest_states
from objstate.evaluation.states import Coordinate, TrueCourse, true_courses
from objstate.report.accuracy import accuracy
from objstate.report.markup import element, table, text
from objstate.report.material import Material
from objstate.report.plan import Shape, draw_plan, shape_of
from objstate.report.settings import provenance
from objstate.report.strips import Axis, strip, time_axis
from objstate.report.timeline import object_moments, robot_moments, step_for, true_values
from objstate.report.words import figure, moment, span, warnings

LEGEND = (
    ("leaf", "estimate"),
    ("faded", "last believed, not near now"),
    ("interval", "90 % interval"),
    ("truth", "truth"),
    ("way", "robot's path"),
)


def report_page(material: Material) -> str:
    """The page of one result."""
    latest = latest_states(material.estimates, material.truth or (), material.lost)
    items = list(material.building.objects.values())
    shapes = [shape_of(item, material.laser_height) for item in items]
    body = "".join(
        [
            _head(material),
            _facts(material, latest),
            _warnings(warnings(material, latest)),
            _plan(material, shapes),
            _states(material, latest),
            _histories(material, items),
            accuracy(material, latest),
            provenance(material.summary),
        ]
    )
    return whole_page(f"objstate: {material.folder.name}", body, _moving(material, items, shapes))


def whole_page(title: str, body: str, data: dict[str, Any] | None = None) -> str:
    """A page around ``body``, with style and script in it; ``data`` is what its plan moves by."""
    scripts = element("script", _asset("page.js"))
    if data is not None:
        written = json.dumps(data, separators=(",", ":"), ensure_ascii=False).replace(
            "<", "\\u003c"
        )
        scripts += element("script", written, type="application/json", id="data")
        scripts += element("script", _asset("report.js"))
    head = (
        '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        + element("title", text(title))
        + element("style", _asset("report.css"))
    )
    page = element("head", head) + element("body", element("main", body), scripts)
    return f'<!doctype html>\n<html lang="en">{page}</html>\n'


def _asset(name: str) -> str:
    return files("objstate.report").joinpath("assets", name).read_text(encoding="utf-8")


def _head(material: Material) -> str:
    logs = ", ".join(log["path"].rpartition("/")[2] for log in material.summary["inputs"]["logs"])
    said = f"{logs}, {moment(material.begin_ns)}, {span(material.duration)}"
    return element(
        "header",
        element("div", element("h1", text(material.folder.name)), element("p", text(said))),
        element("button", "light / dark", id="theme", type="button"),
    )


def _facts(material: Material, latest: Sequence[LatestState]) -> str:
    observed = {state.estimate.object for state in latest if state.estimate.observed}
    steps = np.diff(material.path.poses[:, :2], axis=0)
    facts = [
        (str(len(material.summary["objects"])), "objects"),
        (str(len(observed)), "observed"),
        (f"{np.hypot(*steps.T).sum():.0f} m", "driven"),
        (f"{len(material.estimates):,}".replace(",", " "), "estimates"),
    ]
    known = [state for state in latest if state.error is not None and state.estimate.observed]
    for kind, coordinates in (("angle", ("angle", "yaw")), ("place", ("offset", "x", "y"))):
        errors = [abs(s.error or 0.0) for s in known if s.estimate.coordinate in coordinates]
        if errors:
            shown = figure(coordinates[0], float(np.median(errors)))
            facts.append((shown, f"median last error of {kind}s"))
    cells = (element("div", element("b", text(value)), text(label)) for value, label in facts)
    return element("div", *cells, class_="facts")


def _warnings(told: Sequence[str]) -> str:
    if not told:
        return element("section", element("h2", "Warnings"), element("p", "None."))
    entries = (element("li", text(each)) for each in told)
    return element("section", element("h2", "Warnings"), element("ul", *entries, class_="warnings"))


def _plan(material: Material, shapes: list[Shape]) -> str:
    drawing = draw_plan(material.building, shapes, material.path, material.laser_height)
    legend = (
        element("span", element("i", class_=kind), text(label))
        for kind, label in LEGEND
        if kind != "truth" or material.truth is not None
    )
    slider = (
        f'<input type="range" id="time" min="0" max="{int(10 * material.duration)}" '
        f'value="{int(10 * material.duration)}" aria-label="seconds of the log, in tenths">'
    )
    return element(
        "section",
        element("h2", "Plan"),
        element("div", drawing, class_="viewport", id="viewport"),
        element(
            "div",
            element("button", "play", id="play", type="button"),
            slider,
            element("output", id="clock", for_="time"),
            element("button", "−", id="smaller", type="button", aria_label="zoom out"),
            element("button", "+", id="larger", type="button", aria_label="zoom in"),
            class_="controls",
        ),
        element("p", *legend, class_="legend"),
    )


def _states(material: Material, latest: Sequence[LatestState]) -> str:
    with_truth = material.truth is not None
    truth = ("truth", "error") if with_truth else ()
    headings = ("object", "state", "estimate", "90 % interval", "last seen", *truth)
    rows = [_state_cells(material, state, with_truth) for state in latest]
    return element("section", element("h2", "Last states"), table(headings, rows))


def _state_cells(material: Material, state: LatestState, with_truth: bool) -> list[str]:
    estimate = state.estimate
    kind = estimate.coordinate
    seen = (
        f"{(estimate.stamp_ns - material.begin_ns) / 1e9:.0f} s" if estimate.observed else "never"
    )
    cells = [
        estimate.object,
        kind,
        figure(kind, estimate.mean),
        f"{figure(kind, estimate.lower)} to {figure(kind, estimate.upper)}",
        seen,
    ]
    if with_truth:
        cells += [figure(kind, state.truth), figure(kind, state.error)]
    return [text(cell) for cell in cells]


def _histories(material: Material, items: Sequence[MovableObject]) -> str:
    """A card for each object that the robot was near to, with a strip for each coordinate."""
    axis = Axis(material.begin_ns, material.duration)
    courses = true_courses(material.truth or ())
    near = set(material.estimates["object"])
    cards = [
        _card(material, item, index, courses, axis)
        for index, item in enumerate(items)
        if item.name in near
    ]
    explained = (
        "The stronger the colour, the more probable the state; pale where no scan was near. The "
        "line is the mean, the marks below are the moments at which a beam bore on the object; while "
        "the robot was lost the strip is hatched. "
        "Touch a strip to see its moment on the plan."
    )
    return element(
        "section",
        element("h2", "What was believed, over time"),
        element("p", text(explained)),
        element("div", *cards, class_="cards"),
    )


def _card(
    material: Material,
    item: MovableObject,
    index: int,
    courses: dict[Coordinate, TrueCourse],
    axis: Axis,
) -> str:
    import polars as pl

    strips = []
    for coordinate in item.coordinates:
        rows = (pl.col("object") == item.name) & (pl.col("coordinate") == coordinate)
        strips.append(
            strip(
                coordinate,
                material.posteriors.filter(rows),
                material.estimates.filter(rows),
                courses.get((item.name, coordinate)),
                axis,
                coordinate if len(item.coordinates) > 1 else "",
                material.lost,
            )
        )
    return element(
        "article",
        element("h3", text(item.name), element("output", data_object=index)),
        *strips,
        time_axis(axis),
    )


def _moving(
    material: Material, items: Sequence[MovableObject], shapes: Sequence[Shape]
) -> dict[str, Any]:
    """What the page's script needs to draw any moment."""
    step = step_for(material.estimates)
    truth = true_values(material.truth or (), material.begin_ns)
    return {
        "duration": round(material.duration, 1),
        "robot": robot_moments(material.path, material.begin_ns),
        "objects": [
            {
                "name": item.name,
                "motion": shape.motion,
                "coordinates": item.coordinates,
                "home": item.home.round(4).tolist(),
                "truth": truth.get(item.name, {}),
                **object_moments(
                    material.estimates, material.begin_ns, item.name, item.coordinates, step
                ),
            }
            for item, shape in zip(items, shapes, strict=True)
        ],
    }
