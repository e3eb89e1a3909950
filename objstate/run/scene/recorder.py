"""``estimates.mcap``: the run as a scene that Foxglove and RViz play."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from objstate.building.model import Building
from objstate.estimator import Estimator
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
from objstate.recording.logs import open_log_writer
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
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.records import Estimate, Record, Scan
from objstate.records import Path as RobotPath
from objstate.run.candidates import found_of
from objstate.run.floor import Floor
from objstate.run.scene import LAYOUT, SCENE
from objstate.run.scene.ground import GRID, grid_message, map_message
from objstate.run.scene.hits import HitFinder
from objstate.run.scene.layout import layout_json
from objstate.run.scene.messages import (
    CLOUD,
    JOINTS,
    MARKERS,
    PATH,
    beams_message,
    candidates_message,
    ghosts_message,
    joints_message,
    path_message,
    truth_message,
)
from objstate.run.scene.states import (
    DIAGNOSTICS,
    STATES,
    STATES_DEFINITION,
    Truth,
    diagnostics_message,
    shown_state,
    states_message,
)
from objstate.run.scene.urdf import link_of, self_contained_urdf

STRING = "std_msgs/msg/String"
SCAN_STEP_NS = 200_000_000  # between two scans of one laser: five a second look smooth
BELIEFS_STEP_NS = 500_000_000  # between two moments of all objects and the particles
FLOOR_STEP_NS = 2_000_000_000  # between two moments of the grid
PARTICLES = 200  # of the robot's, at most


class SceneLog(Protocol):
    """Where a scene is written to."""

    def write(
        self,
        topic: str,
        type_name: str,
        recorded_ns: int,
        message: Any,
        definition: str | None = None,
    ) -> None:
        """Append a message."""


@contextmanager
def record_scene(
    folder: Path,
    building: Building,
    truth: str | Path | None = None,
    true_path: str | Path | None = None,
    floor: Floor | None = None,
) -> Iterator[SceneRecorder]:
    """An observer that writes a scene to a folder, with a layout for Foxglove beside it.

    What is known to be true, a CSV of states and a TUM file of the robot's path, is shown beside
    what is believed; so is the grid of a ``floor`` that observes the run before this. The files are
    whole when the block has ended. Raises TruthError.
    """
    true_states = Truth(() if truth is None else read_truth(truth))
    driven = None if true_path is None else read_tum(true_path)
    with open_log_writer(folder / SCENE, "mcap") as log:
        recorder = SceneRecorder(log, building, true_states, driven, floor)
        yield recorder
    layout = layout_json(building, recorder.topics, "/object_states", "/diagnostics")
    (folder / LAYOUT).write_text(layout, encoding="utf-8")


class SceneRecorder:
    """Writes robot and beams at most five times a second, objects and particles twice."""

    def __init__(
        self,
        log: SceneLog,
        building: Building,
        truth: Truth,
        true_path: RobotPath | None,
        floor: Floor | None = None,
    ) -> None:
        self.topics: set[str] = set()  # that were written
        self._log = log
        self._building = building
        self._truth = truth
        self._true_path = true_path
        self._hits = HitFinder(building)
        self._scanned_ns: dict[str, int] = {}  # when a scan of each laser was last written
        self._floor = floor
        self._beliefs_ns: int | None = None
        self._floor_ns: int | None = None
        self._height = 0.0  # m above the floor of the first scan's laser
        self._true_states: dict[str, tuple[float, ...]] = {}  # that were last written

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Write what a scan brought, once the robot's place is known."""
        if not isinstance(record, Scan) or estimator.robot is None:
            return
        now = record.stamp_ns
        if not self.topics:
            self._write_standing(record)
        if _is_due(self._scanned_ns.get(record.laser), now, SCAN_STEP_NS):
            self._scanned_ns[record.laser] = now
            self._write_robot(record, estimator.robot, estimator)
        if _is_due(self._beliefs_ns, now, BELIEFS_STEP_NS):
            self._beliefs_ns = now
            self._write_particles(now, estimator.robot)
            self._write_objects(now, estimator.objects)
        if self._floor is not None and _is_due(self._floor_ns, now, FLOOR_STEP_NS):
            self._floor_ns = now
            self._write_floor(now, self._floor, estimator)

    def _write(
        self, topic: str, kind: str, now: int, message: Any, definition: str | None = None
    ) -> None:
        self.topics.add(topic)
        self._log.write(topic, kind, now, message, definition)

    def _write_standing(self, scan: Scan) -> None:
        """The constant messages: the building, its map at the first scan's height, the true path."""
        now, heights = scan.stamp_ns, scan.rays.origins[:, 2]
        description = make(STRING, data=self_contained_urdf(self._building))
        self._write("/robot_description", STRING, now, description)
        self._height = float(heights[0]) if len(heights) else 0.0
        self._write("/map", GRID, now, map_message(now, self._building, self._height))
        if self._true_path is not None:
            self._write("/true_path", PATH, now, path_message(now, self._true_path))

    def _write_robot(self, scan: Scan, robot: PoseBelief, estimator: Estimator) -> None:
        now, hits = scan.stamp_ns, self._hits.hits(scan, robot, estimator)
        place = transforms_message([robot_transform(now, MAP, robot.mean)])
        self._write("/tf", TRANSFORMS, now, place)
        self._write(f"/beams/{scan.laser.strip('/')}", CLOUD, now, beams_message(scan, hits))

    def _write_floor(self, now: int, floor: Floor, estimator: Estimator) -> None:
        values = floor.occupied(now, estimator)
        if values is not None and floor.grid is not None:
            self._write("/grid", GRID, now, grid_message(now, values, floor.grid.layout))
        if floor.candidates is not None:
            found = found_of(floor.candidates)
            message = candidates_message(now, found, self._height)
            self._write("/candidates", MARKERS, now, message)

    def _write_particles(self, now: int, robot: PoseBelief) -> None:
        shown = robot.thinned(PARTICLES, np.random.default_rng(now))
        self._write("/particles", POSES, now, poses_message(now, shown.poses))

    def _write_objects(self, now: int, beliefs: dict[str, ObjectBelief]) -> None:
        places = transforms_message(
            transform_message(
                now, MAP, link_of(name), belief.item.transforms(shown_state(belief)[None])[0]
            )
            for name, belief in beliefs.items()
        )
        self._write("/tf", TRANSFORMS, now, places)
        self._write("/joint_states", JOINTS, now, joints_message(now, beliefs.values()))
        self._write("/intervals", MARKERS, now, ghosts_message(now, beliefs.values()))
        numbers = states_message(now, beliefs, self._truth)
        self._write("/object_states", STATES, now, numbers, STATES_DEFINITION)
        words = diagnostics_message(now, beliefs, self._truth)
        self._write("/diagnostics", DIAGNOSTICS, now, words)
        self._write_truth(now, dict(self._truth.states(now, beliefs)))

    def _write_truth(self, now: int, states: dict[str, FloatArray]) -> None:
        """The true states (d,) of objects, once and whenever one changes."""
        told = {name: tuple(state) for name, state in states.items()}
        if told != self._true_states:
            self._true_states = told
            true = [(self._building[name], state) for name, state in states.items()]
            self._write("/truth", MARKERS, now, truth_message(now, true))


def _is_due(last: int | None, now: int, step: int) -> bool:
    return last is None or now - last >= step
