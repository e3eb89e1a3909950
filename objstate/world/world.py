"""A world: for every object what is believed of it, at any moment."""

from __future__ import annotations

import math
import operator
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike

from objstate.building.model import Kind, MovableObject
from objstate.config import Settings
from objstate.errors import QueryError, WorldError
from objstate.habits.building import DoorHabits, PieceHabits
from objstate.lazy import lazy
from objstate.objects import ObjectBelief, ObjectFilter, filter_for
from objstate.recording.stamps import CALENDAR_FROM
from objstate.records import NANOSECONDS
from objstate.units import SECONDS_PER_HOUR
from objstate.world.allowed import Task
from objstate.world.blocking import Blockage, blocked
from objstate.world.due import Due, due
from objstate.world.fitting import fitted
from objstate.world.floor import KeptFloor, Occupancy, occupied
from objstate.world.habitual import carried, has_habits, state_of
from objstate.world.lately import Lately
from objstate.world.moving import has_moves, moved_on

FARTHEST_NS = 2**62  # from 1970, the year 2116; sums of stamps and times stay within 64 bits
NAMES_SHOWN = 10  # so many names tell what the others are like
UNUSED_RNG = np.random.default_rng(0)  # for doors, whose filters draw nothing


@dataclass(frozen=True, eq=False)
class World:
    """The beliefs of every object over time. A value: what is learnt later makes a new one.

    Between two beliefs, and after the last, an object's dynamics model says how the
    belief goes on (eq. (5) of Schulz and Burgard 2001): where its habits are known by these,
    unless the settings say how often it is moved. Before the first, its prior holds.
    """

    objects: Mapping[str, MovableObject] = field(repr=False)
    settings: Settings = field(repr=False)
    histories: Mapping[str, tuple[ObjectBelief, ...]] = field(repr=False)  # in time order
    floors: tuple[KeptFloor, ...] = field(default=(), repr=False)  # of drives, in time order
    habits: DoorHabits | None = field(default=None, repr=False)  # None: nobody learnt any
    pieces: PieceHabits | None = field(default=None, repr=False)  # habits of furniture
    since_ns: int | None = None  # what was known only before is left out; None: nothing is

    @staticmethod
    def of(
        objects: Mapping[str, MovableObject],
        settings: Settings | None = None,
        beliefs: Iterable[ObjectBelief] = (),
    ) -> World:
        """A world in which ``beliefs`` hold, each from its stamp on.

        Of beliefs of one object with one stamp the last counts. Raises WorldError for
        a belief without a stamp, or of an unknown object.
        """
        return World(objects, settings or Settings(), {}).with_beliefs(beliefs)

    def with_beliefs(self, beliefs: Iterable[ObjectBelief]) -> World:
        """The world that knows these beliefs too. Raises WorldError as ``of`` does."""
        known: dict[str, dict[int, ObjectBelief]] = {}
        for belief in beliefs:
            name = self._known(belief.item.name)
            if belief.stamp_ns is None:
                raise WorldError(f"A belief of '{name}' has no stamp; say of when it is.")
            if name not in known:
                past = self.histories.get(name, ())
                known[name] = dict(zip(self._stamps(name), past, strict=True))
            known[name][belief.stamp_ns] = self.fitted(belief)
        histories = dict(self.histories) | {
            name: tuple(past[stamp] for stamp in sorted(past)) for name, past in known.items()
        }
        return self._with(histories=histories)

    def beside(
        self,
        floors: tuple[KeptFloor, ...],
        habits: DoorHabits | None,
        pieces: PieceHabits | None,
    ) -> World:
        """The world with other floors and habits."""
        return self._with(floors=floors, habits=habits, pieces=pieces)

    def only(self, beliefs: Iterable[ObjectBelief]) -> World:
        """The world with these beliefs alone, as if nothing else had been learnt."""
        return self._with(histories={}, since_ns=None).with_beliefs(beliefs)

    def newest(self) -> World:
        """The world with each object's last belief: what answers from its latest moment on need."""
        last = {name: past[-1:] for name, past in self.histories.items()}
        return self._with(histories=last, since_ns=self.latest_ns)

    def _with(self, **fields: Any) -> World:
        later = replace(self, **fields)
        later.__dict__["_filters"] = self._filters  # which follow from objects and settings
        return later

    def fitted(self, belief: ObjectBelief) -> ObjectBelief:
        """A belief of a moment, with the states by which its object is predicted."""
        name = self._known(belief.item.name)
        return fitted(belief, self._filters[name], self._rng(name, belief.stamp_ns or 0))

    @lazy
    def latest_ns(self) -> int | None:
        """When anything was last learnt; None where nothing ever was."""
        if isinstance(self.histories, Lately):
            learnt = list(self.histories.stamps.values())
        else:
            learnt = [self._stamps(name)[-1] for name in self.histories]
        return max(learnt + [each.stamp_ns for each in self.floors], default=None)

    def at(
        self, stamp_ns: int | None = None, newer: Mapping[str, ObjectBelief] | None = None
    ) -> Snapshot:
        """What is believed at a moment, by default the latest at which anything was learnt.

        An earlier moment is answered with what was known then, a later one by prediction. Beliefs
        of drives that go on, which the world doesn't have yet, may be given as ``newer``, by name.
        Raises QueryError as ``moment`` does.
        """
        return Snapshot(self, self.moment(stamp_ns), newer or {})

    def moment(self, stamp_ns: int | None = None) -> int:
        """A moment to ask for, by default the latest at which anything was learnt.

        Raises QueryError for a stamp that is no whole number, too far away, in seconds, or before
        what the world was loaded with.
        """
        latest_ns = self.latest_ns or 0
        if stamp_ns is None:
            return latest_ns
        stamp_ns = checked_stamp(stamp_ns, latest_ns)
        if self.since_ns is not None and stamp_ns < self.since_ns:
            raise QueryError(
                f"The world was loaded with what answers from {self.since_ns} ns on need, not from "
                f"{stamp_ns} ns; load it with that as since_ns, or without since_ns."
            )
        return stamp_ns

    def history(self, name: str) -> tuple[ObjectBelief, ...]:
        """What was learnt of an object, in time order. Raises QueryError for an unknown one."""
        return self.histories.get(self._known(name), ())

    def history_until(self, name: str, stamp_ns: int) -> tuple[ObjectBelief, ...]:
        """What of it was learnt by a moment. Raises QueryError as ``belief`` does."""
        return self._until(name, self.moment(stamp_ns))

    def blocked(
        self, path: ArrayLike, robot_radius: float, stamp_ns: int | None = None
    ) -> Blockage:
        """``Snapshot.blocked`` at a moment, by default the latest at which anything was learnt."""
        return self.at(stamp_ns).blocked(path, robot_radius)

    def occupied(
        self, area: ArrayLike, robot_radius: float | None = None, stamp_ns: int | None = None
    ) -> Occupancy:
        """``Snapshot.occupied`` at a moment, by default the latest at which anything was learnt."""
        return self.at(stamp_ns).occupied(area, robot_radius)

    def due(self, task: Task, horizon_s: float, stamp_ns: int | None = None) -> tuple[Due, ...]:
        """What a task wants verified within so many seconds if nobody looks, the soonest first.

        A planner may sleep until the first of them. The moment is by default the latest at
        which anything was learnt. Raises QueryError for a horizon that is none, and as ``moment``.
        """
        if not 0.0 <= horizon_s < math.inf:
            raise QueryError(f"A horizon of {horizon_s} s must be 0 or more, and finite.")
        return due(self, task, horizon_s, self.moment(stamp_ns))

    def filter_of(self, name: str) -> ObjectFilter:
        """The filter by which an object is predicted. Raises QueryError for an unknown one."""
        return self._filters[self._known(name)]

    def belief(self, name: str, stamp_ns: int, newer: ObjectBelief | None = None) -> ObjectBelief:
        """What is believed of one object at a moment.

        The same world, object and moment give the same samples. A ``newer`` belief takes the place
        of those before it. Raises QueryError for an unknown object, and as ``moment`` does.
        """
        stamp_ns = self.moment(stamp_ns)
        last = self._last(name, stamp_ns)
        if newer is not None and _stamp(last) <= _stamp(newer) <= stamp_ns:
            last = newer
        if last is None:
            return replace(self._filters[name].prior(self._rng(name, stamp_ns)), stamp_ns=stamp_ns)
        return self.later(last, stamp_ns)

    def later(self, belief: ObjectBelief, stamp_ns: int) -> ObjectBelief:
        """A belief of a moment as it is at a later one if nobody looks meanwhile."""
        if belief.stamp_ns is None or belief.stamp_ns == stamp_ns:
            return belief
        begin_ns, name = belief.stamp_ns, belief.item.name
        filter_, rng = self._filters[name], self._rng(name, stamp_ns)
        if (habits := self.habits_of(name)) is not None and has_habits(filter_):
            then = carried(habits, filter_, belief, begin_ns, stamp_ns)
        elif (moves := self.moves_of(name)) is not None and has_moves(filter_):
            then = moved_on(moves, filter_, belief, begin_ns, stamp_ns, rng)
        else:
            then = filter_.predict(belief, (stamp_ns - begin_ns) / NANOSECONDS, rng)
        return replace(then, stamp_ns=stamp_ns)

    def probability_moved(self, name: str, stamp_ns: int) -> float | None:
        """How probably somebody has moved an object since it was last seen; None where it never was.

        Raises QueryError as ``belief`` does.
        """
        past = self.history_until(name, stamp_ns)
        if not past or past[-1].last_observed_ns is None:
            return None
        begin_ns, filter_ = past[-1].last_observed_ns, self._filters[name]
        if (moves := self.moves_of(name)) is not None:
            return 1.0 - moves.forecast(name).stays(begin_ns, stamp_ns)
        if (habits := self.habits_of(name)) is not None and has_habits(filter_):
            stays = state_of(habits, filter_, past[-1], begin_ns)
            return 1.0 - float(
                (stays * habits.forecast(name).kept(begin_ns, stamp_ns)).sum(1).mean()
            )
        hours = (stamp_ns - begin_ns) / NANOSECONDS / SECONDS_PER_HOUR
        return -math.expm1(-filter_.settings.dynamics.moves_per_hour * hours)

    def habits_of(self, name: str) -> DoorHabits | None:
        """The habits by which a door is predicted; None where the settings serve.

        Raises QueryError for an unknown object.
        """
        knows = self.habits is not None and self._known(name) in self.habits
        return self.habits if knows and has_habits(self._filters[name]) else None

    def moves_of(self, name: str) -> PieceHabits | None:
        """The habits by which furniture is predicted, as ``habits_of`` has those of doors."""
        knows = self.pieces is not None and self._known(name) in self.pieces
        return self.pieces if knows and has_moves(self._filters[name]) else None

    @lazy
    def _filters(self) -> dict[str, ObjectFilter]:
        return filters_of(self.objects, self.settings)

    def _last(self, name: str, stamp_ns: int) -> ObjectBelief | None:
        """The last belief of an object by a moment; its older ones are looked at where need be."""
        newest = self._newest(self._known(name))
        if newest is None or (newest.stamp_ns is not None and newest.stamp_ns <= stamp_ns):
            return newest
        past = self._until(name, stamp_ns)
        return past[-1] if past else None

    def _until(self, name: str, stamp_ns: int) -> tuple[ObjectBelief, ...]:
        return self.history(name)[: bisect_right(self._stamps(name), stamp_ns)]

    def _newest(self, name: str) -> ObjectBelief | None:
        if isinstance(self.histories, Lately):
            return self.histories.newest(name)
        past = self.histories.get(name)
        return past[-1] if past else None

    def _stamps(self, name: str) -> tuple[int, ...]:
        """When what was learnt of an object was learnt, in time order."""
        known = self._stamps_known
        if name not in known:
            past = self.histories.get(name, ())
            known[name] = tuple(b.stamp_ns for b in past if b.stamp_ns is not None)
        return known[name]

    @lazy
    def _stamps_known(self) -> dict[str, tuple[int, ...]]:
        return {}

    def _known(self, name: str) -> str:
        if name not in self.objects:
            names = sorted(self.objects)
            shown = ", ".join([*names[:NAMES_SHOWN], *(["..."] if names[NAMES_SHOWN:] else [])])
            raise QueryError(f"The world has no object '{name}'; its objects: {shown or 'none'}.")
        return name

    def _rng(self, name: str, stamp_ns: int) -> np.random.Generator:
        if self.objects[name].kind is not Kind.PLANAR:
            return UNUSED_RNG
        return np.random.default_rng([abs(stamp_ns), crc32(name.encode())])


