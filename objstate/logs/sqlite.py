"""The sqlite3 storage of rosbag2: one ``.db3`` file.

Rows are read in the order in which they were written, by their number, so that a
damaged page can be stepped over.
"""

from __future__ import annotations

import sqlite3
from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing
from pathlib import Path

from objstate.errors import LogError
from objstate.logs.decompression import MOST_UNPACKED, unpack_message
from objstate.logs.definitions import CDR, MSG, MessageType
from objstate.logs.messages import Message
from objstate.logs.notices import Notices

ALL_ROWS = "SELECT rowid, topic_id, timestamp, data FROM messages"
TOPICS_OF_ROWS = "SELECT topic_id FROM messages"
ONE_ROW = f"{ALL_ROWS} WHERE rowid = ?"
ROWS_AFTER = f"{ALL_ROWS} WHERE rowid > ? ORDER BY rowid"

MAGIC = b"SQLite format 3\x00"

TABLES = ("topics", "messages", "message_definitions")

# what a damaged file raises: SQLite also runs out of memory that it would need for a damaged
# length, and a message of its own that quotes what isn't text can't be decoded
FAULTS = (sqlite3.Error, OverflowError, UnicodeDecodeError, MemoryError)

# steps of SQLite's machine from one row to the next: reading takes a dozen, and sorting a million
# rows that aren't in order some ten millions, in a second
MOST_STEPS = 200_000_000
STEPS_AT_ONCE = 1_000_000
# rows; a page of 4096 bytes holds no more of the shortest messages
LOOKED_UP = 200
# rows without anything new: more than fit on a page, so that a damaged page tree is a cycle
MOST_REPEATS = 100_000

# rows; no bag has more, so that a search for readable rows ends there
MOST_ROWS = 2**40


