"""A batch as one HTML page: its logs, its buildings over all of them, how doors are used."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence, Sized
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
from objstate.report.batch_material import MOST_LISTED, BatchMaterial, ObjectTally, rank
from objstate.report.batch_part import DoneLog
from objstate.report.batch_plan import draw_states
from objstate.report.course import weak
from objstate.report.days import days
from objstate.report.document import page_head, section, warnings_list, whole_page
from objstate.report.drift import drift
from objstate.report.habits import DoneDoor, habits
from objstate.report.judgement import Judged, fact, headline
from objstate.report.markup import Cell, Row, element, table, text
from objstate.report.news import News, news_section
from objstate.report.page import share_text
from objstate.report.reading import figure, moment, span
from objstate.report.usage import usage

EXPLAINED = (
    "Every object where it last stood in each log, the stronger the more often, and all paths; "
    "dashed where no log observed it."
)
OBJECTS_EXPLAINED = (
    "The last states of each object in all logs whose truth is known, the worst first."
)
MOST_TROUBLES, MOST_OBJECTS, MOST_DOORS, MOST_PLANS = 100, 500, 150, 10  # on one page
OBJECT_HEADINGS = ("object", "state", "logs", "worst", "in log", "median", "in 90 %")


def batch_page(
    material: BatchMaterial,
    doors: Sequence[DoneDoor],
    news: News,
    page: Path,
    report: str,
    zone: tzinfo = UTC,
) -> str:
    """The page of a batch, to stand at ``page``; logs' own pages are called ``report``."""
    shown = doors[:MOST_DOORS]
    body = "".join(
        [
            _head(material, zone),
            _facts(material),
            warnings_list(_troubles(material)),
            news_section(news, zone),
            habits(doors, zone),
            drift(material.lines, zone),
            _logs(material, page, report, zone),
            days(material, zone),
            _objects(material),
            *_plans(material),
            section("How doors are used", _more(doors, MOST_DOORS, "doors", "objstate statistics"),
                    usage([each.statistics for each in shown], str(zone))) if doors else "",
            _accuracy(material),
        ]
    )  # fmt: skip
    return whole_page(f"objstate: {material.folder.name}", body)


def _more(rows: Sized, most: int, what: str, where: str) -> str:
    """A note that there is more than a table shows, and where."""
    if len(rows) <= most:
        return ""
    return element("p", text(f"{most} of {len(rows)} {what}; `{where}` tells all."))


def _head(material: BatchMaterial, zone: tzinfo) -> str:
    said = "No log is done."
    if material.lines:
        first, last = material.lines[0], material.lines[-1]
        said = f"{moment(first.begin_ns, zone)} to {moment(last.begin_ns, zone)}"
    return page_head(material.folder.name, said)


def _facts(material: BatchMaterial) -> str:
    count, done = len(material.outcomes), len(material.lines)
    seconds = sum(line.seconds for line in material.lines)
    facts = [fact(f"{done} of {count}", "logs done", "" if done == count else "wrong")]
    facts.append(fact(span(seconds), "of log"))
    if material.lines:
        known = sum(line.localized * line.seconds for line in material.lines)
        share = known / max(seconds, 1e-9)
        facts.append(fact(share_text(share), "of the time localized", weak(share)))
    return element("div", *facts, *headline(material.tallies), class_="facts")


def _troubles(material: BatchMaterial) -> list[str]:
    failed = material.failed
    told = [_trouble(each) for each in failed[:MOST_TROUBLES]]
    if len(failed) > MOST_TROUBLES:
        told.append(text(f"{len(failed) - MOST_TROUBLES} more logs aren't done."))
    return told + [text(doubt) for doubt in material.doubts]


def _trouble(outcome: Outcome) -> str:
    reason = f": {outcome.reason}" if outcome.reason else ""
    return text(f"{outcome.name} {outcome.status}{reason}")


