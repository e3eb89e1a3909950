"""Robots whose calibration drifts, by the odometry errors learnt from their logs."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from datetime import tzinfo
from typing import TYPE_CHECKING

import numpy as np

from objstate.order import natural_key
from objstate.report.document import section
from objstate.report.markup import Cell, element, table, text
from objstate.report.reading import moment
from objstate.statistics.change_points import Change, change_of_numbers

if TYPE_CHECKING:
    from objstate.report.batch_material import Line

TOLD = 0.5  # probability of a change from which on it is shown
EXPLAINED = (
    "By how much scans correct the odometry in proportion to the way: wheels that wear, a gyro "
    "that counts turns short, a laser that is knocked askew. Shown is what has probably changed "
    "once, each robot compared with itself; a manifest's column `robot` says whose log is whose."
)
MEASURES = (  # of Line.odometry: what is off, its unit, the factor to it
    ("metres driven", "%", 100.0),
    ("heading of the laser", "°", 180.0 / math.pi),
    ("turns", "%", 100.0),
)


def drift(lines: Sequence[Line], zone: tzinfo) -> str:
    """A row for each measure of a robot that has probably changed, the most probable first."""
    found = []
    for robot, own in by_robot(lines).items():
        for number, measure in enumerate(MEASURES):
            told = [line for line in own if math.isfinite(line.odometry[number])]
            change = change_of_numbers(np.array([line.odometry[number] for line in told]))
            if change is not None and change.probability > TOLD:
                found.append((robot, measure, change, told[change.place]))
    if not found:
        return ""
    found.sort(key=lambda each: (-each[2].probability, natural_key(each[0])))
    rows: list[list[str | Cell]] = [
        [
            text(robot or "all logs"),
            text(what),
            Cell(f"{change.probability:.0%}", round(change.probability, 6)),
            Cell(text(moment(line.begin_ns, zone)), line.begin_ns),
            text(line.log.name),
            _values(change, unit, factor),
        ]
        for robot, (what, unit, factor), change, line in found
    ]
    headings = ("robot", "odometry's", "probably changed", "with the log of", "", "off by")
    return section(
        "Robots that drift",
        element("p", text(EXPLAINED)),
        table(headings, rows, "sortable filterable"),
    )


def by_robot(lines: Sequence[Line]) -> dict[str, list[Line]]:
    """The logs of each robot, in order of time."""
    found: dict[str, list[Line]] = defaultdict(list)
    for line in lines:
        found[line.log.robot or ""].append(line)
    return found


def _values(change: Change, unit: str, factor: float) -> str:
    before, after = factor * change.before, factor * change.after
    return text(f"{before:z.2f} → {after:z.2f} {unit}")
