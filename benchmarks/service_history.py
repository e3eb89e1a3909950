"""Questions about the past to a service with much history: python benchmarks/service_history.py [COUNT]

A day of a building of 100 doors in which COUNT beliefs (a million) were learnt. Prints how long
answers take, each kind of question by itself.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from service_setup import many_doors, serving
from sqlalchemy import insert

from objstate.client import Client
from objstate.world.codec import pack_belief
from objstate.world.schema import BELIEFS
from objstate.world.store import open_store

DOORS, DAY_NS, AT_ONCE, ASKED = 100, 24 * 3600 * 10**9, 20_000, 300


def fill(folder: Path, count: int) -> None:
    """Give the world in a folder a history, of the beliefs that it has."""
    store = open_store(folder / "world.db")
    world, until_ns = store.load(), time.time_ns()
    packed = {name: pack_belief(world.history(name)[-1]) for name in world.objects}
    step_ns, names = DAY_NS // count, sorted(packed)
    with store._database.writing() as connection:
        for first in range(0, count, AT_ONCE):
            rows = []
            for k in range(first, min(first + AT_ONCE, count)):
                name, stamp_ns = names[k % DOORS], until_ns - (count - k) * step_ns
                row = {"object": name, "stamp_ns": stamp_ns, "drive": 1}
                rows.append(row | {"last_observed_ns": stamp_ns, "belief": packed[name]})
            connection.execute(insert(BELIEFS), rows)


def main(count: int) -> None:
    """Measure, and print a line for each kind of question."""
    rng = random.Random(0)
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        urdf = many_doors(folder, DOORS)
        fill(folder, count)
        with serving(urdf, folder) as service:
            print(f"{count} beliefs; {service.memory_mb:.0f} MB after the start")
            with Client(service.url, service.token) as client:
                now = time.time_ns()

                def past() -> int:
                    return now - rng.randrange(DAY_NS)

                def door() -> str:
                    return f"door_{rng.randrange(DOORS)}"

                kinds = {
                    "an object now": lambda: client.object(door()),
                    "an object, in the past": lambda: client.object(door(), past()),
                    "a passage, in the past": lambda: client.passage(door(), 0.6, 0.9, past()),
                    "all 100 objects, in the past": lambda: client.objects(past()),
                    "the newest 200 of a history": lambda: client.history(door()),
                }
                for kind, ask in kinds.items():
                    delays = []
                    for _ in range(ASKED):
                        began = time.perf_counter()
                        ask()
                        delays.append(1000.0 * (time.perf_counter() - began))
                    median, p99 = np.percentile(delays, [50, 99])
                    print(f"{kind}: median {median:.1f} ms, p99 {p99:.1f} ms")
            print(f"{service.memory_mb:.0f} MB in the end")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 1_000_000)
