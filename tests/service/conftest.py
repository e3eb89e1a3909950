"""A service in a process of its own, a small building, and a drive through it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from email.message import Message
from pathlib import Path
from typing import Any

import pytest

from objstate.simulation import simulate
from tests.world.conftest import place

__all__ = ["place"]

ROOT = Path(__file__).parents[2]
BUILDING = """
<robot name="hall">
  <link name="map">
    <collision><origin xyz="3 2 1"/><geometry><box size="9 0.1 2"/></geometry></collision>
    <collision><origin xyz="7 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
  </link>
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="door" type="revolute">
    <parent link="map"/><child link="leaf"/><origin xyz="2 0.6 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.5" effort="0" velocity="0"/>
  </joint>
</robot>
"""
SCENE = """
building: hall.urdf
route: {waypoints: [{x: 1.0, y: 0.0}, {x: 1.6, y: 0.0}]}
"""
PATIENCE_S = 120.0  # for a drive to be estimated, the loops to be compiled


@dataclass(frozen=True)
class Answer:
    """What a service says."""

    status: int
    headers: Message
    content: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.content)


class Service:
    """A service that runs, and the first token."""

    def __init__(self, folder: Path, building: Path, world: str, *more: str) -> None:
        self.folder, self._token = folder, folder / "token"
        command = [sys.executable, str(ROOT / "cli.py"), "serve", "--port", "0", "--world", world]
        command += ["--building", str(building), "--token-file", str(self._token)]
        self._process = subprocess.Popen(
            [*command, "--data", str(folder / "data"), *more],
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            start_new_session=True,
        )
        self.address = self._address()

    def _address(self) -> str:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            found = re.match(r"(https?://\S+)/ ", line)
            if found:
                return found[1]
        raise AssertionError("the service didn't start")

    @property
    def token(self) -> str:
        return self._token.read_text().strip()

    def ask(
        self,
        path: str,
        body: Any = None,
        *,
        method: str | None = None,
        token: str | None = None,
        headers: dict[str, str] | None = None,
    ) -> Answer:
        """A request; the body is sent as it is, or as JSON."""
        content = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        sent = {"Authorization": f"Bearer {token or self.token}"} | (headers or {})
        request = urllib.request.Request(self.address + path, content, sent, method=method)
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return Answer(answer.status, answer.headers, answer.read())
        except urllib.error.HTTPError as error:
            return Answer(error.code, error.headers, error.read())

    def until(self, identity: str, *states: str) -> dict[str, Any]:
        """A drive as soon as it is in one of some states."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            drive: dict[str, Any] = self.ask(f"/v1/drives/{identity}").json
            if drive["state"] in states:
                return drive
            time.sleep(0.1)
        raise AssertionError(f"the drive is still {drive['state']}")

    def kill(self) -> None:
        """End it at once, with all that it began."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


@pytest.fixture(scope="session")
def hall(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A building with one door, and the log of a drive past it."""
    folder = tmp_path_factory.mktemp("hall")
    building, scene = folder / "hall.urdf", folder / "hall.scene.yaml"
    building.write_text(BUILDING)
    scene.write_text(SCENE)
    return building, simulate(scene, folder / "drive").log


Serve = Callable[..., Service]


@pytest.fixture
def serve(tmp_path: Path, hall: tuple[Path, Path]) -> Iterator[Serve]:
    """Start a service; all end with the test."""
    running: list[Service] = []

    def start(world: str | None = None, *more: str) -> Service:
        running.append(Service(tmp_path, hall[0], world or str(tmp_path / "world.db"), *more))
        return running[-1]

    yield start
    for service in running:
        if service._process.poll() is None:
            service.kill()


@pytest.fixture(scope="module")
def blank(tmp_path_factory: pytest.TempPathFactory, hall: tuple[Path, Path]) -> Iterator[Service]:
    """A service that knows of no drive but those that tests send."""
    folder = tmp_path_factory.mktemp("blank")
    service = Service(folder, hall[0], str(folder / "world.db"))
    yield service
    service.kill()


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory, hall: tuple[Path, Path]) -> Iterator[Service]:
    """A service that was taught by one drive."""
    folder = tmp_path_factory.mktemp("taught")
    service = Service(folder, hall[0], str(folder / "world.db"))
    sent = service.ask("/v1/drives", hall[1].read_bytes())
    assert service.until(sent.json["id"], "done", "failed")["state"] == "done"
    yield service
    service.kill()
