"""A batch as one HTML page: its logs, its buildings over all of them, how doors are used."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from datetime import UTC, tzinfo
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from objstate.evaluation.summary import unit_of
from objstate.evaluation.units import UNITS
from objstate.order import natural_key
from objstate.recording.batches import Outcome, result_of
from objstate.report.accuracy import charts
from objstate.report.batch_material import BatchMaterial, DoneLog
from objstate.report.batch_plan import draw_states
from objstate.report.coverage import pooled
from objstate.report.document import page_head, section, warnings_list, whole_page
from objstate.report.judgement import Judged, fact, headline
from objstate.report.markup import Cell, Row, element, table, text
from objstate.report.page import LOCALIZED_WELL, share_text
from objstate.report.reading import figure, moment, span
from objstate.report.usage import usage
from objstate.statistics import DoorStatistics

EXPLAINED = (
    "Every object where it last stood in each log, the stronger the more often, and all paths; dashed "
    "where no log observed it."
)
OBJECTS_EXPLAINED = (
    "The last states of each object in all logs whose truth is known, the worst first."
)
OBJECT_HEADINGS = ("object", "state", "logs", "worst", "in log", "median", "in 90 %")


def batch_page(
    material: BatchMaterial,
    doors: Sequence[DoorStatistics],
    page: Path,
    report: str,
    zone: tzinfo = UTC,
) -> str:
    """The page of a batch, to stand at ``page``; logs' own pages are called ``report``."""
    body = "".join(
        [
            _head(material, zone),
            _facts(material),
            warnings_list(_troubles(material)),
            _logs(material, page, report, zone),
            _objects(material),
            *_plans(material),
            section("How doors are used", usage(doors, str(zone))) if doors else "",
            _accuracy(material),
        ]
    )
    return whole_page(f"objstate: {material.folder.name}", body)


def _head(material: BatchMaterial, zone: tzinfo) -> str:
    begins = [log.begin_ns for log in material.done]
    said = "No log is done."
    if begins:
        said = f"{moment(min(begins), zone)} to {moment(max(begins), zone)}"
    return page_head(material.folder.name, said)


def _facts(material: BatchMaterial) -> str:
    rows = list(material.rows.values())
    seconds = sum(row["log_seconds"] or 0.0 for row in rows)
    count, done = len(material.outcomes), len(material.done)
    facts = [fact(f"{done} of {count}", "logs done", "" if done == count else "wrong")]
    facts.append(fact(span(seconds), "of log"))
    if material.done:
        known = sum(log.course.localized * log.course.seconds for log in material.done)
        share = known / max(sum(log.course.seconds for log in material.done), 1e-9)
        facts.append(fact(share_text(share), "of the time localized", _weak(share)))
    states = [
        (f"{each.state.estimate.object} in {log.log.name}", each)
        for log in material.done
        for each in log.verdicts
    ]
    return element("div", *facts, *headline(states), class_="facts")


def _weak(share: float) -> str:
    return "" if share >= LOCALIZED_WELL else "wrong"


def _troubles(material: BatchMaterial) -> list[str]:
    told = [_trouble(each) for each in material.outcomes if each.status != "done"]
    return told + [text(doubt) for doubt in material.doubts]


def _trouble(outcome: Outcome) -> str:
    reason = f": {outcome.reason}" if outcome.reason else ""
    return text(f"{outcome.name} {outcome.status}{reason}")


def _plans(material: BatchMaterial) -> Iterator[str]:
    """A plan for each building that some log was made in."""
    for number, (address, building) in enumerate(material.buildings.items()):
        logs = [log for log in material.done if log.log.building == address]
        if not logs:
            continue
        title = f"{building.name}, over {len(logs)} {'log' if len(logs) == 1 else 'logs'}"
        yield section(title, element("p", text(EXPLAINED)), draw_states(building, logs, number))


def _logs(material: BatchMaterial, page: Path, report: str, zone: tzinfo) -> str:
    kinds = [
        kind
        for kind in UNITS
        if any(row[f"{kind}_error"] is not None for row in material.rows.values())
    ]
    done = {log.log.name: log for log in material.done}
    rows = []
    for outcome in sorted(material.outcomes, key=lambda each: _rank(each, done.get(each.name))):
        own = result_of(material.folder, outcome.name) / report
        link = os.path.relpath(own, page.absolute().parent) if own.is_file() else None
        row = material.rows.get(outcome.name, {})
        rows.append(_log_row(outcome, row, done.get(outcome.name), kinds, link, zone))
    errors = (f"{kind} error ({'deg' if unit_of(kind) == 'rad' else 'cm'})" for kind in kinds)
    judged = ("worst", *errors, "in 90 %") if kinds else ()
    headings = ("log", "status", "begins", "lasts", "objects seen", "localized", "warnings")
    return section("Logs", table((*headings, *judged), rows, "sortable filterable"))


