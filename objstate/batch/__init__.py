"""Many recorded logs in, one folder out: what each came to, and tables over all of them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from objstate.batch.batch import BatchResult, run_batch
    from objstate.batch.events import Began, Connected, Ended, Event, Progressed, Waiting
    from objstate.batch.leftover import Leftover
    from objstate.batch.options import BatchOptions
    from objstate.batch.request import Requested, gather

_HOMES = {
    "BatchOptions": "options",
    "BatchResult": "batch",
    "Began": "events",
    "Connected": "events",
    "Ended": "events",
    "Event": "events",
    "Leftover": "leftover",
    "Progressed": "events",
    "Requested": "request",
    "Waiting": "events",
    "gather": "request",
    "run_batch": "batch",
}

__all__ = [
    "BatchOptions",
    "BatchResult",
    "Began",
    "Connected",
    "Ended",
    "Event",
    "Leftover",
    "Progressed",
    "Requested",
    "Waiting",
    "gather",
    "run_batch",
]


def __getattr__(name: str) -> Any:
    """Import a name on first use, so that a worker process loads only what its work needs."""
    if name not in _HOMES:
        raise AttributeError(f"module 'objstate.batch' has no attribute '{name}'")
    return getattr(import_module(f"objstate.batch.{_HOMES[name]}"), name)
