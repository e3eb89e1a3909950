"""A building over many logs: every object wherever it stood, and all paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.geometry import FloatArray
from objstate.report.batch_part import DoneLog
from objstate.report.markup import element, polyline
from objstate.report.plan import Shape, covered, framed, placement, plan_buttons, shape_of

MOST_POSES = 20_000  # of all paths together
LEAST_OPACITY = 0.1  # of one of many states


def draw_states(building: Building, logs: Sequence[DoneLog], number: int = 0) -> str:
    """The plan with the last observed state of each object in each log, overlaid.

    ``number`` distinguishes the plans of one page.
    """
    height = min(log.laser_height for log in logs)
    shapes = [shape_of(item, height) for item in building.objects.values()]
    step = max(1, -(-sum(len(log.course.path.poses) for log in logs) // MOST_POSES))
    drawn = [
        element("path", d="".join(polyline(piece[::step]) for piece in pieces), class_=kind)
        for kind, pieces in (
            ("way", [piece for log in logs for piece in log.course.known]),
            ("way lost", [piece for log in logs for piece in log.course.doubtful]),
        )
        if pieces
    ]
    shown = [log.course.drawn for log in logs]
    for index, shape in enumerate(shapes):
        states = last_states(logs, shape.name, building[shape.name].coordinates)
        hull = "".join(polyline(ring, closed=True) for ring in shape.hull)
        name = f"shape-{number}-{index}"
        opacity = max(LEAST_OPACITY, 1.0 / max(1, len(states)) ** 0.5)
        shown += [_corners(shape, building[shape.name], state) for state in states]
        drawn.append(
            element(
                "g",
                element(
                    "defs",
                    element("path", d=hull, id=name, vector_effect="non-scaling-stroke"),
                ),
                *(
                    element("use", href=f"#{name}", transform=placement(shape.motion, state))
                    for state in states or [building[shape.name].home]
                ),
                class_="every object" if states else "every object unknown",
                data_object=index,
                style=f"stroke-opacity:{opacity:.2f}",
            )
        )
    drawing = framed(building, shapes, np.concatenate(shown), height, drawn)
    viewport = element("div", drawing, class_="viewport figure", data_name=f"plan-{number + 1}")
    controls = element("div", element("span", plan_buttons(), class_="zoom"), class_="controls")
    return element("div", viewport, controls, class_="stage")


def _corners(shape: Shape, item: MovableObject, state: FloatArray) -> FloatArray:
    """(n, 2) m of the floor, what furniture in a state covers; doors stay where they hang."""
    if shape.motion["kind"] != "free":
        return np.zeros((0, 2))
    return covered(item, state)


def last_states(
    logs: Sequence[DoneLog], name: str, coordinates: tuple[str, ...]
) -> list[FloatArray]:
    """The last state (d,) of an object in each log that observed it."""
    found = []
    for log in logs:
        values = {
            state.estimate.coordinate: state.estimate.value
            for state in log.latest
            if state.estimate.object == name and state.estimate.observed
        }
        if set(coordinates) <= values.keys():
            found.append(np.array([values[coordinate] for coordinate in coordinates]))
    return found