class SqliteFile:
    """A bare sqlite3 file of rosbag2, of any ROS 2 release."""

    def __init__(self, path: Path, notices: Notices) -> None:
        self.path = path
        self._notices = notices
        self._last_row = 0
        self._rows = 1

    @property
    def share(self) -> float:
        """How much of the file the latest iteration has read, 0..1."""
        return min(self._last_row / self._rows, 1.0)

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic."""
        with closing(self._connect()) as database:
            return dict(self._topics(database).values())

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics that hold messages, read without their content."""
        found: set[str] = set()
        with closing(self._connect()) as database:
            known = self._topics(database)
            try:
                for (number,) in database.execute(TOPICS_OF_ROWS):
                    if number in known:
                        found.add(known[number][0])
                    if found.issuperset(topics):
                        break
            except FAULTS:
                return topics
        return found.intersection(topics)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages in the order in which they were written, all or those of some topics."""
        with closing(self._connect()) as database:
            known = self._topics(database)
            self._rows = max(self._count(database), 1)
            for number, recorded_ns, data in self._readable_rows(database, known.keys()):
                topic, message_type = known.get(number, ("", None))
                if message_type is not None and (topics is None or topic in topics):
                    yield Message(topic, message_type, recorded_ns, unpack_message(data))

    def _readable_rows(
        self, database: sqlite3.Connection, known: Collection[int]
    ) -> Iterator[tuple[int, int, bytes]]:
        """All readable rows of the messages' table."""
        patience = Patience(database)
        # a damaged row, of no topic that is known, may have the number of a whole one
        seen = {True: Seen(), False: Seen()}
        last, step = 0, 0
        while True:
            try:
                # from the first page on; looking a row up may meet damage that lies elsewhere
                rows = (
                    database.execute(ROWS_AFTER, (last + step,))
                    if step
                    else database.execute(ALL_ROWS)
                )
                repeats = 0
                for row, topic, recorded_ns, data in rows:
                    is_whole = isinstance(recorded_ns, int) and isinstance(data, bytes)
                    if isinstance(row, int) and is_whole and seen[topic in known].add(row):
                        patience.renew()
                        last, step, repeats = row, 0, 0
                        self._last_row = last
                        yield topic, recorded_ns, data
                        continue
                    repeats += 1
                    if repeats > MOST_REPEATS:
                        raise sqlite3.DatabaseError("its pages lead in circles")
                    if not is_whole:
                        self._notices.add(f"{self.path.name}: a damaged message was left out")
                return
            except FAULTS as error:
                if not step:
                    self._notices.add(
                        f"{self.path.name} is damaged after message {last} ({error}): "
                        "what can be read is used"
                    )
                    yield from self._looked_up(database, last, seen[True])
                step = max(1, 2 * step)
                if step > MOST_ROWS or last + step >= 2**63:
                    return

    def _looked_up(
        self, database: sqlite3.Connection, last: int, seen: Seen
    ) -> Iterator[tuple[int, int, bytes]]:
        """Whole rows just after a damaged place, by number: others of its page may be intact."""
        for number in range(last + 1, last + 1 + LOOKED_UP):
            try:
                found = database.execute(ONE_ROW, (number,)).fetchone()
            except FAULTS:
                continue
            if found is None:
                continue
            _, topic, recorded_ns, data = found
            if isinstance(recorded_ns, int) and isinstance(data, bytes) and seen.add(number):
                yield topic, recorded_ns, data

    def _topics(self, database: sqlite3.Connection) -> dict[int, tuple[str, MessageType]]:
        Patience(database)
        try:
            self._check_tables(database)
            definitions = self._definitions(database)
            rows = database.execute("SELECT rowid, name, type, serialization_format FROM topics")
            topics = {}
            for number, topic, name, wire in rows:
                if not (
                    isinstance(number, int) and isinstance(topic, str) and isinstance(name, str)
                ):
                    self._notices.once(f"{self.path.name}: a damaged topic was left out")
                elif wire == CDR:
                    language, text = definitions.get(name, (MSG, ""))
                    topics[number] = (topic, MessageType(name, CDR, text, language))
        except FAULTS as error:
            raise LogError(
                f"{self.path} is no rosbag2 file, or its list of topics is damaged ({error}); "
                "record again, or try `sqlite3 FILE .recover`."
            ) from error
        return topics

    def _check_tables(self, database: sqlite3.Connection) -> None:
        """Raises LogError for views in place of tables, whose rows may be endless."""
        names = ", ".join(f"'{name}'" for name in TABLES)
        for name, kind, sql in database.execute(
            f"SELECT name, type, sql FROM sqlite_master WHERE lower(name) IN ({names})"
        ):
            is_table = kind == "table" and not str(sql).upper().startswith("CREATE VIRTUAL")
            columns = database.execute("SELECT hidden FROM pragma_table_xinfo(?)", (name,))
            if not is_table or any(hidden for (hidden,) in columns):
                raise LogError(
                    f"{self.path}: '{name}' is no plain table, as a rosbag2 file has it; "
                    "record again, or copy its rows into one."
                )

    def _definitions(self, database: sqlite3.Connection) -> dict[str, tuple[str, str]]:
        """Language and text of the definitions by type name; bags before ROS 2 Iron carry none."""
        try:
            rows = database.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            ).fetchall()
        except FAULTS as error:
            if "no such table" not in str(error):
                self._notices.once(
                    f"{self.path.name}: its definitions of types are damaged ({error})"
                )
            return {}
        return {
            name: (language, text)
            for name, language, text in rows
            if all(isinstance(each, str) for each in (name, language, text))
        }

    def _count(self, database: sqlite3.Connection) -> int:
        """The number of the last row, as far as a damaged file is readable."""
        try:
            (last,) = database.execute("SELECT max(rowid) FROM messages").fetchone()
        except FAULTS:
            return 1
        return last if isinstance(last, int) and last > 0 else 1

    def _connect(self) -> sqlite3.Connection:
        # A recorder that crashed leaves a write-ahead log beside the file; only a
        # connection that takes part in locking reads it.
        has_wal = self.path.with_name(self.path.name + "-wal").exists()
        mode = "mode=ro" if has_wal else "mode=ro&immutable=1"
        try:
            database = sqlite3.connect(f"{self.path.resolve().as_uri()}?{mode}", uri=True)
            database.text_factory = lambda raw: raw.decode(errors="replace")
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_UNPACKED)
            database.execute("PRAGMA trusted_schema = OFF")
            # SQLite refuses a file that is shorter than its header says, except to those who
            # might be about to repair it.
            database.execute("PRAGMA writable_schema = ON")
        except FAULTS as error:
            raise LogError(
                f"{self.path} can't be opened as a rosbag2 file ({error}); record again, or try "
                "`sqlite3 FILE .recover`."
            ) from error
        return database


class Patience:
    """Ends a query that yields no row."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._steps = 0
        database.set_progress_handler(self._is_over, STEPS_AT_ONCE)

    def renew(self) -> None:
        """A row has come."""
        self._steps = 0

    def _is_over(self) -> bool:
        self._steps += STEPS_AT_ONCE
        return self._steps > MOST_STEPS


class Seen:
    """Row numbers that have come up, as stretches: an undamaged file makes one."""

    def __init__(self) -> None:
        self._starts: list[int] = []
        self._ends: list[int] = []  # included

    def add(self, number: int) -> bool:
        """Whether the number is new."""
        after = bisect_right(self._starts, number)
        if after and number <= self._ends[after - 1]:
            return False
        if after and number == self._ends[after - 1] + 1:
            self._ends[after - 1] = number
        else:
            self._starts.insert(after, number)
            self._ends.insert(after, number)
        return True
