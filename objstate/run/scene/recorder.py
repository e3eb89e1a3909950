"""``estimates.mcap``: the run as a scene that Foxglove and RViz play."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from objstate.building.model import Building
from objstate.estimator import Estimator
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
from objstate.recording.logs import LogWriter, open_log_writer
from objstate.recording.messages import (
    MAP,
    POSES,
    TRANSFORMS,
    make,
    poses_message,
    robot_transform,
    transform_message,
    transforms_message,
)
from objstate.records import Estimate, Record, Scan
from objstate.run.scene.hits import HitFinder
from objstate.run.scene.messages import (
    CLOUD,
    JOINTS,
    MARKERS,
    beams_message,
    ghosts_message,
    joints_message,
)
from objstate.run.scene.urdf import link_of, self_contained_urdf

STRING = "std_msgs/msg/String"
SCAN_STEP_NS = 200_000_000  # between two scans of one laser: five a second look smooth
BELIEFS_STEP_NS = 500_000_000  # between two moments of all objects and the particles
PARTICLES = 200  # of the robot's, at most


@contextmanager
def record_scene(path: Path, building: Building) -> Iterator[SceneRecorder]:
    """An observer that writes a scene to ``path``; the file is whole when the block has ended."""
    with open_log_writer(path, "mcap") as log:
        yield SceneRecorder(log, building)


class SceneRecorder:
    """Writes robot and beams at most five times a second, objects and particles twice."""

    def __init__(self, log: LogWriter, building: Building) -> None:
        self._log = log
        self._building = building
        self._hits = HitFinder(building)
        self._described = False
        self._scanned_ns: dict[str, int] = {}  # when a scan of each laser was last written
        self._beliefs_ns: int | None = None

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Write what a scan brought, once the robot's place is known."""
        if not isinstance(record, Scan) or estimator.robot is None:
            return
        now = record.stamp_ns
        if not self._described:
            description = make(STRING, data=self_contained_urdf(self._building))
            self._log.write("/robot_description", STRING, now, description)
            self._described = True
        if _is_due(self._scanned_ns.get(record.laser), now, SCAN_STEP_NS):
            self._scanned_ns[record.laser] = now
            self._write_robot(record, estimator.robot, estimator)
        if _is_due(self._beliefs_ns, now, BELIEFS_STEP_NS):
            self._beliefs_ns = now
            self._write_particles(now, estimator.robot)
            self._write_objects(now, estimator.objects)

    def _write_robot(self, scan: Scan, robot: PoseBelief, estimator: Estimator) -> None:
        now, hits = scan.stamp_ns, self._hits.hits(scan, robot, estimator)
        place = transforms_message([robot_transform(now, MAP, robot.mean)])
        self._log.write("/tf", TRANSFORMS, now, place)
        self._log.write(f"/beams/{scan.laser.strip('/')}", CLOUD, now, beams_message(scan, hits))

    def _write_particles(self, now: int, robot: PoseBelief) -> None:
        shown = robot.thinned(PARTICLES, np.random.default_rng(now))
        self._log.write("/particles", POSES, now, poses_message(now, shown.poses))

    def _write_objects(self, now: int, beliefs: dict[str, ObjectBelief]) -> None:
        places = transforms_message(
            transform_message(now, MAP, link_of(name), belief.item.transforms(belief.mean[None])[0])
            for name, belief in beliefs.items()
        )
        self._log.write("/tf", TRANSFORMS, now, places)
        self._log.write("/joint_states", JOINTS, now, joints_message(now, beliefs.values()))
        known = (
            (number, belief)
            for number, belief in enumerate(beliefs.values())
            if belief.last_observed_ns is not None and len(belief.item.mesh.vertices)
        )
        self._log.write("/intervals", MARKERS, now, ghosts_message(now, known))


def _is_due(last: int | None, now: int, step: int) -> bool:
    return last is None or now - last >= step
