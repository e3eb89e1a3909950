"""Robots that send while they drive."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from objstate.client import Client
from objstate.geometry import rpy_from_rotation
from objstate.logs import open_log, open_messages
from objstate.records import InitialPose, Odometry, Scan
from tests.cli.conftest import Run, run
from tests.service.conftest import PATIENCE_S, ROOT, Serve, Service

__all__ = ["run"]

pytest.importorskip("foxglove", reason="Foxglove's SDK is not installed")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def robot(hall: tuple[Path, Path]) -> Iterator[int]:
    """A robot that serves the drive to Foxglove, ten times as fast as it was; its port."""
    command = [sys.executable, "-m", "tests.service.replay", str(hall[1]), str(free_port()), "10"]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    yield int(process.stdout.readline())
    process.kill()
    process.wait()


def until(service: Service, path: str, good: Any) -> Any:
    """An answer as soon as it is good."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        answer = service.ask(path).json
        if good(answer):
            return answer
        time.sleep(0.1)
    raise AssertionError(f"{path} is still {answer}")


def records_of(log: Path) -> list[dict[str, Any]]:
    """A log as a robot without ROS would send it."""
    opened = open_log(log)
    records: list[dict[str, Any]] = []
    for record in opened:
        stamp = {"stamp_ns": record.stamp_ns}
        if isinstance(record, InitialPose):
            x, y, yaw = record.mean
            records.append({"type": "pose", "x": x, "y": y, "yaw": yaw} | stamp)
        elif isinstance(record, Odometry):
            x, y, yaw = record.pose
            records.append({"type": "odometry", "x": x, "y": y, "yaw": yaw} | stamp)
    for message in open_messages(log):
        if message.type.endswith("LaserScan"):
            scan = message.decode()
            records.append(
                {
                    "type": "scan",
                    "stamp_ns": scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec,
                    "frame": scan.header.frame_id,
                    "ranges": [float(r) if r < scan.range_max else None for r in scan.ranges],
                }
                | {
                    name: float(getattr(scan, name))
                    for name in ("angle_min", "angle_increment", "range_min", "range_max")
                }
            )
    for frame, mounting in opened.mountings.items():
        roll, pitch, yaw = rpy_from_rotation(mounting[:3, :3])
        x, y, z = mounting[:3, 3]
        turn = {"roll": roll, "pitch": pitch, "yaw": yaw, "x": x, "y": y, "z": z}
        first_ns = min(each["stamp_ns"] for each in records)
        records.append({"type": "mounting", "frame": frame, "stamp_ns": first_ns} | turn)
    return sorted(records, key=lambda each: (each["stamp_ns"], each["type"] == "scan"))


def scans_in(log: Path) -> int:
    return sum(isinstance(record, Scan) for record in open_log(log))


def test_a_robot_with_foxglove_bridge_gives_the_drive_that_its_log_gives(
    serve: Serve, hall: tuple[Path, Path], robot: int, taught: Service
) -> None:
    service = serve(None, "--foxglove", f"r1=ws://127.0.0.1:{robot}")
    until(service, "/v1/robots", lambda told: told["robots"][0].get("state") == "estimating")
    live = until(service, "/v1/objects/door", lambda told: told["last_observed_ns"] is not None)
    assert service.ask("/v1/drives").json["drives"] == []
    until(
        service, "/v1/robots", lambda told: told["robots"][0]["connection"].startswith("not conn")
    )
    ended = service.ask("/v1/robots/r1/end", method="POST").json["drive"]
    assert ended["robot"] == "r1"
    drive = service.until(ended["id"], "done", "failed")
    assert drive["summary"]["counts"]["Scan"] == scans_in(hall[1])
    known = service.ask("/v1/objects/door").json
    assert known["last_observed_ns"] >= live["last_observed_ns"]

    # as a service that was sent the log
    asked = f"/v1/objects/door?samples=true&at={known['stamp_ns']}"
    weights = service.ask(asked).json["weights"]
    assert taught.ask(asked).json["weights"] == weights


def test_records_are_taken_as_a_log_and_survive_a_kill(
    serve: Serve, hall: tuple[Path, Path]
) -> None:
    service = serve()
    records = records_of(hall[1])
    half = len(records) // 2
    with Client(service.address, service.token) as client:
        identity = client.send_records("r2", records[:half])
        (robot,) = client.robots()
    assert (robot.robot, robot.drive) == ("r2", identity)
    service.kill()

    service = serve()
    (drive,) = service.ask("/v1/drives").json["drives"]
    assert drive["robot"] == "r2"
    done = service.until(drive["id"], "done", "failed")
    assert done["summary"]["counts"]["Scan"] == sum(r["type"] == "scan" for r in records[:half])
    with Client(service.address, service.token) as client:
        client.send_records("r2", records[half:])
        ended = client.end_drive("r2")
    assert ended is not None
    assert ended.id != drive["id"]


