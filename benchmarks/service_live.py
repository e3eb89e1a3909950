"""From a scan's arrival to its beliefs on the stream, with several robots that drive at once.

python benchmarks/service_live.py [ROBOTS] [SECONDS]: each robot is a Foxglove server that sends the
sample log in real time. Delays count from when a robot sends a scan to when a listener has what the
scan changed.
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import struct
import sys
import tempfile
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from service_setup import ROOT, Running, free_port, serving

LOG, BUILDING = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
WARMING_S = 15.0  # until processes run and robots are localized


def drive(port: int, sent: Connection, seconds: float) -> None:
    """Be a robot; tells when scans of which stamps were sent."""
    import foxglove
    from foxglove import Channel, Schema

    from objstate.logs import open_messages

    server = foxglove.start_server(name="robot", port=port)
    messages, channels = list(open_messages(LOG)), dict[str, Channel]()
    for message in messages:
        if message.topic not in channels:
            text = message.definition.encode()
            schema = Schema(name=message.type, encoding="ros2msg", data=text)
            channels[message.topic] = Channel(message.topic, schema=schema, message_encoding="cdr")
    time.sleep(5.0)  # the service connects
    begun, first_ns, times = time.monotonic(), messages[0].recorded_ns, {}
    for message in messages:
        due = (message.recorded_ns - first_ns) / 1e9
        if due > seconds:
            break
        time.sleep(max(0.0, due - (time.monotonic() - begun)))
        if message.type.endswith("LaserScan"):
            high, low = struct.unpack_from("<II", message.data, 4)
            times[high * 10**9 + low] = time.monotonic()
        channels[message.topic].log(message.data, log_time=message.recorded_ns)
    sent.send(times)
    time.sleep(2.0)
    server.stop()


async def listen(service: Running, seconds: float) -> dict[str, dict[int, float]]:
    """When beliefs of each scan came, by robot and stamp."""
    reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
    head = f"GET /v1/stream HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\n"
    writer.write(f"{head}Authorization: Bearer {service.token}\r\n\r\n".encode())
    heard: dict[str, dict[int, float]] = {}
    kind, end = "", time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        try:
            line = (await asyncio.wait_for(reader.readline(), left)).decode().strip()
        except TimeoutError:
            break
        if line.startswith("event: "):
            kind = line[7:]
        elif line.startswith("data: ") and kind == "belief":
            told = json.loads(line[6:])
            if told.get("live"):
                own = heard.setdefault(told["robot"], {})
                own.setdefault(told["stamp_ns"], time.monotonic())
    return heard


def delays(sent: Mapping[int, float], heard: Mapping[int, float], after: float) -> list[float]:
    """Seconds of each scan that was sent after a moment."""
    return [
        came - sent[stamp] for stamp, came in heard.items() if stamp in sent and sent[stamp] > after
    ]


def main(robots: int, seconds: float) -> None:
    """Measure, and print a line."""
    ports = [free_port() for _ in range(robots)]
    pipes = [multiprocessing.Pipe() for _ in ports]
    processes = [
        multiprocessing.Process(target=drive, args=(port, theirs, seconds))
        for port, (_, theirs) in zip(ports, pipes, strict=True)
    ]
    for process in processes:
        process.start()
    begun = time.monotonic()
    more = [f"--foxglove=r{k}=ws://127.0.0.1:{port}" for k, port in enumerate(ports)]
    with tempfile.TemporaryDirectory() as folder, serving(BUILDING, Path(folder), *more) as service:
        heard = asyncio.run(listen(service, seconds + 8.0))
        found = []
        for k, (ours, _) in enumerate(pipes):
            found += delays(ours.recv(), heard.get(f"r{k}", {}), begun + WARMING_S)
        median, p95, largest = 1000.0 * np.percentile(found, [50, 95, 100])
        print(
            f"{robots} robots: {len(found)} scans with news; median {median:.0f} ms, p95 "
            f"{p95:.0f} ms, largest {largest:.0f} ms; service {service.memory_mb:.0f} MB"
        )
    for process in processes:
        process.join()


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 4, float(sys.argv[2]) if sys.argv[2:] else 60.0)
