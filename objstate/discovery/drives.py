"""The logs that are learnt from: each drive once, whatever its files are called."""

from __future__ import annotations

from collections.abc import Container, Sequence
from pathlib import Path

from objstate.run import RunOptions
from objstate.run.inputs import describe_log, log_identity


def distinct_logs(
    logs: Sequence[str | Path], run: RunOptions, known: Container[str] = ()
) -> tuple[dict[Path, str], list[str]]:
    """The digest of each log whose content is new, and a warning for each that was given before.

    Logs whose digests are ``known`` are left out without one.
    """
    digests: dict[Path, str] = {}
    warnings = []
    for log in map(Path, logs):
        digest = log_identity(describe_log(log), run)
        first = next((path for path, other in digests.items() if other == digest), None)
        if first is not None:
            warnings.append(f"{log} holds the same as {first}, and counts once with it.")
        elif digest not in known:
            digests[log] = digest
    return digests, warnings
