"""The process in which one log at a time is run: ``python -m objstate.batch.worker FD``.

Everything comes over one connection. When that closes, because the parent has died or
wants no more, the process ends at once, also in the middle of a log.
"""

from __future__ import annotations

import os
import queue
import resource
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any

from objstate.errors import ObjstateError
from objstate.outages import outage_of

REPORT_EVERY = 0.2  # s between two words on how far a log is


def main(descriptor: int) -> None:
    """Serve jobs until the connection closes."""
    connection = Connection(descriptor)
    inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(connection, inbox), daemon=True).start()
    function, context = inbox.get()
    while True:
        job = inbox.get()
        connection.send(("began",))
        connection.send(_answer(function, context, job, _reporter(connection)))


def _listen(connection: Connection, inbox: queue.SimpleQueue[Any]) -> None:
    try:
        while True:
            inbox.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _reporter(connection: Connection) -> Any:
    """A function that passes on the share and the seconds done, but not too often."""
    last = -REPORT_EVERY

    def report(share: float, seconds: float) -> None:
        nonlocal last
        if time.monotonic() - last >= REPORT_EVERY:
            last = time.monotonic()
            connection.send(("progress", share, seconds))

    return report


def _answer(function: Any, context: Any, job: Any, report: Any) -> tuple[str, str | None, float]:
    """Whether the job was done, else why not; and the largest memory so far, MB."""
    status, reason = "done", None
    try:
        function(context, job, report)
    except MemoryError:
        status, reason = "failed", "Out of memory; use fewer workers, or ask for fewer samples."
    except Exception as error:  # a fault in one log must not cost the others
        outage = outage_of(error)
        if outage is not None:
            status, reason = "interrupted" if outage.transient else "prevented", str(outage)
        elif isinstance(error, ObjstateError | OSError):
            status, reason = "failed", str(error)
        else:
            status, reason = "failed", _bug(error)
    return status, reason, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _bug(error: Exception) -> str:
    where = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{os.path.basename(where.filename)}:{where.lineno}"
    return f"A bug in objstate: {type(error).__name__}: {error} ({place}); please report it."


if __name__ == "__main__":
    main(int(sys.argv[1]))
