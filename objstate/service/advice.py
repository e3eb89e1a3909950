"""What to look at next, for a robot that asks."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import Any

from objstate.building.model import Building
from objstate.config import Settings
from objstate.errors import SettingsError
from objstate.gaze import Sensor
from objstate.geometry import pose_from_text
from objstate.maintenance import (
    Coordinator,
    CoordinatorSettings,
    Plan,
    next_tasks,
    next_words,
    seconds_until_worthwhile,
)
from objstate.service.believed import Believed
from objstate.service.problems import Problem

SHOWN = 10  # actions, the most useful first
WIDTHS_KEPT = 4  # of robots, whose looks are computed once


class Advice:
    """Ranks looks at objects. One question after the other; the first computes what each sees."""

    def __init__(self, building: Building, settings: Settings, believed: Believed) -> None:
        self._building, self._settings, self._believed = building, settings, believed
        self._lock = threading.Lock()
        self._coordinators: dict[float, Coordinator] = {}  # by the robot's width, m

    def next(
        self,
        pose: str,
        stamp_ns: int | None,
        plans: Sequence[str],
        stay: bool,
        width: float,
    ) -> dict[str, Any]:
        """The looks that are required, and the most useful ones, of a robot of a width, m.

        Raises Problem, SettingsError, QueryError.
        """
        try:
            at, due = pose_from_text(pose), [Plan.parse(text) for text in plans]
        except ValueError as error:
            raise Problem(422, f"'{pose}' is no pose: {error}.", "Give X,Y,YAW.") from error
        unknown = [plan.object for plan in due if plan.object not in self._building.objects]
        if unknown:
            raise Problem(422, f"There is no object '{unknown[0]}'.", "See GET /v1/objects.")
        moment = self._believed.at(time.time_ns() if stamp_ns is None else stamp_ns)
        with self._lock:
            coordinator = self._ready(width)
            ranked = coordinator.actions(moment.beliefs, at, may_drive=not stay)
            tasks = next_tasks(
                coordinator, ranked, moment.beliefs, moment.stamp_ns, plans=due, due=()
            )
            wait: float | None = 0.0
            if coordinator.best(ranked) is None:
                wait = seconds_until_worthwhile(
                    coordinator, moment.world, moment.stamp_ns, at, may_drive=not stay
                )
            told = next_words(moment, tasks, (), ranked[:SHOWN], wait)
        about = {"at_ns": moment.stamp_ns, "revision": self._believed.now.revision}
        return about | {"width": width} | told

    def _ready(self, width: float) -> Coordinator:
        if width not in self._coordinators:
            settings = CoordinatorSettings().for_width(width)
            try:
                sensors = [Sensor("laser")]
                new = Coordinator(self._building, sensors, settings, self._settings)
            except SettingsError as error:
                raise Problem(422, str(error), "Look by yourself in this building.") from error
            while len(self._coordinators) >= WIDTHS_KEPT:
                del self._coordinators[next(iter(self._coordinators))]
            self._coordinators[width] = new
        return self._coordinators[width]
