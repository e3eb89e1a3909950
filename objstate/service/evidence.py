"""Reports about objects that no robot made: contact sensors, access systems, people."""

from __future__ import annotations

import math
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy import insert, select

from objstate.building.model import Kind, MovableObject
from objstate.config import Settings
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.records import NANOSECONDS
from objstate.service.believed import Believed, known_object
from objstate.service.problems import Problem
from objstate.service.tables import EVIDENCE
from objstate.world.database import Database
from objstate.world.store import REPORT, DriveEntry, WorldStore

CLOSED_DEG, CLOSED_M = (
    2.0,
    0.02,
)  # from its limit, within which a contact says that a door is closed
CLOCK_ERROR_NS = 5 * 10**9  # by which clocks of those who report may be ahead


class Report(BaseModel):
    """What somebody says of an object: where its state is, and how far that is to be relied on."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    source: str = Field(min_length=1, max_length=200, examples=["contact sensor 17"])
    state: str | None = Field(None, pattern="^(open|closed)$", description="of a door")
    region: tuple[float, float] | None = Field(
        None, description="of a door, instead of its state: from, to; rad or m"
    )
    reliability: float = Field(0.99, gt=0.0, lt=1.0, description="probability that it is right")
    stamp_ns: int | None = Field(None, ge=0, lt=2**63, description="default: now")
    id: str | None = Field(
        None,
        min_length=1,
        max_length=200,
        description="chosen by who reports; the same id again changes nothing",
    )


class EvidenceDesk:
    """Takes reports into the world by Bayes' rule, and keeps their source."""

    def __init__(
        self,
        database: Database,
        store: WorldStore,
        believed: Believed,
        settings: Settings,
        on_taught: Callable[[], None],
    ) -> None:
        self._database, self._store = database, store
        self._believed, self._settings = believed, settings
        self._on_taught = on_taught
        self._lock = threading.Lock()  # reports are stamped in the order in which they are taken

    def take(self, name: str, report: Report, token: str) -> ObjectBelief:
        """The belief with a report. Raises Problem for one that can't be, WorldError."""
        item = self._believed.now.world.objects[known_object(self._believed.now.world, name)]
        if item.kind is Kind.PLANAR:
            raise Problem(422, f"'{name}' is furniture, of which nothing can be told yet.", DOORS)
        lower, upper = _region(item, report)
        identity = secrets.token_hex(8) if report.id is None else report.id
        on_record = insert(EVIDENCE).values(
            id=identity,
            object=name,
            source=report.source,
            lower=lower,
            upper=upper,
            reliability=report.reliability,
            token=token,
        )
        with self._lock:
            stamp_ns = _stamp_of(report, time.time_ns())
            entry = DriveEntry(f"{REPORT}{identity}", stamp_ns, stamp_ns, self._settings)
            taken = list[ObjectBelief]()

            def weighed() -> Iterator[ObjectBelief]:  # in the transaction: no other report comes
                self._believed.refresh()
                before = self._believed.at(stamp_ns, name)[name]
                taken.append(told(before, lower, upper, report.reliability))
                yield from taken

            self._store.add(entry, weighed(), also=[on_record.values(stamp_ns=stamp_ns)])
            self._on_taught()
            return taken[0] if taken else self._believed.at(stamp_ns, name)[name]

    def reports(self, name: str) -> dict[str, Any]:
        """What was reported of an object, in time order. Raises Problem for an unknown one."""
        known_object(self._believed.now.world, name)
        c = EVIDENCE.c
        query = select(c.id, c.stamp_ns, c.source, c.lower, c.upper, c.reliability)
        with self._database.reading() as connection:
            rows = connection.execute(query.where(c.object == name).order_by(c.stamp_ns, c.id))
            return {"object": name, "evidence": [dict(row._mapping) for row in rows]}


DOORS = "Report doors."


def _stamp_of(report: Report, now_ns: int) -> int:
    """When a report holds from, by default now. Raises Problem for a moment to come."""
    if report.stamp_ns is None:
        return now_ns
    ahead_ns = report.stamp_ns - now_ns
    if ahead_ns > CLOCK_ERROR_NS:
        detail = f"The report's stamp is {ahead_ns / NANOSECONDS:.0f} s in the future."
        raise Problem(422, detail, "Give nanoseconds since 1970 by a clock that is set.")
    return report.stamp_ns


def told(belief: ObjectBelief, lower: float, upper: float, reliability: float) -> ObjectBelief:
    """A door's belief after a report that its state is in a region, by Bayes' rule.

    A report that is wrong says nothing of where the state is: its likelihood is the reliability
    within the region, and what is missing to 1 outside.
    """
    states = belief.states[:, 0]
    inside = (states >= lower) & (states <= upper)
    likelihood: FloatArray = np.where(inside, reliability, 1.0 - reliability)
    weights = belief.weights.values * likelihood
    return altered(
        belief,
        weights=Weights.of(weights),
        last_observed_ns=belief.stamp_ns,
        joint=None,
        past=None,
    )


def _region(item: MovableObject, report: Report) -> tuple[float, float]:
    """The states that a report names. Raises Problem."""
    if (report.state is None) == (report.region is None):
        raise Problem(422, "A report needs a state or a region, and not both.", "Give one.")
    if report.region is not None:
        lower, upper = report.region
        if not lower <= upper or upper < item.lower or lower > item.upper:
            where = f"{item.lower:.4f} to {item.upper:.4f}"
            raise Problem(422, f"{lower} to {upper} is no region of {where}.", "Give from, to.")
        return lower, upper
    home = float(item.home[0])
    ajar = math.radians(CLOSED_DEG) if item.kind is Kind.HINGED else CLOSED_M
    away = 1.0 if abs(item.upper - home) >= abs(item.lower - home) else -1.0
    if report.state == "closed":
        return home - ajar, home + ajar
    return (home + ajar, item.upper) if away > 0.0 else (item.lower, home - ajar)
