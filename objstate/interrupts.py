"""Ctrl-C ends waits."""

from __future__ import annotations

import signal


def heed_interrupts() -> None:
    """Let Ctrl-C end waits again; to be called before one that may be long.

    polars handles SIGINT, from its import on, and has the system go on with waits after it
    (``SA_RESTART``). A wait for a lock or a queue then outlasts Ctrl-C until its event comes.
    """
    signal.siginterrupt(signal.SIGINT, True)