def filters_of(objects: Mapping[str, MovableObject], settings: Settings) -> dict[str, ObjectFilter]:
    """The filters of objects by name. Raises SettingsError as ``Settings.for_object`` does."""
    return {name: filter_for(item, settings) for name, item in objects.items()}


def checked_stamp(stamp_ns: int, latest_ns: int) -> int:
    """A stamp that a world which last learnt at ``latest_ns`` can be asked for.

    Raises QueryError for one that is no whole number, too far away, or in seconds.
    """
    try:
        stamp_ns = operator.index(stamp_ns)
    except TypeError as error:
        raise QueryError(
            f"A stamp of {stamp_ns} is no whole number; stamps are in nanoseconds since 1970."
        ) from error
    if abs(stamp_ns) > FARTHEST_NS:
        raise QueryError(
            f"A stamp of {stamp_ns} ns is too far away; stamps are in nanoseconds since 1970, and "
            f"at most {FARTHEST_NS}."
        )
    if stamp_ns != 0 and stamp_ns < CALENDAR_FROM * NANOSECONDS <= latest_ns:
        raise QueryError(
            f"A stamp of {stamp_ns} ns is {stamp_ns / NANOSECONDS:g} s from 1970; stamps are in "
            "nanoseconds."
        )
    return stamp_ns


