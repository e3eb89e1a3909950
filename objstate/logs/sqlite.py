"""The sqlite3 storage of rosbag2: one ``.db3`` file.

Rows are read in the order in which they were written, by their number, so that a
damaged page can be stepped over.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing
from pathlib import Path

from objstate.errors import LogError
from objstate.logs.decompression import unpack_message
from objstate.logs.definitions import CDR, MSG, MessageType
from objstate.logs.messages import Message
from objstate.logs.notices import Notices

MAGIC = b"SQLite format 3\x00"

# rows; no bag has more, so a search for readable rows beyond a damaged page ends there
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

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages in the order in which they were written, all or those of some topics."""
        with closing(self._connect()) as database:
            wanted = {
                number: topic
                for number, topic in self._topics(database).items()
                if topics is None or topic[0] in topics
            }
            self._rows = max(self._count(database), 1)
            for number, recorded_ns, data in self._readable_rows(database):
                if number in wanted:
                    topic, message_type = wanted[number]
                    yield Message(topic, message_type, recorded_ns, unpack_message(data))

    def _readable_rows(self, database: sqlite3.Connection) -> Iterator[tuple[int, int, bytes]]:
        """All rows of the messages' table; where reading fails, on from the next that can be read."""
        last, step = 0, 0
        while True:
            try:
                rows = database.execute(
                    "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ? ORDER BY id",
                    (last + step,),
                )
                for row, topic, recorded_ns, data in rows:
                    if not isinstance(row, int) or row <= last:
                        continue  # a damaged index leads round in circles
                    last, step = row, 0
                    self._last_row = last
                    if isinstance(recorded_ns, int) and isinstance(data, bytes):
                        yield topic, recorded_ns, data
                    else:
                        self._notices.add(f"{self.path.name}: a damaged message was left out")
                return
            except sqlite3.Error as error:
                if not step:
                    self._notices.add(
                        f"{self.path.name} is damaged after message {last} ({error}): "
                        "what can be read is used"
                    )
                step = max(1, 2 * step)
                if step > MOST_ROWS:
                    return

    def _topics(self, database: sqlite3.Connection) -> dict[int, tuple[str, MessageType]]:
        try:
            definitions = _definitions(database)
            rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
            topics = {}
            for number, topic, name, wire in rows:
                language, text = definitions.get(name, (MSG, ""))
                if wire == CDR:
                    topics[number] = (topic, MessageType(name, CDR, text, language))
        except sqlite3.Error as error:
            raise LogError(
                f"{self.path} is no rosbag2 file, or its list of topics is damaged ({error}); "
                "record again, or try `sqlite3 FILE .recover`."
            ) from error
        return topics

    def _count(self, database: sqlite3.Connection) -> int:
        """The number of the last row, as far as a damaged file tells it."""
        try:
            (last,) = database.execute("SELECT max(id) FROM messages").fetchone()
        except sqlite3.Error:
            return 1
        return int(last or 1)

    def _connect(self) -> sqlite3.Connection:
        # A recorder that crashed leaves a write-ahead log beside the file; only a
        # connection that takes part in locking reads it.
        has_wal = self.path.with_name(self.path.name + "-wal").exists()
        mode = "mode=ro" if has_wal else "mode=ro&immutable=1"
        try:
            database = sqlite3.connect(f"{self.path.resolve().as_uri()}?{mode}", uri=True)
            # SQLite refuses a file that is shorter than its header says, except to those who
            # might be about to repair it.
            database.execute("PRAGMA writable_schema = ON")
        except sqlite3.Error as error:
            raise LogError(f"{self.path} can't be opened as a rosbag2 file: {error}") from error
        return database


def _definitions(database: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    """Language and text of the definitions by type name; bags before ROS 2 Iron carry none."""
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master")}
    if "message_definitions" not in tables:
        return {}
    rows = database.execute(
        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    )
    return {name: (language, text) for name, language, text in rows}
