"""How fast a service answers, and what it keeps: ``python benchmarks/service.py``

Starts services of its own on loopback. Prints delays of passage queries at several rates over a
world of 10,000 doors, of events at 500 listeners, and what is lost when the service is killed.
``--only passages | streams | kills`` runs a part.
"""

from __future__ import annotations

import asyncio
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from service_kills import killed_under_load
from service_load import at_rate, listened
from service_setup import many_doors, serving

PARTS = ("passages", "streams", "kills")


def main(
    only: Annotated[list[str] | None, typer.Option(help="passages, streams, kills")] = None,
    doors: int = 10_000,
    rates: str = "300,1000",
    seconds: float = 20.0,
    listeners: str = "500",
    events: int = 100,
    kills: int = 50,
) -> None:
    """Measure a service."""
    wanted = set(only or PARTS)
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        if wanted & {"passages", "streams"}:
            urdf = many_doors(folder, doors)
            with serving(urdf, folder) as service:
                print(f"{doors} doors; {service.memory_mb:.0f} MB after the start")
                for rate in map(float, rates.split(",") if "passages" in wanted else ()):
                    asked = at_rate(service, lambda k: _passage(k, doors), rate, seconds)
                    print(f"passages at {rate:g}/s: {asdict(asyncio.run(asked))}")
                for count in map(int, listeners.split(",") if "streams" in wanted else ()):
                    told = listened(service, count, events, 0.1, _evidence)
                    print(f"streams: {asdict(asyncio.run(told))}")
                print(f"{service.memory_mb:.0f} MB in the end")
    if "kills" in wanted:
        with tempfile.TemporaryDirectory() as text:
            print(f"kills: {asdict(killed_under_load(Path(text), kills))}")


def _passage(number: int, doors: int) -> str:
    """Doors in an order that repeats late."""
    return f"/v1/objects/door_{number * 7919 % doors}/passage?width=0.6&length=0.9"


def _evidence(number: int) -> tuple[str, object]:
    body = {"source": "bench", "state": "open", "reliability": 0.8}
    return f"/v1/objects/door_{number}/evidence", body


if __name__ == "__main__":
    typer.run(main)
