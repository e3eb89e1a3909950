"""A batch as one HTML page: its logs, its buildings over all of them, how doors are used."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from objstate.evaluation.summary import unit_of
from objstate.evaluation.units import UNITS
from objstate.recording.batches import Outcome, result_of
from objstate.report.accuracy import charts
from objstate.report.batch_material import BatchMaterial, DoneLog
from objstate.report.batch_plan import draw_states
from objstate.report.coverage import pooled
from objstate.report.markup import element, table, text
from objstate.report.page import whole_page
from objstate.report.usage import usage
from objstate.report.words import moment, span
from objstate.statistics import DoorStatistics

EXPLAINED = (
    "Every object where it last stood in each log, the stronger the more often, and all paths."
)


def batch_page(
    material: BatchMaterial, doors: Sequence[DoorStatistics], page: Path, report: str
) -> str:
    """The page of a batch, to stand at ``page``; logs' own pages are called ``report``."""
    body = "".join(
        [
            _head(material),
            _facts(material),
            _troubles(material),
            *_plans(material),
            _section("How doors are used", usage(doors)) if doors else "",
            _logs(material, page, report),
            _accuracy(material),
        ]
    )
    return whole_page(f"objstate: {material.folder.name}", body)


def _section(title: str, *content: str) -> str:
    return element("section", element("h2", text(title)), *content)


def _head(material: BatchMaterial) -> str:
    begins = [log.begin_ns for log in material.done]
    said = f"{moment(min(begins))} to {moment(max(begins))}" if begins else "No log is done."
    return element(
        "header",
        element("div", element("h1", text(material.folder.name)), element("p", text(said))),
        element("button", "light / dark", id="theme", type="button"),
    )


def _facts(material: BatchMaterial) -> str:
    rows = list(material.rows.values())
    seconds = sum(row["log_seconds"] or 0.0 for row in rows)
    facts = [
        (len(material.outcomes), "logs"),
        (len(material.done), "done"),
        (len(material.outcomes) - len(material.done), "not done"),
        (span(seconds), "of log"),
        (sum(row["estimates"] or 0 for row in rows), "estimates"),
    ]
    cells = (element("div", element("b", text(value)), text(label)) for value, label in facts)
    return element("div", *cells, class_="facts")


def _troubles(material: BatchMaterial) -> str:
    told = [_trouble(each) for each in material.outcomes if each.status != "done"]
    told += [text(doubt) for doubt in material.doubts]
    if not told:
        return ""
    entries = (element("li", each) for each in told)
    return _section("Warnings", element("ul", *entries, class_="warnings"))


def _trouble(outcome: Outcome) -> str:
    reason = f": {outcome.reason}" if outcome.reason else ""
    return text(f"{outcome.name} {outcome.status}{reason}")


def _plans(material: BatchMaterial) -> Iterator[str]:
    """A plan for each building that some log was made in."""
    for number, (address, building) in enumerate(material.buildings.items()):
        logs = [log for log in material.done if log.log.building == address]
        title = f"{building.name}, over {len(logs)} logs"
        yield _section(title, element("p", text(EXPLAINED)), draw_states(building, logs, number))


def _logs(material: BatchMaterial, page: Path, report: str) -> str:
    kinds = [
        kind
        for kind in UNITS
        if any(row[f"{kind}_error"] is not None for row in material.rows.values())
    ]
    begins = {log.log.name: log.begin_ns for log in material.done}
    rows = []
    for outcome in material.outcomes:
        own = result_of(material.folder, outcome.name) / report
        link = os.path.relpath(own, page.absolute().parent) if own.is_file() else None
        row = material.rows.get(outcome.name, {})
        rows.append(_log_cells(outcome, row, begins.get(outcome.name), kinds, link))
    errors = (f"{kind} error ({'deg' if unit_of(kind) == 'rad' else 'cm'})" for kind in kinds)
    inside = ("in 90 %",) if kinds else ()
    headings = ("log", "status", "begins", "lasts", "objects seen", "lost", "warnings", *errors)
    return _section("Logs", table((*headings, *inside), rows))


def _log_cells(
    outcome: Outcome,
    row: dict[str, Any],
    begin_ns: int | None,
    kinds: Sequence[str],
    link: str | None,
) -> list[str]:
    name = text(outcome.name)
    done = outcome.status == "done"
    lost = row.get("lost_seconds") or 0.0
    warnings = row.get("warnings") or []
    cells = [
        name if link is None else element("a", name, href=link),
        text(outcome.status) if done else element("span", text(outcome.status), class_="failed"),
        moment(begin_ns) if begin_ns is not None else "–",
        span(row["log_seconds"]) if done else "–",
        text(row.get("objects_observed") if done else "–"),
        f"{lost:.0f} s" if lost else "–",
        element("span", text(len(warnings)), title="\n".join(warnings)) if warnings else "–",
    ]
    cells += [_error(kind, row.get(f"{kind}_error")) for kind in kinds]
    return [*cells, _covered(row, kinds)] if kinds else cells


def _error(kind: str, value: float | None) -> str:
    if value is None:
        return "–"
    return f"{np.degrees(value) if unit_of(kind) == 'rad' else 100.0 * value:.2f}"


def _covered(row: dict[str, Any], kinds: Sequence[str]) -> str:
    """The share of last estimates whose interval holds the truth, over all coordinates."""
    parts = [(row.get(f"{kind}_count") or 0, row.get(f"{kind}_coverage") or 0.0) for kind in kinds]
    count = sum(number for number, _ in parts)
    return f"{sum(number * share for number, share in parts) / count:.0%}" if count else "–"


def _accuracy(material: BatchMaterial) -> str:
    logs: Sequence[DoneLog] = material.done
    found = pooled(part for log in logs for part in log.coverages)
    if not any(part.count for part in found):
        return ""
    return _section("Beside the truth, over all logs", charts(found))
