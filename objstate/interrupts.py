"""Ctrl-C interrupts waits."""

from __future__ import annotations

import signal


def heed_interrupts() -> None:
    """Let Ctrl-C interrupt waits again; to be called before a wait that may be long.

    polars handles SIGINT from its import on and makes the system resume waits after it
    (``SA_RESTART``). A wait for a lock or a queue then outlasts Ctrl-C until its event comes.
    """
    signal.siginterrupt(signal.SIGINT, True)
