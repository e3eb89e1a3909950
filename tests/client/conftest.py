"""A service as people start it, over a world in which door_03 was just seen nearly closed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.config import Settings
from objstate.objects import filter_for
from objstate.particles import Weights
from objstate.world.store import DriveEntry, open_store

pytest.importorskip("starlette", reason="no Starlette (pip install 'objstate[service]')")
httpx = pytest.importorskip("httpx", reason="no httpx (pip install 'objstate[client]')")

ROOT = Path(__file__).parents[2]
CORRIDOR = ROOT / "models/corridor/corridor.urdf"
DOOR, ANGLE = "door_03", 0.2  # rad
PATIENCE_S = 60.0  # for a service to start on a busy machine


@dataclass
class Service:
    """A running service."""

    url: str
    token_file: Path
    world: Path
    process: subprocess.Popen[str]

    def kill(self) -> None:
        """End it as a power cut would."""
        self.process.kill()
        self.process.wait()


def start(folder: Path, port: int = 0) -> Service:
    """Start a service over the world in a folder; port 0 takes a free one."""
    world, token = folder / "world.db", folder / "token"
    command = [sys.executable, "-c", "from objstate.cli import main; main()", "serve"]
    command += ["--building", str(CORRIDOR), "--world", str(world), "--port", str(port)]
    process = subprocess.Popen(
        [*command, "--token-file", str(token)], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith("http://"):
            url = line.split("/ ")[0]
            answered(url)
            return Service(url, token, world, process)
    raise AssertionError(f"the service ended with exit code {process.wait(PATIENCE_S)}")


def answered(url: str) -> None:
    """Wait until a service answers at an address."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        with suppress(httpx.TransportError):
            httpx.get(f"{url}/health").raise_for_status()
            return
        time.sleep(0.05)
    raise AssertionError(f"no service answers at {url}")


def teach(folder: Path, digest: str = "seen", angle: float = ANGLE, ago_s: float = 0.0) -> int:
    """Let the world of a folder learn that the door stands at an angle; of when."""
    building = load_building(CORRIDOR)
    stamp_ns = time.time_ns() - round(ago_s * 1e9)
    prior = filter_for(building[DOOR], Settings()).prior(np.random.default_rng(0))
    weights = np.exp(-0.5 * ((prior.states[:, 0] - angle) / 0.02) ** 2)
    belief = prior.with_weights(Weights.of(weights + np.finfo(float).tiny))
    belief = replace(belief, stamp_ns=stamp_ns, last_observed_ns=stamp_ns)
    entry = DriveEntry(digest, stamp_ns, stamp_ns)
    open_store(folder / "world.db", building).add(entry, [belief])
    return stamp_ns


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("service")
    teach(folder)
    running = start(folder)
    yield running
    running.kill()
