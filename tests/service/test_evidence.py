"""Reports about doors: each is weighed with all that were taken before, by any process."""

from __future__ import annotations

from contextlib import suppress
from threading import Barrier, BrokenBarrierError, Thread

import pytest

from objstate.config import Settings
from objstate.service.believed import Believed, Snapshot
from objstate.service.evidence import EvidenceDesk, Report
from objstate.service.tables import make_tables
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import open_store
from tests.world.conftest import place
from tests.world.examples import BUILDING

__all__ = ["place"]

SHORTLY_S = 0.5  # that one process may wait for the other
STAMP_NS = 10**9


def desk(place: str) -> tuple[EvidenceDesk, Believed]:
    """What one process of a service takes reports with, and what it knows."""
    database, store, settings = Database(parse_location(place)), open_store(place), Settings()
    believed = Believed(database, store, BUILDING, settings)
    return EvidenceDesk(database, store, believed, settings, believed.refresh), believed


def p_open(believed: Believed) -> float:
    belief = believed.at(STAMP_NS, "door")["door"]
    return float(belief.weights.values[belief.states[:, 0] > 0.1].sum())


def test_of_two_reports_at_once_neither_is_lost(
    place: str, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = Report(source="contact", state="open", reliability=0.7, stamp_ns=STAMP_NS)
    apart = str(tmp_path_factory.mktemp("apart") / "world.db")
    for each in (place, apart):
        open_store(each, BUILDING)
        make_tables(Database(parse_location(each)))
    alone, known = desk(apart)
    for _ in range(2):
        alone.take("door", report, "token")

    desks, both, at = [desk(place) for _ in range(2)], Barrier(2), Believed.at

    def at_once(self: Believed, stamp_ns: int, name: str | None = None) -> Snapshot:
        found = at(self, stamp_ns, name)
        with suppress(BrokenBarrierError):  # the other one waits for this one's transaction
            both.wait(SHORTLY_S)
        return found

    monkeypatch.setattr(Believed, "at", at_once)
    threads = [Thread(target=one.take, args=("door", report, "token")) for one, _ in desks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    monkeypatch.setattr(Believed, "at", at)
    (_, believed), _ = desks
    believed.refresh()
    assert p_open(believed) == pytest.approx(p_open(known))
