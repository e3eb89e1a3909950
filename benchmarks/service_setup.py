"""Buildings, worlds and logs to measure a service with, and the service itself."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer

from objstate.building import load_building
from objstate.config import Dynamics, ObjectRule, Settings
from objstate.objects import filter_for
from objstate.particles import Weights
from objstate.world.store import DriveEntry, open_store

ROOT = Path(__file__).parents[1]
ABREAST, APART = 100, 3.0  # doors in a row, m between two
PATIENCE_S = 300.0  # for a service to start

DOOR = """
<link name="leaf_{k}"><collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry>
</collision></link>
<joint name="door_{k}" type="revolute"><parent link="walls"/><child link="leaf_{k}"/>
<origin xyz="{x} {y} 0"/><axis xyz="0 0 1"/><limit lower="0" upper="1.5708" effort="0" velocity="0"/>
</joint>"""
WALLS = """<?xml version="1.0"?>
<robot name="{name}"><link name="walls"><collision><origin xyz="-2 0 1"/>
<geometry><box size="0.1 20 2"/></geometry></collision></link>{doors}</robot>
"""


def many_doors(folder: Path, count: int) -> Path:
    """A building of so many doors, and its world ``world.db``, in which each was just seen."""
    places = [(APART * (k % ABREAST), APART * (k // ABREAST)) for k in range(count)]
    doors = "".join(DOOR.format(k=k, x=x, y=y) for k, (x, y) in enumerate(places))
    urdf = folder / "doors.urdf"
    urdf.write_text(WALLS.format(name="doors", doors=doors))
    building, rng = load_building(urdf), np.random.default_rng(0)
    stamp_ns, beliefs = time.time_ns(), []
    for item in building.objects.values():
        prior = filter_for(item, Settings()).prior(rng)
        off = (prior.states[:, 0] - rng.uniform(0.0, 1.5)) / 0.03
        seen = prior.with_weights(Weights.of(np.exp(-0.5 * off**2) + np.finfo(float).tiny))
        beliefs.append(replace(seen, stamp_ns=stamp_ns, last_observed_ns=stamp_ns))
    store = open_store(folder / "world.db", building)
    rate = ObjectRule(
        match="*", dynamics=Dynamics(moves_per_hour=2.0)
    )  # so that no habits are learnt
    store.add(DriveEntry("seen", stamp_ns, stamp_ns, Settings(objects=(rate,))), beliefs)
    return urdf


def short_drive(source: Path, target: Path, seconds: float, number: int) -> None:
    """The beginning of a log, whose bytes no other number has."""
    with source.open("rb") as reading, target.open("wb") as writing:
        writer, kinds, channels = Writer(writing), dict[int, int](), dict[int, int]()
        writer.start()
        writer.add_metadata("number", {"number": str(number)})
        first: int | None = None
        for kind, channel, message in make_reader(reading).iter_messages():
            first = message.log_time if first is None else first
            if message.log_time > first + round(seconds * 1e9):
                break
            if channel.id not in channels:
                known = 0 if kind is None else kinds.get(kind.id, 0)
                if kind is not None and not known:
                    known = kinds[kind.id] = writer.register_schema(
                        kind.name, kind.encoding, kind.data
                    )
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, known, dict(channel.metadata)
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        writer.finish()


@dataclass
class Running:
    """A service in a process of its own."""

    port: int
    token: str
    process: subprocess.Popen[bytes]

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def memory_mb(self) -> float:
        """Resident memory."""
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        return (
            next(int(row.split()[1]) for row in text.splitlines() if row.startswith("VmRSS")) / 1024
        )

    @property
    def processor_s(self) -> float:
        """Processor time used so far; on a shared machine a better measure than delays."""
        told = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(") ")[2].split()
        return (int(told[11]) + int(told[12])) / os.sysconf("SC_CLK_TCK")

    def kill(self) -> None:
        """End it as a power cut would."""
        self.process.kill()
        self.process.wait()


def start(urdf: Path, folder: Path, port: int | None = None, *more: str) -> Running:
    """Start a service over the world in a folder, and wait until it answers."""
    chosen, token = port or free_port(), folder / "token"
    command = [sys.executable, "-c", "from objstate.cli import main; main()", "serve"]
    command += ["--building", str(urdf), "--world", str(folder / "world.db"), "--rate", "100000"]
    with (folder / "service.log").open("ab") as log:
        process = subprocess.Popen(
            [*command, "--port", str(chosen), "--token-file", str(token), *more],
            cwd=ROOT,
            stderr=log,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline and process.poll() is None:
        with suppress(OSError):
            urllib.request.urlopen(f"http://127.0.0.1:{chosen}/health").close()
            return Running(chosen, token.read_text().strip(), process)
        time.sleep(0.05)
    raise SystemExit(f"The service didn't start; see {folder / 'service.log'}.")


@contextmanager
def serving(urdf: Path, folder: Path, *more: str) -> Iterator[Running]:
    """A service until the block ends."""
    running = start(urdf, folder, None, *more)
    try:
        yield running
    finally:
        running.kill()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
