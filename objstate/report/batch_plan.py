"""A building over many logs: every object wherever it stood, and all paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.building.model import Building
from objstate.geometry import FloatArray
from objstate.report.batch_material import DoneLog
from objstate.report.markup import element, polyline
from objstate.report.plan import framed, placement, shape_of

MOST_POSES = 200  # of each path
LEAST_OPACITY = 0.1  # of one of many states


def draw_states(building: Building, logs: Sequence[DoneLog], number: int = 0) -> str:
    """The plan with the last observed state of each object in each log, laid over one another.

    ``number`` tells the plans of one page apart.
    """
    height = min(log.laser_height for log in logs)
    shapes = [shape_of(item, height) for item in building.objects.values()]
    paths = [_thinned(log.path.poses[:, :2]) for log in logs]
    drawn = [element("path", d=polyline(path), class_="way") for path in paths]
    for index, shape in enumerate(shapes):
        states = last_states(logs, shape.name, building[shape.name].coordinates)
        hull = "".join(polyline(ring, closed=True) for ring in shape.hull)
        name = f"shape-{number}-{index}"
        opacity = max(LEAST_OPACITY, 1.0 / max(1, len(states)) ** 0.5)
        drawn.append(
            element(
                "g",
                element(
                    "defs",
                    element("path", d=hull, id=name, vector_effect="non-scaling-stroke"),
                ),
                *(
                    element("use", href=f"#{name}", transform=placement(shape.motion, state))
                    for state in states
                ),
                class_="every",
                style=f"stroke-opacity:{opacity:.2f}",
            )
        )
    drawing = framed(building, shapes, np.concatenate(paths), height, drawn)
    return element("div", drawing, class_="viewport")


def last_states(
    logs: Sequence[DoneLog], name: str, coordinates: tuple[str, ...]
) -> list[FloatArray]:
    """The last state (d,) of an object in each log that observed it."""
    found = []
    for log in logs:
        means = {
            state.estimate.coordinate: state.estimate.mean
            for state in log.latest
            if state.estimate.object == name and state.estimate.observed
        }
        if set(coordinates) <= means.keys():
            found.append(np.array([means[coordinate] for coordinate in coordinates]))
    return found


def _thinned(points: FloatArray) -> FloatArray:
    return points[:: -(-len(points) // MOST_POSES)]
