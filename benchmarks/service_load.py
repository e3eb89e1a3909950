"""Requests at a given rate, and many listeners, with little work on the side that asks."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from service_setup import Running

CONNECTIONS = 8  # kept open, as planners do
WARMING_S = 2.0  # whose answers don't count
SILENCE_S = 30.0  # after which listeners count as through


@dataclass(frozen=True)
class Delays:
    """What a load came to; delays count from when a request was due, in ms."""

    asked: int
    failed: int
    median: float
    p99: float
    largest: float
    per_second: float
    processor: float  # ms of the service for each request


async def at_rate(
    service: Running, target: Callable[[int], str], rate: float, seconds: float
) -> Delays:
    """Ask so many times a second, whether or not earlier answers have come."""
    due: asyncio.Queue[tuple[int, float]] = asyncio.Queue()
    delays: list[float] = []
    failed = 0

    async def ask() -> None:
        nonlocal failed
        reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
        while True:
            number, when = await due.get()
            writer.write(_request("GET", target(number), service))
            status, _ = await _answer(reader)
            failed += status != 200
            if when - began >= WARMING_S:
                delays.append(time.perf_counter() - when)
            due.task_done()

    tasks = [asyncio.create_task(ask()) for _ in range(CONNECTIONS)]
    began, used = time.perf_counter(), service.processor_s
    for number in range(round(rate * (seconds + WARMING_S))):
        when = began + number / rate
        await asyncio.sleep(max(0.0, when - time.perf_counter()))
        due.put_nowait((number, when))
    await due.join()
    elapsed = time.perf_counter() - began - WARMING_S
    processor = 1000.0 * (service.processor_s - used) / (number + 1)
    for task in tasks:
        task.cancel()
    told = 1000.0 * np.array(delays)
    median, p99, largest = np.percentile(told, [50, 99, 100]).tolist()
    return Delays(len(delays), failed, median, p99, largest, len(delays) / elapsed, processor)


@dataclass(frozen=True)
class Heard:
    """What listeners heard of events that were caused one after the other."""

    listeners: int
    events: int
    complete: int  # listeners that heard all of them, each once and in order
    median: float  # ms, from the request that caused an event to its arrival at a listener
    p99: float


async def listened(
    service: Running,
    listeners: int,
    events: int,
    pause: float,
    cause: Callable[[int], tuple[str, object]],
) -> Heard:
    """Let many listen while something happens again and again; ``cause`` tells what to post."""
    sent: dict[str, float] = {}
    heard: list[list[tuple[str, float]]] = [[] for _ in range(listeners)]

    async def listen(which: int) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
        writer.write(_request("GET", "/v1/stream", service))
        ready.release()
        kind = ""
        while line := (await reader.readline()).decode().strip("\r\n"):
            pass  # the head
        while raw := await reader.readline():
            line = raw.decode().strip("\r\n")
            if line.startswith("event: "):
                kind = line[7:]
            elif line.startswith("data: ") and kind == "belief":
                heard[which].append((json.loads(line[6:])["object"], time.perf_counter()))

    ready = asyncio.Semaphore(0)
    tasks = []
    for which in range(listeners):
        tasks.append(asyncio.create_task(listen(which)))
        await ready.acquire()
    await asyncio.sleep(3.0)
    reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
    order = []
    for number in range(events):
        path, body = cause(number)
        name = path.split("/")[3]
        order.append(name)
        sent[name] = time.perf_counter()
        writer.write(_request("POST", path, service, json.dumps(body).encode()))
        status, _ = await _answer(reader)
        assert status == 201, status
        await asyncio.sleep(pause)
    deadline = time.monotonic() + SILENCE_S
    while any(len(each) < events for each in heard) and time.monotonic() < deadline:
        await asyncio.sleep(0.1)
    for task in tasks:
        task.cancel()
    complete = sum([name for name, _ in each] == order for each in heard)
    delays = [1000.0 * (when - sent[name]) for each in heard for name, when in each]
    median, p99 = np.percentile(delays, [50, 99]).tolist()
    return Heard(listeners, events, complete, median, p99)


def _request(method: str, path: str, service: Running, body: bytes = b"") -> bytes:
    head = f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\n"
    head += f"Authorization: Bearer {service.token}\r\nContent-Length: {len(body)}\r\n"
    return f"{head}\r\n".encode() + body


async def _answer(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    """Status and body of an answer whose head says how long it is."""
    head = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
    length = next(
        int(row.split(":")[1]) for row in head.split("\r\n") if row.startswith("content-length")
    )
    return int(head.split()[1]), await reader.readexactly(length)
