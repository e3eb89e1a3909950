"""A Foxglove layout: the building, one object's posterior over time, and all objects.

A layout is JSON: ``configById`` holds the settings of each panel by TYPE!NAME, and
``layout`` halves the window into panels again and again.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

import numpy as np

from objstate.building.model import Building

SCENE_PANEL, PLOT, TABLE, SUMMARY = (
    "3D!scene",
    "Plot!object",
    "Table!objects",
    "DiagnosticSummary!objects",
)
LINES = {  # of the plot, by the field of ObjectState
    "upper": "#c98a1b",
    "median": "#c8553d",
    "lower": "#c98a1b",
    "truth": "#0b7a75",
}
VIEW = 1.1  # of the building's larger side, the camera's distance
LEAST_VIEW = 5.0  # m


def layout_json(building: Building, topics: Collection[str], states: str, diagnostics: str) -> str:
    """The layout of a scene with ``topics``; the two others hold states in numbers and words."""
    configs = {
        SCENE_PANEL: _scene(building, sorted(topics)),
        PLOT: _plot(states),
        TABLE: {"topicPath": f"{states}.states"},
        SUMMARY: {
            "topicToRender": diagnostics,
            "minLevel": 0,
            "pinnedIds": [],
            "hardwareIdFilter": "",
            "sortByLevel": True,
        },
    }
    beside = _halves("column", PLOT, _halves("column", TABLE, SUMMARY, 50), 40)
    layout = {
        "configById": configs,
        "globalVariables": _first_object(building),
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _halves("row", SCENE_PANEL, beside, 60),
    }
    return json.dumps(layout, indent=2) + "\n"


def _halves(direction: str, first: Any, second: Any, percent: int) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percent}


def _first_object(building: Building) -> dict[str, str]:
    """The variables that say what the plot shows."""
    for name, item in building.objects.items():
        return {"object": name, "coordinate": item.coordinates[0]}
    return {}


def _plot(states: str) -> dict[str, Any]:
    chosen = f"{states}.states[:]{{name==$object}}{{coordinate==$coordinate}}"
    return {
        "title": "$object: mean, 90 % interval, truth",
        "paths": [
            {
                "value": f"{chosen}.{field}",
                "label": field,
                "color": colour,
                "enabled": True,
                "timestampMethod": "receiveTime",
            }
            for field, colour in LINES.items()
        ],
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def _scene(building: Building, topics: list[str]) -> dict[str, Any]:
    """The building from above."""
    vertices = building.walls.vertices[:, :2] if len(building.walls.vertices) else np.zeros((1, 2))
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    middle = (lower + upper) / 2
    points = {"colorField": "rgb", "colorMode": "rgb", "pointSize": 4}
    return {
        "cameraState": {
            "perspective": False,
            "distance": max(VIEW * float((upper - lower).max()), LEAST_VIEW),
            "phi": 0,
            "thetaOffset": 0,
            "target": [0, 0, 0],
            "targetOffset": [round(float(middle[0]), 2), round(float(middle[1]), 2), 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.5,
            "far": 5000,
        },
        "followMode": "follow-none",
        "followTf": "map",
        "scene": {},
        "transforms": {},
        "topics": {
            topic: {"visible": True, **(points if topic.startswith("/beams/") else {})}
            for topic in topics
        },
        "layers": {},
        "publish": {},
        "imageMode": {},
    }