def _stamp(belief: ObjectBelief | None) -> int:
    return 0 if belief is None else belief.stamp_ns or 0


@dataclass(frozen=True, eq=False)
class Snapshot(Mapping[str, ObjectBelief]):
    """What a world believes at one moment: ``snapshot["door_07"]`` is an object's belief.

    Beliefs are predicted when they are asked for. Two snapshots are equal if they are the same one.
    """

    __eq__, __hash__ = object.__eq__, object.__hash__

    world: World = field(repr=False)
    stamp_ns: int
    newer: Mapping[str, ObjectBelief] = field(default_factory=dict, repr=False)
    _beliefs: dict[str, ObjectBelief] = field(default_factory=dict, init=False, repr=False)

    def __getitem__(self, name: str) -> ObjectBelief:
        """An object's belief. Raises QueryError for an unknown object."""
        belief = self._beliefs.get(name)
        if belief is None:
            belief = self._beliefs[name] = self.world.belief(
                name, self.stamp_ns, self.newer.get(name)
            )
        return belief

    def get(self, name: str, default: Any = None, /) -> Any:
        """An object's belief, or the default for an unknown object."""
        if name not in self:
            return default
        return self[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.world.objects)

    def __len__(self) -> int:
        return len(self.world.objects)

    def __contains__(self, name: object) -> bool:
        return name in self.world.objects

    @property
    def beliefs(self) -> dict[str, ObjectBelief]:
        """The beliefs of all objects by name."""
        return {name: self[name] for name in self}

    def blocked(self, path: ArrayLike, robot_radius: float) -> Blockage:
        """How probably a round robot on a polyline (n, 2) m meets something movable, and what.

        Raises QueryError for a path or a radius that is none.
        """
        return blocked(self.beliefs, path, robot_radius)

    def occupied(self, area: ArrayLike, robot_radius: float | None = None) -> Occupancy:
        """How probably something stands in an area, known to the building or not.

        An area is a polygon (n, 2) m or, with a ``robot_radius``, a path of a round robot. What
        drives with ``--grid`` saw ages: ``known`` is the share of the area of which anything still
        is. Walls don't count. Raises QueryError for an area that is none.
        """
        return occupied(self.beliefs, self.world.floors, area, robot_radius, self.stamp_ns)
