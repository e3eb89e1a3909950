"""From one log format to another: every message that the new one can hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from objstate.errors import LogError
from objstate.logs import Message, open_messages
from objstate.recording.logs import LogWriter, open_log_writer


@dataclass(frozen=True)
class ConversionResult:
    """What came over, and what did not."""

    counts: Mapping[str, int]  # messages passed on, by topic
    warnings: tuple[str, ...]


def convert(
    source: str | Path,
    target: str | Path,
    *,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
) -> ConversionResult:
    """Write the log ``source`` (any format that is read) as ``target``.

    ``format`` is a name in ``objstate.recording.logs.FORMATS``, or follows from the
    ending of ``target``. Raises LogError and ResultError; messages that the format
    can't hold, or that are damaged, are named in the warnings.
    """
    passed: Counter[str] = Counter()
    left_out: Counter[str] = Counter()
    messages = open_messages(source)
    with open_log_writer(target, format, overwrite=overwrite) as writer:
        for message in messages:
            reason = _refusal(message, writer)
            if reason is not None:
                left_out[f"messages of {message.topic} ({message.type}): {reason}"] += 1
            elif _pass_on(message, writer):
                passed[message.topic] += 1
    lost = [f"{count} {what}." for what, count in sorted(left_out.items())]
    return ConversionResult(
        dict(sorted(passed.items())), (*messages.warnings, *lost, *writer.warnings)
    )


def _refusal(message: Message, writer: LogWriter) -> str | None:
    """Why a message can't come over, or None if it can."""
    try:
        message.cdr()
        return writer.refusal(message.type, message.definition)
    except LogError as error:
        return str(error).rstrip(".")


def _pass_on(message: Message, writer: LogWriter) -> bool:
    """Write one message; False if the format has no word for just this one."""
    return writer.write(
        message.topic, message.type, message.recorded_ns, message.cdr(), message.definition
    )
