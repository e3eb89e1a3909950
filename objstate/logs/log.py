"""From a recorded log to records in time order, in one pass."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import islice

import numpy as np

from objstate.errors import LogError
from objstate.geometry import FloatArray
from objstate.logs.containers import Messages, Paths, as_paths
from objstate.logs.conversion import Converter
from objstate.logs.messages import Container
from objstate.logs.notices import Notices
from objstate.logs.odometry import place_in_odometry
from objstate.logs.ordering import Arrival, in_time_order
from objstate.logs.roles import find_roles
from objstate.logs.span import EPOCH_FROM, LATEST, stamp_at
from objstate.records import Odometry, Record, Scan

# records read at once, which takes half the time of reading each on demand
READ_AHEAD = 64

Ordering = Callable[[Iterable[Arrival], Notices], Iterator[Record]]


class Log:
    """One drive's records in time order, to be iterated over.

    ``ordered`` makes records of what arrives. A drive that ``goes_on`` can't be read ahead.
    """

    def __init__(
        self,
        messages: Container,
        topics: Collection[str] | None,
        mounts: Mapping[str, FloatArray],
        clock_offsets: Mapping[str, float],
        span: tuple[float | None, float | None],
        notices: Notices,
        ordered: Ordering,
        goes_on: bool = False,
    ) -> None:
        self._messages, self._ordered, self._goes_on = messages, ordered, goes_on
        self._sorted = messages  # in recorded order, once it is read
        self._mounts = mounts
        self._clock_offsets = clock_offsets
        self._mountings: Mapping[str, FloatArray] = {}
        self._span = span
        self._notices = notices
        self._passed: Counter[str] = Counter()
        types = {topic: kind.name for topic, kind in messages.topics().items()}
        self._roles = find_roles(types, topics, notices)
        notices.keep()

    def __iter__(self) -> Iterator[Record]:
        """The records. Raises LogError where no scan can be used, in the end at the latest."""
        self._notices.rewind()
        self._passed.clear()
        converter = Converter(
            self._messages,
            self._roles,
            self._mounts,
            self._clock_offsets,
            self._notices,
            self._span[1],
            goes_on=self._goes_on,
        )
        self._mountings, self._sorted = converter.mountings, converter.messages
        records = self._ordered(converter.arrivals(), self._notices)
        for record in _within(records, *self._span):
            self._passed[type(record).__name__] += 1
            yield record
        if not self._passed[Scan.__name__]:
            raise LogError(self._no_scans())

    @property
    def warnings(self) -> list[str]:
        """What its user should know, each fact once; grows while the log is read."""
        return self._notices.listed()

    @property
    def mountings(self) -> dict[str, FloatArray]:
        """Transforms (4, 4) in ``base_link``, as last used, of the lasers read so far by frame."""
        return dict(self._mountings)

    @property
    def share(self) -> float:
        """Share of the log read so far, 0..1."""
        return self._sorted.share

    @property
    def counts(self) -> dict[str, int]:
        """Records so far by class name, and what was dropped by the reason."""
        return dict(self._passed) | dict(self._notices.dropped)

    def _no_scans(self) -> str:
        reasons = "; ".join(self.warnings)
        if self._span == (None, None):
            span, cure = "", "Record laser scans and odometry"
        else:
            span = " between the start and the end asked for"
            cure = "See with `objstate inspect` from when to when it goes"
        return f"The log holds no scan that can be used{span}. {reasons or cure}."


def open_log(
    paths: Paths,
    topics: Collection[str] | None = None,
    mounts: Mapping[str, FloatArray] | None = None,
    start: float | None = None,
    end: float | None = None,
    clock_offsets: Mapping[str, float] | None = None,
) -> Log:
    """Open a recorded drive, of one file or bag folder or of several parts.

    ``topics`` restricts what is read; tf is always read. ``mounts`` gives, or overrides, transforms
    (4, 4) of lasers in ``base_link`` by frame. ``start`` and ``end`` are seconds from the log's
    start, or since 1970 from 1e8 on. The log starts with its first odometry or scan.
    ``clock_offsets`` gives by frame the seconds by which a laser's stamps are ahead of the
    odometry's; they are subtracted.

    Raises LogError for a path that is missing or of no known format, for a topic that isn't there
    or of no use, for a clock offset, start or end that is no number of seconds, for an end before
    the start, and for a log without scans or odometry; TypeError for mounts or clock offsets that
    aren't given by frame. The records raise LogError before the first one where a laser's mounting
    is nowhere in the log.
    """
    check_by_frame(mounts=mounts or {}, clock_offsets=clock_offsets or {})
    for frame, ahead in (clock_offsets or {}).items():
        if not _is_finite(ahead):
            raise LogError(
                f"The clock of the laser '{frame}' can't be set back by {ahead!r} s; give a finite "
                "number."
            )
    _check_span(start, end)
    notices = Notices()
    messages = Messages(as_paths(paths), None, notices)
    span = start, end
    return Log(messages, topics, mounts or {}, clock_offsets or {}, span, notices, _recorded)


def check_by_frame(**given: object) -> None:
    """Raise TypeError for what isn't given for each laser by its frame."""
    for name, values in given.items():
        if not isinstance(values, Mapping):
            raise TypeError(
                f"{name} is a {type(values).__name__}; give a dict of lasers' frames, as {{'laser': "
                "...}."
            )


def _check_span(start: float | None, end: float | None) -> None:
    for name, seconds in (("start", start), ("end", end)):
        if seconds is not None and not (_is_finite(seconds) and 0.0 <= seconds < LATEST):
            raise LogError(
                f"The {name} of what is read is {seconds!r}; give seconds from the log's start, 0 "
                "or more, or since 1970. Nanoseconds are divided by 1e9."
            )
    if start is not None and end is not None and end < start and _are_alike(start, end):
        raise LogError(f"The end, {end:g} s, is before the start, {start:g} s; exchange them.")


def _are_alike(start: float, end: float) -> bool:
    """Whether both count from the log's start, or both are of the calendar."""
    return (start < EPOCH_FROM) == (end < EPOCH_FROM)


def _is_finite(number: object) -> bool:
    return isinstance(number, int | float | np.number) and math.isfinite(number)


def _recorded(arrivals: Iterable[Arrival], notices: Notices) -> Iterator[Record]:
    return _ahead(place_in_odometry(in_time_order(arrivals, notices), notices))


def _ahead(records: Iterable[Record]) -> Iterator[Record]:
    """The records, read several at a time, which uses the processor's caches better."""
    records = iter(records)
    while block := list(islice(records, READ_AHEAD)):
        yield from block


def _within(records: Iterable[Record], start: float | None, end: float | None) -> Iterator[Record]:
    origin_ns: int | None = None
    for record in records:
        if origin_ns is None and isinstance(record, Odometry | Scan):
            origin_ns = record.stamp_ns
        if start is not None and _is_before(record, start, origin_ns):
            continue
        if end is not None and not _is_before(record, end, origin_ns, or_at=True):
            return
        yield record


def _is_before(record: Record, seconds: float, origin_ns: int | None, or_at: bool = False) -> bool:
    """Whether a record comes before a time, given from the origin or of the calendar."""
    if origin_ns is None and seconds < EPOCH_FROM:
        return seconds > 0  # a belief from before the log's start
    limit_ns = stamp_at(seconds, origin_ns or 0)
    return record.stamp_ns < limit_ns or (or_at and record.stamp_ns == limit_ns)
