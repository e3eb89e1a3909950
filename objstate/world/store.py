"""A world kept in a database, and how drives are added to it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from itertools import islice
from operator import attrgetter
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Connection,
    Executable,
    Select,
    delete,
    false,
    func,
    insert,
    or_,
    select,
    update,
)

from objstate.building.digest import model_digest
from objstate.building.model import Building, MovableObject, check_building
from objstate.config import Settings, parse_strict
from objstate.errors import SettingsError, WorldError
from objstate.habits.model import ready
from objstate.objects import ObjectBelief
from objstate.world.codec import pack_belief, pack_object, unpack_belief, unpack_object
from objstate.world.database import WAIT_S, Database
from objstate.world.floor import FloorMemory, KeptFloor
from objstate.world.forgetting import Thinning, thinned
from objstate.world.habit_rows import Learnt, learn, read_habits, refit
from objstate.world.habitual import has_habits
from objstate.world.lately import History, Lately
from objstate.world.location import parse_location
from objstate.world.moving import has_moves
from objstate.world.schema import (
    BELIEFS,
    DRIVES,
    FLOORS,
    HABITS,
    MIGRATIONS,
    OBJECTS,
    STATICS,
    SURVEYS,
    WORLD,
    form_of,
    migrate,
)
from objstate.world.statics import DoorEvidence, Drive
from objstate.world.surveys import MOST, KeptSurvey
from objstate.world.world import World, checked_stamp, filters_of

REPORT = "evidence:"  # how digests of reports begin
ROWS_AT_ONCE = 100  # beliefs sent to the database in one go
MOST_NAMES = 500  # that a query asks for one by one; databases take some thousands of values


@dataclass(frozen=True)
class DriveEntry:
    """A drive that a world has learnt from."""

    digest: str  # what makes a log the same: two entries never share it
    begin_ns: int
    end_ns: int
    settings: Settings = field(default_factory=Settings, repr=False)  # that it was estimated with

    @property
    def is_report(self) -> bool:
        """Whether it is no drive, but a report of a door's state that came to the service."""
        return self.digest.startswith(REPORT)


