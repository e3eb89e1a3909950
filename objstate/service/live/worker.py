"""The process that estimates one live drive: ``python -m objstate.service.live.worker FD``.

Messages come over a connection, and what follows from them goes back. It ends with the connection.
"""

from __future__ import annotations

import math
import os
import resource
import sys
import threading
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from objstate.errors import ObjstateError
from objstate.estimator import Estimator
from objstate.lazy import altered
from objstate.logs import Log, Message
from objstate.logs.live import ClockSetBackError, LiveMessages, open_live
from objstate.objects import ObjectBelief
from objstate.records import Estimate, Scan
from objstate.run.inputs import BuildingInput
from objstate.run.memory import Memory
from objstate.run.run import make_estimator
from objstate.run.scene.recorder import SceneRecorder
from objstate.run.scene.states import Truth
from objstate.service.live.options import LiveContext
from objstate.service.live.scene import SceneSender

POSES_EVERY_NS = 200_000_000  # ns between two poses of the robot that are sent
WARNED_EVERY_NS = 1_000_000_000  # likewise of warnings, whose counts may grow with each scan
MOST_POINTS = 180  # of a scan that is shown
# what makes a belief news: of angles in rad and lengths in m, of standard deviations and
# probabilities; and ns after which it is sent anyway
MOVED, SHARPENED, CLOSED, AGAIN_NS = math.radians(1.0), 1.5, 0.05, 5_000_000_000


def main(descriptor: int) -> None:
    """Estimate one drive until it ends."""
    connection = Connection(descriptor)
    context, types, name = connection.recv()
    messages = LiveMessages(types)
    threading.Thread(target=_listen, args=(connection, messages), daemon=True).start()
    try:
        resource.setrlimit(resource.RLIMIT_AS, (context.memory_limit, context.memory_limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        _Live(connection, context, name).drive(messages)
        connection.send(("ended", None))
    except ClockSetBackError as error:
        connection.send(("over", str(error)))
    except MemoryError:
        connection.send(("failed", "It took more memory than --memory-limit allows."))
    except ObjstateError as error:
        connection.send(("failed", str(error)))
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{os.path.basename(where.filename)}:{where.lineno}"
        connection.send(("failed", f"A bug in objstate: {error!r} ({place}); please report it."))


def _listen(connection: Connection, messages: LiveMessages) -> None:
    try:
        while (message := connection.recv()) is not None:
            topic, recorded_ns, data = message
            messages.put(Message(topic, messages.topics()[topic], recorded_ns, data))
    except (EOFError, OSError):
        os._exit(0)
    messages.close()


class _Live:
    """One drive: what is news of it goes over the connection."""

    def __init__(self, connection: Connection, context: LiveContext, name: str) -> None:
        self._connection, self._context, self._name = connection, context, name
        self._sent: dict[str, ObjectBelief] = {}
        self._posed_ns = -(2**63)
        self._is_lost = False
        self._warnings: list[str] = []
        self._warned_ns = -(2**63)

    def drive(self, messages: LiveMessages) -> None:
        context = self._context
        building = BuildingInput.read(context.building).model
        options = context.options
        log = open_live(messages, options.topics, options.mounts, options.clock_offsets)
        self._say("state", "waiting for scans, odometry and a laser's mounting")
        scene = None
        if context.scenes:
            sender = SceneSender(f"/{self._name.rpartition('-')[0]}", self._say)
            scene = SceneRecorder(sender, building, Truth(()), None)
        estimator: Estimator | None = None
        for record in log:
            if estimator is None:
                estimator = self._begin(building, record.stamp_ns)
            estimates = estimator.feed(record)
            if isinstance(record, Scan):
                self._note(record, estimator, estimates)
            self._warn(record.stamp_ns, log, estimator)
            if scene is not None:
                scene.note(record, estimator, estimates)

    def _begin(self, building: Any, begin_ns: int) -> Estimator:
        context = self._context
        settings = context.options.settings
        digest = f"live:{self._name}"
        memory = Memory.opened(context.world, building, settings, digest, begin_ns, {})
        self._say("state", "estimating")
        return make_estimator(memory.building, context.options, memory.known)

    def _note(self, scan: Scan, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        news = []
        for name in sorted({each.object for each in estimates if each.observed}):
            belief = estimator.object_at(name, scan.stamp_ns)
            if _is_news(self._sent.get(name), belief):
                self._sent[name] = belief
                news.append((name, altered(belief, item=None, joint=None, past=None)))
        if news:
            self._say("beliefs", (scan.stamp_ns, news))
        if estimator.is_lost != self._is_lost:
            self._is_lost = estimator.is_lost
            self._say("lost" if self._is_lost else "found", scan.stamp_ns)
        if scan.stamp_ns - self._posed_ns >= POSES_EVERY_NS and estimator.robot is not None:
            self._posed_ns = scan.stamp_ns
            self._say("robot", _words(scan, estimator))

    def _warn(self, stamp_ns: int, log: Log, estimator: Estimator) -> None:
        """Send the warnings so far, where there is news of them."""
        if stamp_ns - self._warned_ns < WARNED_EVERY_NS:
            return
        warnings = [*log.warnings, *estimator.warnings]
        if warnings != self._warnings:
            self._warned_ns, self._warnings = stamp_ns, warnings
            self._say("warnings", warnings)

    def _say(self, kind: str, what: Any) -> None:
        self._connection.send((kind, what))


def _is_news(before: ObjectBelief | None, now: ObjectBelief) -> bool:
    if before is None or before.stamp_ns is None or now.stamp_ns is None:
        return True
    if now.stamp_ns - before.stamp_ns >= AGAIN_NS:
        return True
    if np.any(np.abs(now.mean - before.mean) > MOVED):
        return True
    if np.any(
        np.abs(np.log(np.maximum(now.std, 1e-6) / np.maximum(before.std, 1e-6)))
        > math.log(SHARPENED)
    ):
        return True
    closed, was = now.probability_closed, before.probability_closed
    return closed is not None and was is not None and abs(closed - was) > CLOSED


def _words(scan: Scan, estimator: Estimator) -> dict[str, Any]:
    robot = estimator.robot
    assert robot is not None
    x, y, yaw = (float(value) for value in robot.mean)
    hits = np.flatnonzero(scan.valid & (scan.ranges < scan.range_max))
    hits = hits[:: max(1, -(-len(hits) // MOST_POINTS))]
    ends = scan.rays.origins[hits, :2] + scan.ranges[hits, None] * scan.rays.directions[hits, :2]
    cos, sin = math.cos(yaw), math.sin(yaw)
    placed = ends @ np.array([[cos, sin], [-sin, cos]]) + np.array([x, y])
    return {
        "stamp_ns": scan.stamp_ns,
        "pose": [round(x, 4), round(y, 4), round(yaw, 5)],
        "p_localized": round(float(estimator.p_localized), 4),
        "lost": estimator.is_lost,
        "laser": scan.laser,
        "points": placed.round(2).tolist(),
    }


if __name__ == "__main__":
    main(int(sys.argv[1]))
