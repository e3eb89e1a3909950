"""Many recorded logs in, one folder out: what each came to, and tables over all of them."""

from objstate.batch.batch import BatchResult, run_batch
from objstate.batch.events import Began, Connected, Ended, Event, Progressed, Waiting
from objstate.batch.leftover import Leftover
from objstate.batch.options import BatchOptions
from objstate.batch.request import Requested, gather

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