class WorldStore:
    """A world in its database. Each call is a transaction of its own; nothing stays open between."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @property
    def location(self) -> str:
        """Where it is, without a password."""
        return str(self._database.location)

    def building(self) -> str:
        """The name of the building that it is of. Raises WorldError."""
        with self._database.reading() as connection:
            return str(connection.execute(select(WORLD.c.building)).scalar_one())

    def latest_ns(self) -> int | None:
        """When anything was last learnt; None where nothing ever was. Raises WorldError."""
        with self._database.reading() as connection:
            latest = [
                connection.execute(select(func.max(table.c.stamp_ns))).scalar()
                for table in (BELIEFS, FLOORS)
            ]
        return max((int(each) for each in latest if each is not None), default=None)

    def settings(self) -> Settings:
        """Those of the latest drive, by which it is predicted. Raises WorldError."""
        with self._database.reading() as connection:
            return _latest_settings(connection, self.location)

    def check(self, building: Building) -> None:
        """Raises WorldError where the world is of another building."""
        _check_building(self._database, building)

    def check_writable(self) -> None:
        """Raises WorldError where nothing can be added to it; to ask before long work."""
        with self._database.writing() as connection:
            for table in (DRIVES, BELIEFS, STATICS):
                connection.execute(delete(table).where(false()))

    def load(
        self,
        settings: Settings | None = None,
        *,
        objects: Mapping[str, MovableObject] | None = None,
        since_ns: int | None = None,
        until_ns: int | None = None,
        without: str | None = None,
        newest: bool = False,
    ) -> World:
        """The world as it is in the database now; a value, which later drives don't change.

        Args:
            settings: the dynamics to predict with; by default those of the latest drive.
            objects: the building's, by default as the world remembers them.
            since_ns: leave out what was known only before; answers from there on stay the same,
                earlier moments are refused.
            until_ns: only what was learnt up to there.
            without: leave out what the drive of this digest taught.
            newest: read each object's last belief now, and the others of an object when they are
                asked for, as a planner seldom does; for worlds with much history.

        Raises:
            WorldError: the world can't be read, or a belief is damaged.
            QueryError: a moment is none.
        """
        since_ns, until_ns = (
            None if each is None else checked_stamp(each, 0) for each in (since_ns, until_ns)
        )
        with self._database.reading() as connection:
            items = objects or dict(_objects(connection))
            chosen = settings or _latest_settings(connection, self.location)
            if newest:
                return self._newest(connection, items, chosen)
            rows = connection.execute(_beliefs(since_ns, until_ns, without)).all()
            left = connection.execute(_floors(since_ns, until_ns, without)).all()
            learnt = Learnt()  # what a drive taught of habits can't be told from the others'
            if without is None or not _has_drive(connection, without):
                learnt = read_habits(connection, chosen, filters_of(items, chosen))
        beliefs = (
            unpack_belief(packed, items[name], stamp_ns, last_observed_ns)
            for name, stamp_ns, last_observed_ns, packed in rows
        )
        floors = tuple(KeptFloor(*row) for row in left)
        world = World(items, chosen, {}, since_ns=since_ns).with_beliefs(beliefs)
        return world.beside(floors, learnt.doors, learnt.pieces)

    def later(self, world: World, after: int) -> World:
        """A world that knows the drives up to a number, with what later ones taught.

        Only what is new is read. ``world`` is one that ``load`` returned for all drives. Raises
        WorldError.
        """
        b, items = BELIEFS.c, world.objects
        query = select(b.object, b.stamp_ns, b.last_observed_ns, b.belief).where(b.drive > after)
        f = FLOORS.c
        floors = select(f.stamp_ns, f.forgotten_ns, f.floor).where(f.drive > after)
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(b.object, b.stamp_ns, b.drive)).all()
            left = connection.execute(floors.order_by(f.stamp_ns, f.drive)).all()
            filters = {name: world.filter_of(name) for name in {row[0] for row in rows}}
            learnt = read_habits(connection, world.settings, filters, only=True)
        beliefs = [unpack_belief(row[3], items[row[0]], row[1], row[2]) for row in rows]
        learnt = Learnt(world.habits, world.pieces).also(learnt)
        kept = sorted(
            (*world.floors, *(KeptFloor(*row) for row in left)), key=attrgetter("stamp_ns")
        )
        return world.with_beliefs(beliefs).beside(tuple(kept), learnt.doors, learnt.pieces)

    def then(self, world: World, stamp_ns: int, names: Iterable[str]) -> World:
        """A world with only what was last learnt of some objects by a moment. Raises WorldError."""
        found = []
        with self._database.reading() as connection:
            for name in names:
                query = _of(name, None).where(BELIEFS.c.stamp_ns <= stamp_ns).limit(1)
                row = connection.execute(query).first()
                if row is not None:
                    found.append(unpack_belief(row[2], world.objects[name], row[0], row[1]))
        return world.only(found)

    def history(self, world: World, name: str, most: int | None = None) -> tuple[ObjectBelief, ...]:
        """What was learnt of an object, in time order, the newest so many or all. Raises WorldError."""
        with self._database.reading() as connection:
            rows = connection.execute(_of(name, None).limit(most)).all()
        item = world.objects[name]
        past = [unpack_belief(packed, item, *stamps) for *stamps, packed in reversed(rows)]
        return world.only(past).history(name)

    def thin(self, rule: Thinning, now_ns: int | None = None) -> int:
        """Thin the history by its age (``forgetting``); how many beliefs went. Raises WorldError.

        By default it is now when anything was last learnt.
        """
        moment_ns = self.latest_ns() if now_ns is None else now_ns
        if moment_ns is None:
            return 0
        with self._database.writing() as connection:
            return sum(connection.execute(each).rowcount for each in thinned(rule, moment_ns))

    def _newest(
        self, connection: Connection, items: Mapping[str, MovableObject], settings: Settings
    ) -> World:
        """The world with each object's last belief at hand, and with drives up to now."""
        world = World(items, settings, {})
        drives = connection.execute(select(func.max(DRIVES.c.id))).scalar()
        found = {name: connection.execute(_of(name, drives).limit(1)).first() for name in items}
        rows = {name: row for name, row in found.items() if row is not None}
        stamps = {name: int(row[0]) for name, row in rows.items()}

        def last(name: str) -> ObjectBelief:
            stamp_ns, last_observed_ns, packed = rows[name]
            return world.fitted(unpack_belief(packed, items[name], stamp_ns, last_observed_ns))

        def read(name: str) -> History:
            with self._database.reading() as later:
                past = later.execute(_of(name, drives)).all()
            known = {row[0]: row for row in reversed(past)}  # of one stamp the last drive counts
            return tuple(
                world.fitted(unpack_belief(row[2], items[name], row[0], row[1]))
                for row in known.values()
            )

        latest = max(stamps.values(), default=None)
        left = connection.execute(_floors(latest, None, None)).all()
        learnt = read_habits(connection, settings, filters_of(items, settings))
        return replace(
            world,
            histories=Lately(stamps, last, read),
            floors=tuple(KeptFloor(*row) for row in left),
            habits=learnt.doors,
            pieces=learnt.pieces,
        )

    def drives(self) -> list[DriveEntry]:
        """The drives that it has learnt from, in time order. Raises WorldError."""
        query = select(DRIVES.c.digest, DRIVES.c.begin_ns, DRIVES.c.end_ns, DRIVES.c.settings)
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(DRIVES.c.begin_ns, DRIVES.c.id)).all()
        return [DriveEntry(*row[:3], _settings(row[3], self.location)) for row in rows]

    def add(
        self,
        drive: DriveEntry,
        beliefs: Iterable[ObjectBelief],
        floor: FloorMemory | None = None,
        also: Iterable[Executable] = (),
        statics: Drive | None = None,
        survey: KeptSurvey | None = None,
    ) -> bool:
        """Add what a drive taught, whole or not at all; False where the world has the drive already.

        ``floor`` is what it left of its grid, where it had one, and ``statics`` what it told of where
        doors hang beside the walls about them, and ``survey`` of walls and lasers. ``also`` are
        statements of whoever keeps tables beside the world, made in the same transaction.

        Beliefs hold from their stamps on, whichever drive was added first. Raises WorldError
        where another writer doesn't finish, and for a belief without a stamp.
        """
        ready()  # before others wait for the transaction
        with self._database.writing() as connection:
            if _has_drive(connection, drive.digest):
                return False
            new = insert(DRIVES).values(
                digest=drive.digest,
                begin_ns=drive.begin_ns,
                end_ns=drive.end_ns,
                settings=drive.settings.model_dump_json(by_alias=True, exclude_unset=True),
                version=version("objstate"),
            )
            identity = connection.execute(new.returning(DRIVES.c.id)).scalar_one()
            taught = list(beliefs)
            rows = (_row(belief, identity) for belief in taught)
            while some := list(islice(rows, ROWS_AT_ONCE)):
                connection.execute(insert(BELIEFS), some)
            if floor is not None:
                kept = floor.kept()
                row = {"drive": identity, "floor": kept.packed}
                row |= {"stamp_ns": kept.stamp_ns, "forgotten_ns": kept.forgotten_ns}
                connection.execute(insert(FLOORS), [row])
            for statement in also:
                connection.execute(statement)
            _learn_statics(connection, statics or {})
            if survey is not None:
                _keep_survey(connection, identity, survey)
            seen = {belief.item.name for belief in taught}
            filters = filters_of(dict(_objects(connection, seen)), drive.settings)
            due = learn(connection, drive.settings, filters, taught)
        if due:
            self.fit_habits(drive.settings, due)
        return True

    def forget(self, name: str, also: Iterable[Executable] = ()) -> int:
        """Remove all that was learnt of an object; the number of beliefs. ``also`` is as in ``add``.

        Drives stay known, so that none is learnt from again. Raises WorldError.
        """
        with self._database.writing() as connection:
            for statement in also:
                connection.execute(statement)
            gone = connection.execute(delete(BELIEFS).where(BELIEFS.c.object == name)).rowcount
            for table in (HABITS, STATICS):
                connection.execute(delete(table).where(table.c.object == name))
        return int(gone)

    def statics(self, without: str | None = None) -> Drive:
        """What drives told of where doors hang beside the walls about them, put together.

        Nothing, where the drive of a digest has told of it already: what it told can't be taken out
        again. Raises WorldError.
        """
        with self._database.reading() as connection:
            if without is not None and _has_drive(connection, without):
                return {}
            rows = connection.execute(select(STATICS.c.object, STATICS.c.evidence)).all()
        return {name: DoorEvidence.unpacked(packed, name) for name, packed in rows}

    def surveys(self, without: str | None = None) -> list[KeptSurvey]:
        """What the latest drives told of walls and lasers, without that of a digest; by time.

        Raises WorldError.
        """
        d = DRIVES.c
        query = select(SURVEYS.c.survey).join(DRIVES, d.id == SURVEYS.c.drive)
        if without is not None:
            query = query.where(d.digest != without)
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(d.begin_ns, d.id)).scalars().all()
        return [KeptSurvey.unpacked(packed) for packed in rows]

    def fit_habits(
        self, settings: Settings | None = None, names: Iterable[str] | None = None
    ) -> None:
        """Fit the habits of some objects, by default all, to everything that was seen of them.

        ``add`` takes each drive in by itself, and does this for an object when it knows a quarter more
        looks than the last time; half a second each, of some hundred looks. Raises WorldError.
        """
        world = self.load(settings, newest=True)
        for name in world.objects if names is None else names:
            filter_ = world.filter_of(name)
            if not (has_habits(filter_) or has_moves(filter_)):
                continue
            with self._database.writing() as connection:  # nobody adds looks that the fit lacks
                if history := self.history(world, name):
                    refit(connection, world.settings, filter_, history)

    def adopt(self, before: Building, grown: Building, belief: ObjectBelief) -> None:
        """Take a new object in: the world of ``before`` becomes one of ``grown``, whole or not at all.

        Raises WorldError where the world is of another building, has an object of that name, or
        hasn't learnt from a drive that was under way at the belief's stamp.
        """
        item, stamp_ns = belief.item, belief.stamp_ns
        drive = select(DRIVES.c.id).where(
            DRIVES.c.begin_ns <= stamp_ns, DRIVES.c.end_ns >= stamp_ns
        )
        with self._database.writing() as connection:
            name, known = connection.execute(
                select(WORLD.c.building, WORLD.c.building_digest)
            ).one()
            if known != model_digest(before):
                raise _of_another(self._database, name, before)
            if item.name in dict(_objects(connection)):
                raise WorldError(f"The world {self.location} has a '{item.name}' already.")
            identity = connection.execute(drive.order_by(DRIVES.c.id.desc())).scalar()
            if identity is None:
                raise WorldError(
                    f"The world {self.location} hasn't learnt from the log in which '{item.name}' was "
                    f"seen; estimate that with --world {self.location}."
                )
            model = {"name": item.name, "model": pack_object(item)}
            connection.execute(insert(OBJECTS), [model])
            connection.execute(insert(BELIEFS), [_row(belief, identity)])
            connection.execute(
                update(WORLD).values(building=grown.name, building_digest=model_digest(grown))
            )


