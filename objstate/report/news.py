"""What changed since the batch was reported on before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import tzinfo
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.errors import WorldError
from objstate.evaluation.states import error
from objstate.order import natural_key
from objstate.packing import pack, unpack
from objstate.recording.index import BatchIndex
from objstate.report.document import section
from objstate.report.judgement import tolerances
from objstate.report.markup import Cell, element, table, text
from objstate.report.reading import figure, moment

if TYPE_CHECKING:
    from objstate.report.batch_material import BatchMaterial

KIND = "reported"  # under which the index keeps what was reported
NOW, BEFORE = " now", " before"  # no names of logs
NAMES_SHOWN = 20
MOST_MOVED = 200


@dataclass(frozen=True)
class Moved:
    """One coordinate of an object that stands elsewhere than was reported before."""

    object: str
    coordinate: str
    before: float
    after: float
    seen_ns: int
    log: str


@dataclass(frozen=True)
class News:
    """What changed since the batch was reported on before; None where it never was."""

    added: tuple[str, ...]  # logs that are done now, and weren't
    broken: tuple[str, ...]  # that failed since
    moved: tuple[Moved, ...]
    is_first: bool = False


def note_news(index: BatchIndex, material: BatchMaterial) -> News:
    """What is new, by what the index remembers of the report before; it remembers this one now."""
    known = {name: content for name, _, content in index.parts(KIND)}
    now = pack(_told(material), {})
    if known.get(NOW) != now:
        known = {NOW: now} | ({BEFORE: known[NOW]} if NOW in known else {})
        index.keep(KIND, [(name, "", content) for name, content in known.items()])
    try:
        before = unpack(known[BEFORE], "The report before")[0]
    except (KeyError, WorldError):
        return News((), (), (), is_first=True)
    return _compared(before, material)


def _told(material: BatchMaterial) -> dict[str, Any]:
    return {
        "statuses": {name: each.status for name, each in sorted(material.outcomes.items())},
        "latest": [[*key, seen.value] for key, seen in sorted(material.latest.items())],
    }


def _compared(before: Mapping[str, Any], material: BatchMaterial) -> News:
    statuses: Mapping[str, str] = before["statuses"]
    latest = {(building, name, kind): value for building, name, kind, value in before["latest"]}
    added, broken = list[str](), list[str]()
    for name, outcome in material.outcomes.items():
        if outcome.status != statuses.get(name, "not run"):
            (added if outcome.status == "done" else broken).append(name)
    moved = [
        Moved(key[1], key[2], latest[key], seen.value, seen.stamp_ns, seen.log)
        for key, seen in material.latest.items()
        if key in latest and _differ(key[2], latest[key], seen.value)
    ]
    return News(
        tuple(sorted(added, key=natural_key)),
        tuple(sorted(broken, key=natural_key)),
        tuple(sorted(moved, key=lambda each: (natural_key(each.object), each.coordinate))),
    )


def _differ(coordinate: str, one: float, other: float) -> bool:
    off = float(error(coordinate, np.array(one), np.array(other)))
    return abs(off) > tolerances(coordinate)[1]


def news_section(news: News, zone: tzinfo) -> str:
    """What is new in words, and a table of what stands elsewhere."""
    if news.is_first or not (news.added or news.broken or news.moved):
        return ""
    said = [_listed("more done", news.added), _listed("not done any more", news.broken)]
    rows: list[list[str | Cell]] = [
        [
            text(each.object),
            text(each.coordinate),
            figure(each.coordinate, each.before),
            figure(each.coordinate, each.after),
            Cell(text(moment(each.seen_ns, zone)), each.seen_ns),
            text(each.log),
        ]
        for each in news.moved[:MOST_MOVED]
    ]
    headings = ("object", "state", "before", "now", "seen", "in log")
    moved = table(headings, rows, "sortable filterable") if rows else ""
    count = element("p", text(f"{len(news.moved)} states differ by more than 10° or 10 cm."))
    return section("Since the report before", *said, count if rows else "", moved)


def _listed(what: str, names: Sequence[str]) -> str:
    if not names:
        return ""
    more = ", ..." if len(names) > NAMES_SHOWN else ""
    shown = ", ".join(names[:NAMES_SHOWN])
    word = "log is" if len(names) == 1 else "logs are"
    return element("p", text(f"{len(names)} {word} {what}: {shown}{more}"))
