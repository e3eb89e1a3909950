"""Recorded logs, written: one place that knows which formats there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Protocol

from objstate.errors import ResultError
from objstate.outputs import claimed, whole
from objstate.recording.bags import write_mcap, write_rosbag1, write_rosbag2, write_rosbag2_mcap
from objstate.recording.carmen import write_carmen
from objstate.recording.ros import to_cdr


class FormatWriter(Protocol):
    """What every format can do."""

    counts: Counter[str]  # messages that the log holds, by topic; complete when it is closed
    warnings: list[str]  # what was left out and why; complete when the log is closed

    def refusal(self, type_name: str, definition: str | None) -> str | None:
        """Why the format can't hold messages of a type, or None if it can."""

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        """Append one message, in the order of recording; omissions are named in the warnings."""


FORMATS: dict[str, Callable[[Path], AbstractContextManager[FormatWriter]]] = {
    "mcap": write_mcap,
    "bag": write_rosbag1,
    "rosbag2": write_rosbag2,
    "rosbag2-mcap": write_rosbag2_mcap,
    "carmen": write_carmen,
}
ENDINGS = {"mcap": ".mcap", "bag": ".bag", "rosbag2": "", "rosbag2-mcap": "", "carmen": ".log"}
FORMAT_OF_ENDING = {
    ".mcap": "mcap",
    ".bag": "bag",
    "": "rosbag2",
    ".log": "carmen",
    ".clf": "carmen",
    ".carmen": "carmen",
}


class LogWriter:
    """Writes one log, in whatever format."""

    def __init__(self, log: FormatWriter) -> None:
        self._log = log

    @property
    def counts(self) -> dict[str, int]:
        """How many messages the log holds, by topic; complete when it is closed."""
        return {topic: count for topic, count in sorted(self._log.counts.items()) if count}

    @property
    def warnings(self) -> list[str]:
        """What the format could not hold, in words; complete when the log is closed."""
        return self._log.warnings

    def refusal(self, type_name: str, definition: str | None = None) -> str | None:
        """Why the format can't hold messages of a type (``pkg/msg/Name``), or None if it can."""
        return self._log.refusal(type_name, definition)

    def write(
        self,
        topic: str,
        type_name: str,
        recorded_ns: int,
        message: Any,
        definition: str | None = None,
    ) -> None:
        """Append a message: CDR bytes, or a message object of a standard type.

        ``definition`` is the text that the type's own log carries, for types that are not standard.
        A message that the format can't hold is named in the warnings.
        """
        cdr = bytes(message) if _is_bytes(message) else to_cdr(type_name, message)
        self._log.write(topic, type_name, recorded_ns, cdr, definition)


@contextmanager
def open_log_writer(
    path: str | Path,
    format: str | None = None,  # noqa: A002
    *,
    overwrite: bool = False,
) -> Iterator[LogWriter]:
    """A log to write to, which stands at ``path`` when the block ends without an error.

    ``format`` is one of ``FORMATS``, or follows from the ending of ``path``.
    Equal messages give equal bytes. Raises ResultError.
    """
    opener = FORMATS[format_of(path, format)]
    with (
        claimed(path),
        whole(path, overwrite=overwrite, replaceable=is_log) as temporary,
        opener(temporary) as log,
    ):
        yield LogWriter(log)


def format_of(path: str | Path, format: str | None = None) -> str:  # noqa: A002
    """The name of the format to write ``path`` in. Raises ResultError where there is none."""
    if format is None:
        ending = Path(path).suffix.lower()
        if ending not in FORMAT_OF_ENDING:
            raise ResultError(
                f"No log format goes with the ending of {path}; "
                f"name one of {', '.join(FORMATS)} as its format."
            )
        return FORMAT_OF_ENDING[ending]
    if format not in FORMATS:
        raise ResultError(f"There is no log format '{format}'; choose of {', '.join(FORMATS)}.")
    return format


def is_log(path: Path) -> bool:
    """Whether ``path`` is a file, or a folder that is a ROS 2 bag: what may be overwritten."""
    return path.is_file() or (path / "metadata.yaml").is_file()


def _is_bytes(message: Any) -> bool:
    return isinstance(message, bytes | bytearray | memoryview)