def open_store(
    location: str | Path, building: Building | None = None, *, wait_s: float = WAIT_S
) -> WorldStore:
    """The world at a path or a PostgreSQL URL. With a building it is made where there is none.

    A writer waits ``wait_s`` seconds for another one. Raises WorldError where there is no
    world, where it is one of another building, or where it can't be opened, and TypeError for a
    building that isn't loaded.
    """
    if building is not None:
        check_building(building)
    database = Database(parse_location(location), wait_s)
    if building is None:
        _check_that_it_is_there(database)
    else:
        _make_or_check(database, building)
    return WorldStore(database)


def _has_drive(connection: Connection, digest: str) -> bool:
    known = select(DRIVES.c.id).where(DRIVES.c.digest == digest)
    return connection.execute(known).first() is not None


def _learn_statics(connection: Connection, new: Drive) -> None:
    """Add what a drive told of where doors hang."""
    for name, evidence in new.items():
        own = STATICS.c.object == name
        row = connection.execute(select(STATICS.c.drives, STATICS.c.evidence).where(own)).first()
        drives, total = 1, evidence
        if row is not None:
            drives, total = row[0] + 1, DoorEvidence.unpacked(row[1], name) + evidence
            connection.execute(delete(STATICS).where(own))
        values = {"object": name, "drives": drives, "evidence": total.packed()}
        connection.execute(insert(STATICS), [values])


