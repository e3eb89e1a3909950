"""How a batch is to go."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_TIME_LIMIT = 3600.0  # s for one log


@dataclass(frozen=True)
class BatchOptions:
    """Where and how logs are run; nothing of it changes their results."""

    workers: int = 1  # processes of this machine
    scheduler: str | None = None  # address or scheduler file of Dask: run there instead
    time_limit: float | None = DEFAULT_TIME_LIMIT  # s for one log; None: as long as it takes
    retry_failed: bool = False  # run logs again that did not succeed before
    overwrite: bool = False  # run logs again whose results were made otherwise than asked now