def _rank(
    outcome: Outcome, log: DoneLog | None
) -> tuple[bool, float, int, float, tuple[object, ...]]:
    """The worst first: logs that aren't done, then those lost for long, then the wrong ones."""
    if log is None:
        return (False, 0.0, 0, 0.0, natural_key(outcome.name))
    weak = 0.0 if log.course.localized >= LOCALIZED_WELL else log.course.localized - 1.0
    worst = _worst(log.verdicts)
    severity, badness = worst.rank if worst else (0, 0.0)
    return (True, weak, -severity, -badness, natural_key(outcome.name))


def _worst(verdicts: Sequence[Judged]) -> Judged | None:
    return max(verdicts, key=lambda each: each.rank, default=None)


def _log_row(
    outcome: Outcome,
    row: dict[str, Any],
    log: DoneLog | None,
    kinds: Sequence[str],
    link: str | None,
    zone: tzinfo,
) -> Row:
    name = text(outcome.name)
    done = outcome.status == "done" and log is not None
    warnings = row.get("warnings") or []
    told = element("span", text(len(warnings)), title="\n".join(warnings)) if warnings else "–"
    cells: list[str | Cell] = [
        name if link is None else element("a", name, href=quote(link)),
        Cell(text(outcome.status), class_=None if done else "wrong"),
        Cell(moment(log.begin_ns, zone) if log else "–", log.begin_ns if log else None),
        Cell(span(row["log_seconds"]) if done else "–", row.get("log_seconds")),
        text(row.get("objects_observed") if done else "–"),
        _localized(log),
        Cell(told, len(warnings)),
    ]
    if kinds:
        cells.append(_worst_cell(log))
        cells += [_error(kind, row.get(f"{kind}_error")) for kind in kinds]
        cells.append(_covered(row, kinds))
    return Row(cells)


def _localized(log: DoneLog | None) -> Cell:
    if log is None:
        return Cell("–")
    share = log.course.localized
    return Cell(share_text(share), round(share, 5), _weak(share) or None)


def _worst_cell(log: DoneLog | None) -> Cell:
    worst = _worst(log.verdicts) if log else None
    if worst is None:
        return Cell("–")
    estimate = worst.state.estimate
    said = f"{figure(estimate.coordinate, worst.error)} {estimate.object}"
    return Cell(text(said), round(worst.badness, 5), worst.verdict)


def _error(kind: str, value: float | None) -> str:
    if value is None:
        return "–"
    return f"{np.degrees(value) if unit_of(kind) == 'rad' else 100.0 * value:.2f}"


def _covered(row: dict[str, Any], kinds: Sequence[str]) -> str:
    """The share of last estimates whose interval holds the truth, over all coordinates."""
    parts = [(row.get(f"{kind}_count") or 0, row.get(f"{kind}_coverage") or 0.0) for kind in kinds]
    count = sum(number for number, _ in parts)
    return f"{sum(number * share for number, share in parts) / count:.0%}" if count else "–"


def _objects(material: BatchMaterial) -> str:
    """A row for each coordinate of each object: its last states in all logs, judged."""
    found: dict[tuple[str, str, str], list[tuple[str, Judged]]] = {}
    for log in material.done:
        for each in log.verdicts:
            estimate = each.state.estimate
            key = (log.log.building, estimate.object, estimate.coordinate)
            found.setdefault(key, []).append((log.log.name, each))
    if not found:
        return ""
    rows = sorted(found.items(), key=lambda item: _object_rank(*item))
    cells = [_object_cells(name, kind, parts) for (_, name, kind), parts in rows]
    return section(
        "Objects over all logs",
        element("p", text(OBJECTS_EXPLAINED)),
        table(OBJECT_HEADINGS, cells, "sortable filterable"),
    )


def _object_rank(
    key: tuple[str, str, str], parts: Sequence[tuple[str, Judged]]
) -> tuple[int, float, tuple[object, ...], str]:
    severity, badness = max(each.rank for _, each in parts)
    return (-severity, -badness, natural_key(key[1]), key[2])


def _object_cells(name: str, kind: str, parts: Sequence[tuple[str, Judged]]) -> list[str | Cell]:
    log, worst = max(parts, key=lambda part: part[1].rank)
    middle = float(np.median([each.error for _, each in parts]))
    held = sum(each.inside for _, each in parts)
    return [
        text(name),
        text(kind),
        str(len(parts)),
        Cell(text(figure(kind, worst.error)), round(worst.badness, 5), worst.verdict),
        text(log),
        Cell(text(figure(kind, middle)), round(middle, 6)),
        Cell(f"{held} of {len(parts)}", round(held / len(parts), 4)),
    ]


def _accuracy(material: BatchMaterial) -> str:
    logs: Sequence[DoneLog] = material.done
    found = pooled(part for log in logs for part in log.coverages)
    if not any(part.count for part in found):
        return ""
    return section("Beside the truth, over all logs", charts(found))