def _plans(material: BatchMaterial) -> Iterator[str]:
    """A plan for each building that some log was made in."""
    counts = Counter(line.log.building for line in material.lines)
    shown = list(material.buildings.items())[:MOST_PLANS]
    for number, (address, building) in enumerate(shown):
        logs = [log for log in material.drawn if log.log.building == address]
        if not logs:
            continue
        count = counts[address]
        title = f"{building.name}, over {count} {'log' if count == 1 else 'logs'}"
        said = text(EXPLAINED)
        if len(logs) < count:
            said += text(f" Of {count} logs, {len(logs)} are drawn, evenly spread.")
        yield section(title, element("p", said), draw_states(building, logs, number))


def _logs(material: BatchMaterial, page: Path, report: str, zone: tzinfo) -> str:
    summary = material.summary
    kinds = [kind for kind in UNITS if summary[f"{kind}_error"].null_count() < len(summary)]
    failed = material.failed[:MOST_LISTED]
    known = material.rows
    ordered = sorted(material.listed.values(), key=_place)
    rows = []
    for name in (*(each.name for each in failed), *(log.log.name for log in ordered)):
        own = result_of(material.folder, name) / report
        link = os.path.relpath(own, page.absolute().parent) if own.is_file() else None
        log = material.listed.get(name)
        outcome = material.outcomes[name]
        rows.append(_log_row(outcome, known.get(name, {}), log, kinds, link, zone))
    errors = (f"{kind} error ({'deg' if unit_of(kind) == 'rad' else 'cm'})" for kind in kinds)
    judged = ("worst", *errors, "in 90 %") if kinds else ()
    headings = ("log", "status", "begins", "lasts", "objects seen", "localized", "warnings")
    hidden = len(material.outcomes) - len(rows)
    title = "Logs" if not hidden else "Logs to look at first"
    said = ""
    if hidden:
        said = element(
            "p",
            text(f"The worst ones; {hidden} more are in summary.parquet. `objstate report "
                 f"{material.folder.name}/logs/NAME` writes the page of one."),
        )  # fmt: skip
    return section(title, said, table((*headings, *judged), rows, "sortable filterable"))


def _place(log: DoneLog) -> tuple[float, float, float, tuple[object, ...]]:
    weak_share, severity, badness = rank(log)
    return (-weak_share, -severity, -badness, natural_key(log.log.name))


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
        Cell(span(log.course.seconds) if log else "–", log.course.seconds if log else None),
        text(row.get("objects_observed", "–") if done else "–"),
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
    return Cell(share_text(share), round(share, 5), weak(share) or None)


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
    if not material.objects:
        return ""
    rows = sorted(material.objects.items(), key=lambda item: _object_rank(*item))
    cells = [_object_cells(name, kind, own) for (_, name, kind), own in rows[:MOST_OBJECTS]]
    return section(
        "Objects over all logs",
        element("p", text(OBJECTS_EXPLAINED)),
        _more(rows, MOST_OBJECTS, "states", "objstate evaluate"),
        table(OBJECT_HEADINGS, cells, "sortable filterable"),
    )


def _object_rank(
    key: tuple[str, str, str], own: ObjectTally
) -> tuple[int, float, tuple[object, ...], str]:
    severity, badness = own.worst[1].rank if own.worst else (0, 0.0)
    return (-severity, -badness, natural_key(key[1]), key[2])


def _object_cells(name: str, kind: str, own: ObjectTally) -> list[str | Cell]:
    assert own.worst is not None  # it was judged once at least
    log, worst = own.worst
    count = len(own.tally.errors)
    middle = float(np.median(own.tally.errors))
    return [
        text(name),
        text(kind),
        str(count),
        Cell(text(figure(kind, worst.error)), round(worst.badness, 5), worst.verdict),
        text(log),
        Cell(text(figure(kind, middle)), round(middle, 6)),
        Cell(f"{own.tally.inside} of {count}", round(own.tally.inside / count, 4)),
    ]


def _accuracy(material: BatchMaterial) -> str:
    if not any(part.count for part in material.coverages):
        return ""
    return section("Beside the truth, over all logs", charts(material.coverages))
