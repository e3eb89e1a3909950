"""One simulated drive: a scene becomes a log whose truth is known.

Nothing here knows how the estimator scores a reading: ranges are cast in the real
building and spoilt by the sensor's own faults, so that the data is honest.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from objstate.building import load_building
from objstate.building.model import Building
from objstate.errors import SettingsError
from objstate.geometry import FloatArray, wrap
from objstate.recording.logs import ENDINGS, LogWriter, format_of, open_log_writer
from objstate.recording.messages import POSES, TRANSFORMS, poses_message
from objstate.recording.results import result_folder
from objstate.recording.tables import write_truth
from objstate.recording.tum import write_tum
from objstate.records import Path as RobotPath
from objstate.records import TrueState
from objstate.sensing.casters import caster_of
from objstate.simulation import messages
from objstate.simulation.crowd import Crowd, boxes_mesh, walkers
from objstate.simulation.lasers import Exposure, Scanner, World, reading
from objstate.simulation.odometry import dead_reckoning
from objstate.simulation.reality import real_building, real_mount
from objstate.simulation.route import drive
from objstate.simulation.scene import Laser, Scene, dump_scene, load_scene
from objstate.simulation.states import StateHistory, histories, true_states

TRUTH, PATH, SCENE = "truth.csv", "path.tum", "scene.yaml"


@dataclass(frozen=True)
class SimulationResult:
    """What was written."""

    folder: Path
    log: Path
    counts: Mapping[str, int]  # messages by topic
    duration_s: float
    warnings: tuple[str, ...] = ()  # what the format could not hold


@dataclass(frozen=True, eq=False)
class Event:
    """A message, when it is recorded."""

    recorded_ns: int
    topic: str
    type_name: str
    message: Any


def simulate(
    scene: str | Path,
    out: str | Path,
    *,
    format: str = "mcap",  # noqa: A002
    seed: int | None = None,
    overwrite: bool = False,
) -> SimulationResult:
    """Simulate the drive of a scene file into the folder ``out``.

    The folder gets the log, ``truth.csv`` (object states), ``path.tum`` (the robot's
    true pose at each scan) and ``scene.yaml`` (the scene with every setting spelled
    out). ``seed`` replaces the scene's. Same scene and seed: same bytes. Raises
    SettingsError, BuildingError and ResultError.
    """
    out = Path(out)
    settings = load_scene(scene, seed)
    name = f"log{ENDINGS[format_of(out, format)]}"
    simulation = Simulation(settings, load_building(settings.building))
    with result_folder(out, overwrite=overwrite) as folder:
        with open_log_writer(folder / name, format) as writer:
            lost = _write_log(simulation, writer)
        write_truth(folder / TRUTH, simulation.truth())
        write_tum(folder / PATH, simulation.path())
        (folder / SCENE).write_text(dump_scene(settings), encoding="utf-8")
    warnings = (*lost, *writer.warnings)
    return SimulationResult(out, out / name, writer.counts, simulation.motion.duration, warnings)


class Simulation:
    """A scene in motion. Every subject draws from its own random numbers, by the scene's seed."""

    def __init__(self, scene: Scene, model: Building) -> None:
        self.scene = scene
        self.motion = drive(scene.route)
        self._refuse_walls_on_the_way(model)
        self.building = real_building(model, scene.model_error, self._rng("building"))
        self.history: dict[str, StateHistory] = histories(
            self.building, scene.objects, self._rng("objects")
        )
        duration = self.motion.duration
        crowd = Crowd(
            walkers(scene.people, duration, self._rng("people")),
            boxes_mesh(scene.boxes, self._rng("boxes")),
        )
        self._world = World(self.building, self.history, crowd)
        mounting = self._rng("mounting")
        self._scanners = [
            Scanner(laser, real_mount(laser.mount, scene.model_error, mounting))
            for laser in scene.lasers
        ]

    def events(self) -> Iterator[Event]:
        """All messages in the order of recording."""
        sources = [
            self._mounts(),
            self._odometry(),
            self._initial_pose(),
            self._belief(),
            *(self._scans(scanner) for scanner in self._scanners),
        ]
        return heapq.merge(*sources, key=lambda event: event.recorded_ns)

    def truth(self) -> Iterator[TrueState]:
        """The objects' true states, in time order."""
        return true_states(self.history, self._stamp(0.0), self.scene.truth_step)

    def exposures(self) -> Iterator[tuple[int, Exposure]]:
        """What every scan is exposed to, with the scan's stamp in ns; in time order."""
        order = sorted(
            (time, number)
            for number, scanner in enumerate(self._scanners)
            for time in self._scan_times(scanner).tolist()
        )
        for time, number in order:
            exposure = self._scanners[number].exposure(time, self.motion, self._world)
            yield self._scan_stamp(time), exposure

    def path(self) -> RobotPath:
        """The robot's true pose where each scan was taken, under the scan's stamp."""
        times = np.sort(np.concatenate([self._scan_times(s) for s in self._scanners]))
        stamps = [self._scan_stamp(time) for time in times.tolist()]
        return RobotPath(np.array(stamps, dtype=np.int64), self.motion.at(times))

    @property
    def mounts(self) -> list[tuple[Laser, FloatArray]]:
        """Each laser, and where (4, 4) it really sits on ``base_link``."""
        return [(scanner.settings, scanner.mount) for scanner in self._scanners]

    def _rng(self, subject: str) -> np.random.Generator:
        return np.random.default_rng([self.scene.seed, crc32(subject.encode())])

    def _stamp(self, time: float) -> int:
        return self.scene.start_time * 10**9 + round(time * 1e9)

    def _scan_stamp(self, time: float) -> int:
        return self._stamp(time + self.scene.model_error.clock_offset)

    def _scan_times(self, scanner: Scanner) -> FloatArray:
        laser = scanner.settings
        return np.arange(laser.phase / laser.rate, self.motion.duration, 1.0 / laser.rate)

    def _mounts(self) -> Iterator[Event]:
        mounts = {laser.frame: laser.mount for laser in self.scene.lasers}
        start = self._stamp(0.0)
        message = messages.mount_transforms(start, mounts)
        yield Event(start, "/tf_static", TRANSFORMS, message)

    def _odometry(self) -> Iterator[Event]:
        wheels = dead_reckoning(self.motion, self.scene.odometry, self._rng("odometry"))
        for time, pose, velocity in zip(wheels.times, wheels.poses, wheels.velocities, strict=True):
            stamp = self._stamp(time)
            message = messages.odometry_message(stamp, pose, velocity)
            yield Event(stamp, "/odom", messages.ODOMETRY, message)
            if self.scene.odometry.publish_tf:
                transform = messages.odometry_transform(stamp, pose)
                yield Event(stamp, "/tf", TRANSFORMS, transform)

    def _initial_pose(self) -> Iterator[Event]:
        deviations = self.scene.initial_pose
        if deviations is None:
            return
        start = self._stamp(0.0)
        pose = _drawn(
            self.motion.at(0.0),
            deviations.sigma_xy,
            deviations.sigma_yaw,
            1,
            self._rng("initial pose"),
        )[0]
        message = messages.initial_pose_message(start, pose, deviations)
        yield Event(start, "/initialpose", messages.POSE, message)

    def _belief(self) -> Iterator[Event]:
        belief, rng = self.scene.belief, self._rng("belief")
        if belief is None:
            return
        for time in np.arange(0.0, self.motion.duration, 1.0 / belief.rate):
            mean = _drawn(self.motion.at(time), belief.error_xy, belief.error_yaw, 1, rng)[0]
            poses = _drawn(mean, belief.sigma_xy, belief.sigma_yaw, belief.count, rng)
            stamp = self._stamp(time)
            yield Event(stamp, belief.topic, POSES, poses_message(stamp, poses))

    def _scans(self, scanner: Scanner) -> Iterator[Event]:
        laser, alone = scanner.settings, len(self._scanners) == 1
        topic = "/scan" if alone else f"/scan_{laser.frame}"
        rng = self._rng(f"laser {laser.frame}")
        for time in self._scan_times(scanner).tolist():
            ranges = reading(scanner.sweep(time, self.motion, self._world), laser, rng)
            message = messages.scan_message(self._scan_stamp(time), laser, ranges)
            yield Event(self._stamp(time), topic, messages.SCAN, message)

    def _refuse_walls_on_the_way(self, model: Building) -> None:
        """A robot that drives through a wall is a slip of the pen in the route."""
        points = self.scene.route.waypoints
        walls = caster_of(model.walls)
        height = self.scene.lasers[0].mount.z
        for number, (start, end) in enumerate(pairwise(points)):
            x, y = start.left_from
            way = np.array([end.x - x, end.y - y, 0.0])
            length = float(np.linalg.norm(way))
            free = walls.distances(np.array([[x, y, height]]), way[None] / length)[0]
            if free < length:
                raise SettingsError(
                    f"route.waypoints.{number + 1}: the way there meets a wall after {free:.2f} m "
                    f"of {length:.2f} m, {height} m above the floor; lead it through a doorway."
                )


def _drawn(
    mean: FloatArray, sigma_xy: float, sigma_yaw: float, count: int, rng: np.random.Generator
) -> FloatArray:
    """Poses (count, 3) drawn about ``mean`` (3,)."""
    poses = mean + rng.standard_normal((count, 3)) * [sigma_xy, sigma_xy, sigma_yaw]
    poses[:, 2] = wrap(poses[:, 2])
    return np.asarray(poses)


def _write_log(simulation: Simulation, writer: LogWriter) -> list[str]:
    """Write all messages; returns what the format can't hold."""
    lost: Counter[str] = Counter()
    for event in simulation.events():
        refusal = writer.refusal(event.type_name)
        if refusal is not None:
            lost[f"messages of {event.topic}: {refusal}"] += 1
        else:
            writer.write(event.topic, event.type_name, event.recorded_ns, event.message)
    return [f"{n} {what}." for what, n in sorted(lost.items())]