def _keep_survey(connection: Connection, drive: int, survey: KeptSurvey) -> None:
    """Add a drive's survey, and remove those of drives before the latest ones."""
    connection.execute(insert(SURVEYS), [{"drive": drive, "survey": survey.packed()}])
    d, s = DRIVES.c, SURVEYS.c
    kept = select(s.drive).join(DRIVES, d.id == s.drive).order_by(d.begin_ns.desc(), d.id.desc())
    latest = connection.execute(kept.limit(MOST)).scalars().all()
    connection.execute(delete(SURVEYS).where(s.drive.not_in(latest)))


def _check_that_it_is_there(database: Database) -> None:
    place = database.location
    missing = place.file is not None and not place.file.is_file()
    if not missing:
        with database.reading() as connection:
            form = form_of(connection, place)
    if missing or not form:
        raise WorldError(
            f"There is no world at {place}; make one with `objstate estimate ... --world {place}`."
        )
    if form < len(MIGRATIONS):
        with database.writing() as connection:
            migrate(connection, form_of(connection, place), place)


def _make_or_check(database: Database, building: Building) -> None:
    place, digest = database.location, model_digest(building)
    if place.file is not None:
        place.file.absolute().parent.mkdir(parents=True, exist_ok=True)
    with database.reading() as connection:
        form = form_of(connection, place)
    if not form:
        database.write_ahead()
    if form < len(MIGRATIONS):
        with database.writing() as connection:
            form = form_of(connection, place)  # somebody else may have made it meanwhile
            migrate(connection, form, place)
            if not form:
                _describe(connection, building, digest)
    _check_building(database, building)


