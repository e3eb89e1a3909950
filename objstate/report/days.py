"""The logs of a batch by the day."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime, tzinfo
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.units import UNITS
from objstate.report.course import weak
from objstate.report.document import section
from objstate.report.judgement import tolerances
from objstate.report.markup import Cell, element, table, text
from objstate.report.page import share_text
from objstate.report.reading import figure, span

if TYPE_CHECKING:
    from objstate.report.batch_material import BatchMaterial, Line

MOST_DAYS = 400  # the latest ones
EXPLAINED = (
    "The latest first. Errors are means of the last states of each log whose truth is known."
)


def days(material: BatchMaterial, zone: tzinfo) -> str:
    """A row for each day on which logs begin; nothing of a single day."""
    by_day = [
        (day, list(lines))
        for day, lines in groupby(material.lines, lambda line: day_of(line.begin_ns, zone))
    ]
    if len(by_day) < 2:
        return ""
    errors = {
        kind: dict(material.summary.select("log", f"{kind}_error").drop_nulls().iter_rows())
        for kind in UNITS
    }
    kinds = [kind for kind, known in errors.items() if known]
    headings = ("day", "logs", "lasting", "localized", *(f"{kind} error" for kind in kinds))
    latest = sorted(by_day, key=lambda each: each[0], reverse=True)[:MOST_DAYS]
    rows = [
        [*_of_day(day, lines), *(_error(kind, lines, errors[kind]) for kind in kinds)]
        for day, lines in latest
    ]
    return section("By day", element("p", text(EXPLAINED)), table(headings, rows, "sortable"))


def day_of(stamp_ns: int, zone: tzinfo) -> date:
    """The day of a stamp, by the clock of a zone."""
    return datetime.fromtimestamp(stamp_ns / 1e9, zone).date()


def _of_day(day: date, lines: Sequence[Line]) -> list[str | Cell]:
    seconds = sum(line.seconds for line in lines)
    share = sum(line.localized * line.seconds for line in lines) / max(seconds, 1e-9)
    return [
        text(f"{day:%Y-%m-%d %a}"),
        str(len(lines)),
        Cell(span(seconds), seconds),
        Cell(share_text(share), round(share, 5), weak(share) or None),
    ]


def _error(kind: str, lines: Sequence[Line], known: dict[str, float]) -> Cell:
    found = [known[line.log.name] for line in lines if line.log.name in known]
    if not found:
        return Cell("–")
    mean = float(np.mean(found))
    return Cell(figure(kind, mean), round(mean, 6), "wrong" if mean > tolerances(kind)[1] else None)
