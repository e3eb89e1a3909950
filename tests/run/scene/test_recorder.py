"""A recorded scene, read back by the MCAP SDK and by the definitions that the file itself carries."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from objstate.building import load_building, outline
from objstate.building.occupancy import read_probabilities
from objstate.recording.grids import GRID_MAP
from objstate.recording.tables import read_estimates
from objstate.recording.tum import read_tum
from objstate.run import LAYOUT, SCENE, RunOptions, estimate_log
from objstate.simulation import simulate
from tests.cli.test_commands import ROOM

SCENE_FILE = """
building: room.urdf
route: {waypoints: [{x: 1.0, y: 0.0, pause: 0.5}, {x: 2.5, y: 0.3, pause: 0.5}]}
lasers: [{frame: laser, rate: 10.0, range_max: 10.0}]
objects: [{name: office_door, initial: 0.6}]
"""
TRUE_ANGLE = 0.6


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE_FILE)
    drive = simulate(folder / "room.scene.yaml", folder / "log")
    for name in ("out", "again"):
        estimate_log(
            [drive.log],
            folder / "room.urdf",
            folder / name,
            RunOptions(),
            truth=folder / "log" / "truth.csv",
            true_path=folder / "log" / "path.tum",
            mcap=True,
            grid=True,
        )
    return folder / "out"


@pytest.fixture(scope="module")
def messages(result: Path) -> dict[str, list[tuple[int, Any]]]:
    """By topic: log time, and the message as the schema in the file describes it."""
    found = defaultdict(list)
    with (result / SCENE).open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            found[channel.topic].append((message.log_time, decoded(schema, message.data)))
    return found


def decoded(schema: Any, data: bytes) -> Any:
    store = get_typestore(Stores.EMPTY)
    name = schema.name if schema.name.count("/") == 2 else schema.name.replace("/", "/msg/")
    store.register(get_types_from_msg(schema.data.decode(), name))
    return store.deserialize_cdr(data, name)


def test_every_topic_is_there(messages: dict[str, list[tuple[int, Any]]]) -> None:
    assert set(messages) == {
        "/robot_description", "/tf", "/beams/laser", "/particles", "/joint_states", "/intervals",
        "/object_states", "/diagnostics", "/map", "/truth", "/true_path", "/grid", "/candidates",
    }  # fmt: skip
    (_, description), = messages["/robot_description"]  # fmt: skip
    robot = ElementTree.fromstring(description.data)
    assert [joint.get("name") for joint in robot.iter("joint")] == ["office_door"]


def test_joint_states_and_transforms_are_the_estimates(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    medians = dict(read_estimates(result).select("stamp", "median").iter_rows())
    path = read_tum(result / "trajectory.tum")
    poses = dict(zip(path.stamps_ns.tolist(), path.poses, strict=True))
    joints = {stamp: float(joint.position[0]) for stamp, joint in messages["/joint_states"]}
    told = {stamp: each for stamp, each in joints.items() if stamp in medians}
    assert len(told) > len(joints) // 2
    assert told == {stamp: pytest.approx(medians[stamp]) for stamp in told}
    assert list(joints.values())[-1] == pytest.approx(TRUE_ANGLE, abs=0.05)
    for stamp, message in messages["/tf"]:
        for each in message.transforms:
            assert each.header.frame_id == "map"
            place, turn = each.transform.translation, each.transform.rotation
            yaw = 2 * np.arctan2(turn.z, turn.w)
            if each.child_frame_id == "base_link":
                assert [place.x, place.y, yaw] == pytest.approx(poses[stamp], abs=1e-6)
            else:
                assert each.child_frame_id == "office_door_link"
                assert (place.x, place.y) == (2.0, 2.0)
                assert yaw == pytest.approx(-joints[stamp])  # its axis points down


def test_beams_lie_on_walls_and_door_and_are_coloured(
    messages: dict[str, list[tuple[int, Any]]],
) -> None:
    colours: dict[int, set[int]] = defaultdict(set)
    for _, cloud in messages["/beams/laser"]:
        assert [field.name for field in cloud.fields] == ["x", "y", "z", "rgb", "hit"]
        points = np.frombuffer(cloud.data.tobytes(), "<u4").reshape(-1, 5)
        assert len(points) == cloud.width
        heights = points[:, 2].copy().view("<f4")
        assert heights == pytest.approx(0.3)
        for colour, hit in points[:, 3:]:
            colours[int(hit)].add(int(colour))
    assert {0, 1} <= set(colours)
    assert all(len(each) == 1 for each in colours.values())
    assert len({next(iter(each)) for each in colours.values()}) == len(colours)


def test_ghosts_stand_at_the_bounds_of_the_interval(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    bounds = {row[0]: row[1:] for row in read_estimates(result).select("stamp", "lower", "upper").iter_rows()}  # fmt: skip
    seen = 0
    for stamp, message in messages["/intervals"]:
        for marker in message.markers:
            if marker.ns != "swing":
                continue
            seen += 1
            points = np.array([[point.x, point.y] for point in marker.points]) - [2.0, 2.0]
            rim = points[np.hypot(*points.T) > 0.5]
            angles = -np.arctan2(rim[:, 1], rim[:, 0])
            tilt = np.arctan2(0.02, 0.9)  # the far corner of a leaf 4 cm thick
            lower, upper = bounds[stamp]
            assert angles.min() == pytest.approx(lower, abs=tilt + 1e-6)
            assert angles.max() == pytest.approx(upper, abs=tilt + 1e-6)
    assert seen > 0


def test_particles_surround_the_robot(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    path = read_tum(result / "trajectory.tum")
    stamp, cloud = messages["/particles"][-1]
    mean = np.mean([[pose.position.x, pose.position.y] for pose in cloud.poses], axis=0)
    at = int(np.searchsorted(path.stamps_ns, stamp))
    assert mean == pytest.approx(path.poses[at, :2], abs=0.02)


def test_intervals_and_truth_are_numbers_to_plot(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    rows = read_estimates(result).select("stamp", "median", "lower", "upper").iter_rows()
    estimates = {stamp: np.degrees(numbers) for stamp, *numbers in rows}
    compared = 0
    for stamp, message in messages["/object_states"]:
        (state,) = message.states
        assert (state.name, state.coordinate, state.unit) == ("office_door", "angle", "deg")
        assert state.truth == pytest.approx(np.degrees(TRUE_ANGLE), abs=1e-6)
        if stamp in estimates and state.seen:
            compared += 1
            assert state.shown == state.median
            assert [state.median, state.lower, state.upper] == pytest.approx(estimates[stamp])
    assert compared > 5


def test_the_true_state_and_path_are_shown(messages: dict[str, list[tuple[int, Any]]]) -> None:
    ((_, truth),) = messages["/truth"]  # once, as it doesn't change
    corners = np.array([[point.x, point.y] for point in truth.markers[0].points]) - [2.0, 2.0]
    far = corners[np.hypot(*corners.T) > 0.5]
    tilt = np.arctan2(0.02, 0.9)  # the corners of a leaf 4 cm thick
    assert -np.arctan2(far[:, 1], far[:, 0]) == pytest.approx(TRUE_ANGLE, abs=tilt + 1e-6)
    ((_, path),) = messages["/true_path"]
    assert len(path.poses) > 10


def test_the_map_has_walls_where_the_building_has(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    ((_, grid),) = messages["/map"]
    cells = grid.data.reshape(grid.info.height, grid.info.width)
    assert set(np.unique(cells)) == {0, 100}
    corner, size = grid.info.origin.position, grid.info.resolution
    walls = outline(load_building(result.parent / "room.urdf").walls, 0.3)
    occupied = np.argwhere(cells == 100)[:, ::-1] * size + [corner.x, corner.y] + size / 2
    lines = shapely.union_all(shapely.linestrings(walls))
    assert shapely.distance(shapely.points(occupied), lines).max() < size
    covered = shapely.union_all(shapely.points(occupied)).buffer(size)
    assert covered.covers(lines)


def test_the_grid_is_what_was_mapped_from_moment_to_moment(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    stamps = [stamp for stamp, _ in messages["/grid"]]
    assert np.diff(stamps).min() >= 2 * 10**9
    values, resolution, origin = read_probabilities(result / GRID_MAP)
    unknown = []
    for _, grid in messages["/grid"]:
        assert (grid.info.height, grid.info.width) == values.shape
        assert grid.info.resolution == pytest.approx(resolution)
        corner = grid.info.origin.position
        assert (corner.x, corner.y) == pytest.approx(tuple(origin[:2]))
        cells = grid.data.reshape(values.shape)
        assert cells.min() == -1
        assert cells.max() == 100  # walls
        unknown.append((cells == -1).sum())
    assert unknown[-1] < unknown[0]
    known = cells >= 0
    assert np.abs(cells[known] / 100.0 - values[known]).mean() < 0.05


def test_the_layout_shows_what_the_scene_holds(
    result: Path, messages: dict[str, list[tuple[int, Any]]]
) -> None:
    layout = json.loads((result / LAYOUT).read_text())
    panels, shown = layout["configById"], layout["layout"]
    named: list[str] = []
    pending = [shown]
    while pending:
        part = pending.pop()
        if isinstance(part, str):
            named.append(part)
        else:
            pending += [part["first"], part["second"]]
    assert sorted(named) == sorted(panels)
    assert set(panels["3D!scene"]["topics"]) == set(messages)
    (_, states), *_ = messages["/object_states"]
    for path in panels["Plot!object"]["paths"]:
        topic, field = path["value"].split(".")[0], path["value"].split(".")[-1]
        assert topic == "/object_states"
        assert hasattr(states.states[0], field)
    assert layout["globalVariables"] == {"object": "office_door", "coordinate": "angle"}
    assert panels["DiagnosticSummary!objects"]["topicToRender"] in messages


def test_a_scene_changes_nothing_and_comes_out_the_same(result: Path) -> None:
    again = result.parent / "again"
    for name in (SCENE, LAYOUT):
        assert (again / name).read_bytes() == (result / name).read_bytes()