def _check_building(database: Database, building: Building) -> None:
    with database.reading() as connection:
        name, known = connection.execute(select(WORLD.c.building, WORLD.c.building_digest)).one()
    if known != model_digest(building):
        raise _of_another(database, name, building)


def _of_another(database: Database, name: str, building: Building) -> WorldError:
    return WorldError(
        f"The world {database.location} is of the building '{name}' as it was described when "
        f"the world was made, not of {building.source or building.name}: walls, objects or "
        "limits differ. Give that building, or another --world."
    )


def _describe(connection: Connection, building: Building, digest: str) -> None:
    """Write down which building a new world is of."""
    form = len(MIGRATIONS)
    connection.execute(
        insert(WORLD).values(form=form, building=building.name, building_digest=digest)
    )
    rows = [{"name": name, "model": pack_object(item)} for name, item in building.objects.items()]
    if rows:
        connection.execute(insert(OBJECTS), rows)


def _objects(
    connection: Connection, names: Collection[str] | None = None
) -> Iterator[tuple[str, MovableObject]]:
    query = select(OBJECTS.c.name, OBJECTS.c.model)
    if names is not None and len(names) < MOST_NAMES:
        query = query.where(OBJECTS.c.name.in_(names))
    for name, model in connection.execute(query):
        if names is None or name in names:
            yield name, unpack_object(model, name)


def _latest_settings(connection: Connection, place: str) -> Settings:
    latest = select(DRIVES.c.settings).order_by(DRIVES.c.end_ns.desc(), DRIVES.c.id.desc()).limit(1)
    text = connection.execute(latest).scalar()
    return Settings() if text is None else _settings(text, place)


def _settings(text: str, place: str) -> Settings:
    try:
        return parse_strict(Settings, json.loads(text), f"settings of the latest drive in {place}")
    except SettingsError as error:
        raise WorldError(
            f"{error}; another version of objstate wrote them, give --config."
        ) from error


def _beliefs(since_ns: int | None, until_ns: int | None, without: str | None) -> Select[Any]:
    """Beliefs in time order; of those up to ``since_ns``, each object's last one alone."""
    b, chosen = BELIEFS.c, []
    if until_ns is not None:
        chosen.append(b.stamp_ns <= until_ns)
    if without is not None:
        chosen.append(b.drive.not_in(select(DRIVES.c.id).where(DRIVES.c.digest == without)))
    query = select(b.object, b.stamp_ns, b.last_observed_ns, b.belief).where(*chosen)
    if since_ns is not None:
        early = select(b.object, func.max(b.stamp_ns).label("stamp_ns")).where(
            b.stamp_ns <= since_ns, *chosen
        )
        last = early.group_by(b.object).subquery()
        query = query.outerjoin(last, b.object == last.c.object).where(
            or_(b.stamp_ns > since_ns, b.stamp_ns == last.c.stamp_ns)
        )
    return query.order_by(b.object, b.stamp_ns, b.drive)


def _of(name: str, drive: int | None) -> Select[Any]:
    """The beliefs of one object from drives up to one, the newest first."""
    b = BELIEFS.c
    query = select(b.stamp_ns, b.last_observed_ns, b.belief).where(b.object == name)
    if drive is not None:
        query = query.where(b.drive <= drive)
    return query.order_by(b.stamp_ns.desc(), b.drive.desc())


def _floors(since_ns: int | None, until_ns: int | None, without: str | None) -> Select[Any]:
    """What drives left of their grids, in time order; not what is forgotten by ``since_ns``."""
    f, chosen = FLOORS.c, []
    if since_ns is not None:
        chosen.append(f.forgotten_ns > since_ns)
    if until_ns is not None:
        chosen.append(f.stamp_ns <= until_ns)
    if without is not None:
        chosen.append(f.drive.not_in(select(DRIVES.c.id).where(DRIVES.c.digest == without)))
    query = select(f.stamp_ns, f.forgotten_ns, f.floor).where(*chosen)
    return query.order_by(f.stamp_ns, f.drive)


def _row(belief: ObjectBelief, drive: int) -> dict[str, Any]:
    if belief.stamp_ns is None:
        raise WorldError(f"A belief of '{belief.item.name}' has no stamp; say of when it is.")
    return {
        "object": belief.item.name,
        "stamp_ns": belief.stamp_ns,
        "drive": drive,
        "last_observed_ns": belief.last_observed_ns,
        "belief": pack_belief(belief),
    }
