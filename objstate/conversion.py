"""Conversion of a log: every message that the new format can hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from objstate.building.occupancy import OccupancyMap
from objstate.errors import LogError
from objstate.logs import Message, open_messages
from objstate.logs.maps import read_recorded_map
from objstate.logs.notices import Notices
from objstate.logs.ordering import in_recorded_order
from objstate.recording.logs import LogWriter, open_log_writer


@dataclass(frozen=True)
class ConversionResult:
    """The outcome of a conversion."""

    counts: Mapping[str, int]  # messages that the new log holds, by topic
    warnings: tuple[str, ...]


def recorded_map(log: str | Path, topic: str | None = None) -> OccupancyMap:
    """The last occupancy map that a log holds, of ``/map`` or another topic.

    Raises LogError, and BuildingError for a map without walls.
    """
    found = read_recorded_map(log, topic)
    name = Path(log).name.partition(".")[0]
    return OccupancyMap.of_percent(found.percent, found.resolution, found.origin, name)


def convert(
    source: str | Path,
    target: str | Path,
    *,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
) -> ConversionResult:
    """Write the log ``source`` (any readable format) as ``target``.

    ``format`` is a name in ``objstate.recording.logs.FORMATS``, or follows from the ending of
    ``target``. Messages are written in recorded order, also where ``source`` was written topic by
    topic. Raises LogError and ResultError. Messages that the format can't hold, or that are
    damaged, are named in the warnings.
    """
    left_out: Counter[str] = Counter()
    notices = Notices()
    messages = in_recorded_order(open_messages(source, notices=notices), notices)
    with open_log_writer(target, format, overwrite=overwrite) as writer:
        for message in messages.messages():
            try:
                _pass_on(message, writer)
            except LogError as error:
                reason = str(error).rstrip(".")
                left_out[f"messages of {message.topic} ({message.type}): {reason}"] += 1
    lost = [f"{count} {what}." for what, count in sorted(left_out.items())]
    return ConversionResult(writer.counts, (*notices.listed(), *lost, *writer.warnings))


def _pass_on(message: Message, writer: LogWriter) -> None:
    """Write one message.

    Raises LogError where it is damaged or of an unknown type.
    """
    definition = message.definition
    refusal = writer.refusal(message.type, definition)
    if refusal is not None:
        raise LogError(refusal)
    writer.write(message.topic, message.type, message.recorded_ns, message.cdr(), definition)