def test_who_follows_a_drive_that_goes_on_is_warned(serve: Serve, hall: tuple[Path, Path]) -> None:
    service, records = serve(), records_of(hall[1])
    unmounted = [each | {"frame": "rear"} for each in records if each["type"] == "scan"]
    every = sorted(records + unmounted, key=lambda each: each["stamp_ns"])
    client, heard, is_heard = Client(service.address, service.token), [], threading.Event()

    def listen() -> None:
        for event in client.stream():
            if event.kind == "state" and event.data["warnings"]:
                heard.append(event.data)
                is_heard.set()
                return

    threading.Thread(target=listen, daemon=True).start()
    client.send_records("r2", every[:-10])
    time.sleep(1.2)  # a drive is estimated when a second of it has come
    client.send_records("r2", every[-10:])
    assert is_heard.wait(PATIENCE_S)
    (robot,) = client.robots()
    assert robot.warnings[0].startswith("Scan dropped: The log has no mounting of the laser 'rear'")
    assert (heard[0]["robot"], heard[0]["state"]) == ("r2", "estimating")


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ({"type": "odometry", "stamp_ns": 1, "x": 0, "y": 0}, "yaw"),
        ({"type": "odometry", "stamp_ns": -1, "x": 0, "y": 0, "yaw": 0}, "stamp_ns"),
        ({"type": "wish", "stamp_ns": 1}, "wish"),
        ({"type": "pose", "stamp_ns": 1, "x": "NaN", "y": 0, "yaw": 0}, "x"),
    ],
)
def test_records_that_are_none_are_refused(
    taught: Service, record: dict[str, Any], told: str
) -> None:
    refused = taught.ask("/v1/robots/r1/records", {"records": [record]})
    assert refused.status == 422
    assert told in refused.json["detail"]
    assert taught.ask("/v1/robots").json["robots"] == []


def test_robots_have_names_that_are_no_paths(taught: Service) -> None:
    record = {"type": "odometry", "stamp_ns": 1, "x": 0, "y": 0, "yaw": 0}
    for name in ("..%2F..%2Fetc", "a%20b", "x" * 65):
        refused = taught.ask(f"/v1/robots/{name}/records", {"records": [record]})
        assert refused.status in (404, 422)
    assert taught.ask("/v1/robots/nobody/end", method="POST").status == 404


def rosbridge_of(log: Path, port: int, stop: threading.Event) -> None:
    """A robot that speaks rosbridge, as far as a client of topics needs it."""
    from websockets.asyncio.server import ServerConnection
    from websockets.asyncio.server import serve as listen

    messages = list(open_messages(log))
    types = {m.topic: m.type.replace("/msg/", "/") for m in messages}

    async def speak(connection: ServerConnection) -> None:
        subscribed: set[str] = set()
        while subscribed != types.keys():
            asked = json.loads(await connection.recv())
            if asked["op"] == "call_service":
                values = {"topics": list(types), "types": list(types.values())}
                told = {"op": "service_response", "id": asked["id"], "values": values}
                await connection.send(json.dumps(told))
            elif asked["op"] == "subscribe":
                subscribed.add(asked["topic"])
        for message in messages:
            words = _plain(message.decode())
            told = {"op": "publish", "topic": message.topic, "msg": words}
            await connection.send(json.dumps(told))
            await asyncio.sleep(0.002)
        await connection.wait_closed()

    async def run() -> None:
        async with listen(speak, "127.0.0.1", port):
            while not stop.is_set():
                await asyncio.sleep(0.05)

    asyncio.run(run())


def _plain(value: Any) -> Any:
    """A message as rosbridge writes it; numbers that are none are null."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: _plain(getattr(value, name)) for name in value.__dataclass_fields__
                if not name.startswith("__")}  # fmt: skip
    if hasattr(value, "tolist"):
        return [_plain(each) for each in value.tolist()]
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def test_a_robot_with_rosbridge_is_followed(serve: Serve, hall: tuple[Path, Path]) -> None:
    port, stop = free_port(), threading.Event()
    robot = threading.Thread(target=rosbridge_of, args=(hall[1], port, stop))
    robot.start()
    try:
        service = serve(None, "--rosbridge", f"r3=ws://127.0.0.1:{port}")
        count = sum(1 for _ in open_messages(hall[1]))
        until(service, "/v1/robots", lambda told: told["robots"][0].get("messages") == count)
        ended = service.ask("/v1/robots/r3/end", method="POST").json["drive"]
        drive = service.until(ended["id"], "done", "failed")
        assert drive["summary"]["counts"]["Scan"] == scans_in(hall[1])
    finally:
        stop.set()
        robot.join()


def test_live_drives_are_shown_to_foxglove(
    serve: Serve, hall: tuple[Path, Path], robot: int
) -> None:
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    port = free_port()
    serve(None, "--foxglove", f"r1=ws://127.0.0.1:{robot}", "--foxglove-port", str(port))
    topics: set[str] = set()
    address, deadline = f"ws://127.0.0.1:{port}", time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
            break
    with connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as connection:
        while "/r1/joint_states" not in topics and time.monotonic() < deadline:
            frame = connection.recv(timeout=PATIENCE_S)
            if isinstance(frame, str):
                told = json.loads(frame)
                topics |= {each["topic"] for each in told.get("channels", ())}
    assert {"/r1/tf", "/r1/joint_states", "/r1/map"} <= topics


def test_an_address_that_is_none_is_refused_at_once(
    run: Run, tmp_path: Path, hall: tuple[Path, Path]
) -> None:
    world = ("--world", tmp_path / "w.db")
    refused = run("serve", "--building", hall[0], *world, "--foxglove", "r1=10.0.0.7")
    assert refused.code == 1
    assert "robot_1=ws://HOST:PORT" in refused.err
