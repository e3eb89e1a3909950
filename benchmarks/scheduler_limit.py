"""How many logs a second one Dask scheduler can hand out: ``python benchmarks/scheduler_limit.py [TASKS] [WORKERS]``

Submits empty tasks as ``objstate batch`` submits logs, one future each, to a scheduler and some worker
processes on this machine, and prints the tasks a second from the first submission to the last
result. On few cores the workers take their share of them: a lower bound.
"""

from __future__ import annotations

import logging
import sys
import time

from distributed import Client, LocalCluster, as_completed


def nothing(number: int) -> int:
    """An empty task."""
    return number


def main(tasks: int, workers: int) -> None:
    """Measure and print."""
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=8,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        client.gather(client.map(nothing, range(100), pure=False))
        began = time.monotonic()
        futures = [client.submit(nothing, n, key=f"log-{n}", pure=False) for n in range(tasks)]
        for future in as_completed(futures):
            future.release()
        took = time.monotonic() - began
    print(f"{tasks} empty tasks on {workers} workers: {tasks / took:.0f} a second")


if __name__ == "__main__":
    main(*(int(each) for each in sys.argv[1:3] or (10_000, 2)))
