"""A whole run as library code."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from objstate.building import load_building
from objstate.config import BuildingErrorSettings, LocalizationSettings, ObjectRule, Settings
from objstate.errors import BuildingError, LogError, SettingsError, TruthError
from objstate.estimator import Estimator
from objstate.geometry import transform
from objstate.recording.posteriors import read_posteriors
from objstate.recording.tables import read_estimates
from objstate.recording.tum import read_tum
from objstate.records import Estimate, Record
from objstate.run import RunOptions, estimate_log
from objstate.run.doubts import compass
from objstate.run.inputs import describe_building, describe_log, log_identity
from objstate.run.run import unknown_start
from objstate.simulation import simulate
from objstate.world.store import open_store

WALLS = """
<robot name="hall">
  <link name="map">
    <collision><origin xyz="2 2 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
    <collision><origin xyz="6 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
  </link>
  {more}
</robot>
"""
DOOR = """
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="{width} 0.04 2"/></geometry></collision>
  </link>
  <joint name="door" type="revolute">
    <parent link="map"/><child link="leaf"/>
    <origin xyz="{x} 0.5 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.5" effort="0" velocity="0"/>
  </joint>
"""
SCENE = """
building: hall.urdf
route: {{waypoints: [{{x: 1.0, y: 0.0}}, {{x: 1.5, y: 0.0}}]}}
initial_pose: {initial_pose}
"""


def hall(folder: Path, more: str = "") -> Path:
    path = folder / "hall.urdf"
    path.write_text(WALLS.format(more=more))
    return path


def recorded(folder: Path, initial_pose: str = "{}") -> Path:
    scene = folder / "hall.scene.yaml"
    scene.write_text(SCENE.format(initial_pose=initial_pose))
    return simulate(scene, folder / "drive").log


def test_a_building_without_objects_gives_the_path_and_says_so(tmp_path: Path) -> None:
    building = hall(tmp_path)
    log = recorded(tmp_path)
    result = estimate_log([log], building, tmp_path / "out")
    assert result.objects == ()
    assert result.counts["estimates"] == 0
    assert any("no movable objects" in warning for warning in result.warnings)
    assert len(read_tum(tmp_path / "out" / "trajectory.tum").poses) == result.counts["poses"] > 0


def test_objects_that_were_never_near_are_a_warning(tmp_path: Path) -> None:
    building = hall(tmp_path, DOOR.format(x=500, width=0.9))
    result = estimate_log([recorded(tmp_path)], building, tmp_path / "out")
    assert any("No scan was near an object" in warning for warning in result.warnings)
    written = json.loads((tmp_path / "out" / "run.json").read_text())
    assert written["warnings"] == list(result.warnings)


def test_one_log_may_be_named_without_a_list(tmp_path: Path) -> None:
    building, log = hall(tmp_path, DOOR.format(x=2, width=0.9)), recorded(tmp_path)
    results = [
        estimate_log(logs, str(building), tmp_path / name)
        for logs, name in ((str(log), "text"), (log, "path"), ([log], "list"))
    ]
    assert len({(each.folder / "estimates.parquet").read_bytes() for each in results}) == 1


def test_a_truth_that_is_not_there_is_named_before_anything_is_estimated(tmp_path: Path) -> None:
    building, log, shares = hall(tmp_path), recorded(tmp_path), list[float]()
    for truth in ({"truth": tmp_path / "none.csv"}, {"true_path": tmp_path / "none.tum"}):
        with pytest.raises(TruthError, match=r"Can't read the truth .*none\.\w+: No such file"):
            estimate_log(
                log, building, tmp_path / "out", on_progress=lambda *at: shares.extend(at), **truth
            )
    assert shares == []


def test_a_world_carries_what_is_known_from_drive_to_drive(tmp_path: Path) -> None:
    building, world = hall(tmp_path, DOOR.format(x=2, width=0.9)), tmp_path / "world.db"
    log = recorded(tmp_path)
    first = estimate_log([log], building, tmp_path / "first", world=world)
    assert first.world is not None
    assert (first.world.known, first.world.had_the_log) == (0, False)
    assert first.world.added > 0
    learnt = world.read_bytes()
    again = estimate_log([log], building, tmp_path / "again", world=world)
    assert again.world == replace(first.world, added=0, had_the_log=True)
    assert world.read_bytes() == learnt
    tables = [tmp_path / name / "estimates.parquet" for name in ("first", "again")]
    assert tables[0].read_bytes() == tables[1].read_bytes()


def test_a_later_drive_starts_from_what_an_earlier_one_taught(tmp_path: Path) -> None:
    building, world = hall(tmp_path, DOOR.format(x=2, width=0.9)), tmp_path / "world.db"
    log = recorded(tmp_path)
    estimate_log([log], building, tmp_path / "first", RunOptions(end=1.0), world=world)
    rest = RunOptions(start=1.0, initial_pose=np.array([1.3, 0.0, 0.0]))
    later = estimate_log([log], building, tmp_path / "rest", rest, world=world)
    alone = estimate_log([log], building, tmp_path / "alone", rest)
    assert later.world is not None
    assert later.world.known == 1
    assert alone.world is None
    informed, ignorant = (read_estimates(result.folder)["std"][0] for result in (later, alone))
    assert informed < ignorant


def test_a_run_that_fails_teaches_nothing(tmp_path: Path) -> None:
    building, world = hall(tmp_path, DOOR.format(x=2, width=0.9)), tmp_path / "world.db"
    log = recorded(tmp_path, initial_pose="null")
    with pytest.raises(LogError):
        estimate_log([log], building, tmp_path / "out", world=world)
    assert open_store(world).drives() == []


def test_an_initial_pose_that_is_no_pose_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("objstate.simulation.drive._drawn", lambda *_: [[np.nan, 0.0, 0.0]])
    building = hall(tmp_path)
    log = recorded(tmp_path)
    with pytest.raises(LogError, match="/initialpose dropped: the pose is not finite"):
        estimate_log([log], building, tmp_path / "out")
    with pytest.raises(LogError, match=r"can be used \(a PoseArray, ParticleCloud or"):
        estimate_log([log], building, tmp_path / "out", RunOptions(belief="recorded"))


def test_a_log_is_the_same_by_what_is_read_of_it() -> None:
    files = [{"sha256": "a"}, {"sha256": "b"}]
    whole = log_identity(files, RunOptions())
    assert log_identity(files[::-1], RunOptions(seed=5)) == whole
    others = [
        log_identity(files[:1], RunOptions()),
        log_identity(files, RunOptions(end=3.0)),
        log_identity(files, RunOptions(topics=["/front"])),
    ]
    assert len({whole, *others}) == 4


def test_without_a_start_the_cure_is_named(tmp_path: Path) -> None:
    building = hall(tmp_path)
    log = recorded(tmp_path, initial_pose="null")
    with pytest.raises(LogError, match="--initial-pose X,Y,YAW, or --global"):
        estimate_log([log], building, tmp_path / "out")
    told = RunOptions(initial_pose=np.array([1.0, 0.0, 0.0]))
    assert estimate_log([log], building, tmp_path / "out", told).counts["poses"] > 0


@pytest.mark.parametrize(
    ("pose", "doubt"), [([2.0, 0.0, 0.0], False), ([2.0, 30.0, 0.0], True), ([-9.0, 0, 0], True)]
)
def test_a_start_outside_the_building_is_doubted(
    tmp_path: Path, pose: list[float], doubt: bool
) -> None:
    building = hall(tmp_path)
    told = RunOptions(initial_pose=np.array(pose))
    result = estimate_log([recorded(tmp_path)], building, tmp_path / "out", told)
    assert any("outside the building" in warning for warning in result.warnings) == doubt


def test_a_start_that_is_text_is_refused(tmp_path: Path) -> None:
    text: Any = "0,0,0"
    building, told = hall(tmp_path), RunOptions(initial_pose=text)
    with pytest.raises(SettingsError, match="give x, y in metres and yaw in radians"):
        estimate_log([recorded(tmp_path)], building, tmp_path / "out", told)


@pytest.mark.parametrize("x", [1e5, -1e300])
def test_a_start_far_beyond_the_building_is_refused(tmp_path: Path, x: float) -> None:
    building = hall(tmp_path)
    told = RunOptions(initial_pose=np.array([x, 0.0, 0.0]))
    with pytest.raises(SettingsError, match="away from the building"):
        estimate_log([recorded(tmp_path)], building, tmp_path / "out", told)
    assert not (tmp_path / "out").exists()


def test_a_loaded_building_in_place_of_its_path_is_refused(tmp_path: Path) -> None:
    loaded: Any = load_building(hall(tmp_path))
    with pytest.raises(TypeError, match=r"A Building is no path .*; give the path of its URDF"):
        estimate_log([recorded(tmp_path)], loaded, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("given", ["settings.yaml", Path("settings.yaml"), {}])
def test_settings_that_are_not_loaded_are_refused_by_the_options(given: Any) -> None:
    with pytest.raises(TypeError, match=r"is no Settings; give .*load_settings"):
        RunOptions(settings=given)


@pytest.mark.parametrize("given", [{"mounts": None}, {"clock_offsets": 0.1}])
def test_options_that_are_not_given_by_frame_are_refused(given: Any) -> None:
    with pytest.raises(TypeError, match="give a dict of lasers' frames"):
        RunOptions(**given)


@pytest.mark.parametrize("given", ["settings.yaml", Settings(), {}])
def test_what_is_no_options_is_refused(given: Any, tmp_path: Path) -> None:
    building, world = hall(tmp_path), tmp_path / "world.db"
    with pytest.raises(TypeError, match=r"is no RunOptions; give objstate.RunOptions\(...\)"):
        estimate_log([recorded(tmp_path)], building, tmp_path / "out", given, world=world)
    assert not world.exists()
    assert not (tmp_path / "out").exists()


def test_a_rule_for_no_object_is_doubted(tmp_path: Path) -> None:
    building = hall(tmp_path, DOOR.format(x=2, width=0.9))
    rules = (ObjectRule(match="dor*"), ObjectRule(match="do?r"))
    told = RunOptions(settings=Settings(objects=rules))
    warnings = estimate_log([recorded(tmp_path)], building, tmp_path / "out", told).warnings
    assert [rule.match for rule in rules if any(f"'{rule.match}'" in w for w in warnings)] == [
        "dor*"
    ]


@pytest.mark.parametrize(("frame", "height", "doubt"), [("laser", 0.3, None),
    ("laser", 0.0, "at a height of 0 m"), ("lasr", 0.3, "--mount names 'lasr'")])  # fmt: skip
def test_a_mounting_that_cannot_be_is_doubted(
    tmp_path: Path, frame: str, height: float, doubt: str | None
) -> None:
    building = hall(tmp_path)
    log = recorded(tmp_path)
    told = RunOptions(mounts={frame: transform(np.eye(3), [0.0, 0.0, height])})
    warnings = estimate_log([log], building, tmp_path / "out", told).warnings
    doubts = [warning for warning in warnings if "mount" in warning]
    assert [doubt in warning for warning in doubts] == [True] * (doubt is not None)


@pytest.mark.parametrize(
    ("x", "y", "way"),
    [(0.2, 0.0, "east"), (-0.1, 0.11, "north-west"), (0.0, -0.3, "south"), (-0.2, -0.01, "west")],
)
def test_the_way_to_a_hinge_is_told_by_the_compass(x: float, y: float, way: str) -> None:
    assert compass(x, y) == way


def test_a_door_that_hangs_elsewhere_is_told_with_where(tmp_path: Path) -> None:
    model = hall(tmp_path, DOOR.format(x=2, width=0.9)).rename(tmp_path / "model.urdf")
    real = DOOR.format(x=2, width=0.9).replace("2 0.5 0", "2 0.7 0")
    hall(tmp_path, real)
    scene = tmp_path / "pass.scene.yaml"
    route = "{waypoints: [{x: -1.0, y: -0.8}, {x: 5.0, y: -0.8}]}"
    scene.write_text(
        f"building: hall.urdf\nroute: {route}\nobjects: [{{name: door, initial: 0.3}}]\n"
    )
    log = simulate(scene, tmp_path / "drive", seed=1).log
    loose = Settings(building_error=BuildingErrorSettings(hinge_std_m=0.1))
    options = RunOptions(settings=loose)
    warnings = estimate_log([log], model, tmp_path / "out", options).warnings
    (told,) = [warning for warning in warnings if "hinge" in warning]
    assert "The hinge of door 'door' seems to be 0." in told
    assert "north of its place in the model" in told


POST = '<collision><origin xyz="-1.5 1 1"/><geometry><box size="0.5 0.5 2"/></geometry></collision>'


def lost_in_a_square(folder: Path, more: str, waypoints: str, told: RunOptions) -> Sequence[str]:
    """The warnings of a drive through a room that looks the same from four places, but for ``more``."""
    side = (
        '<collision><origin xyz="{} {} 1"/><geometry><box size="{} {} 2"/></geometry></collision>'
    )
    sides = ((0, 2.5, 5, 0.1), (0, -2.5, 5, 0.1), (2.5, 0, 0.1, 5), (-2.5, 0, 0.1, 5))
    walls = "".join(side.format(*numbers) for numbers in sides)
    building = folder / "square.urdf"
    building.write_text(f'<robot name="square"><link name="map">{walls}{more}</link></robot>')
    scene = folder / "square.scene.yaml"
    scene.write_text(f"building: square.urdf\nroute: {{waypoints: {waypoints}}}\n")
    log = simulate(scene, folder / "drive", seed=1).log
    return estimate_log([log], building, folder / "out", told).warnings


@pytest.mark.parametrize(("more", "found"), [(POST, True), ("", False)])
def test_a_robot_that_might_be_anywhere_is_told_of_as_found_or_not(
    tmp_path: Path, more: str, found: bool
) -> None:
    told = RunOptions(global_start=True)
    there = "[{x: 1.5, y: 0.3}, {x: 0.0, y: 0.3}, {x: 0.0, y: -1.0}, {x: -1.0, y: -1.0}]"
    warnings = lost_in_a_square(tmp_path, more, there, told)
    (where,) = [warning for warning in warnings if "start was unknown" in warning]
    assert ("was not found" in where) is not found
    assert not any("probably lost" in w or "dead reckoning" in w for w in warnings)


def test_a_robot_that_stays_lost_is_not_told_to_have_been_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    carried = (
        "[{x: 1.5, y: 0.3}, {x: 0.5, y: 0.3, kidnapped_to: {x: 0.9, y: -1.4, yaw: 0.5}}, "
        "{x: 0.0, y: 1.2}, {x: 1.5, y: 0.3}]"
    )
    monkeypatch.setattr(LocalizationSettings, "slips_per_hour", 1e-3)
    warnings = lost_in_a_square(tmp_path, "", carried, RunOptions())
    assert any("was probably lost from" in warning for warning in warnings)
    assert any(
        "At the log's end the robot is still probably lost" in warning for warning in warnings
    )


def test_objects_that_no_beam_bore_on_are_a_warning(tmp_path: Path) -> None:
    low = DOOR.format(x=2, width=0.9).replace(" 0.04 2", " 0.04 0.2")
    building = hall(tmp_path, low.replace("0.45 0 1", "0.45 0 0.1"))
    result = estimate_log([recorded(tmp_path)], building, tmp_path / "out")
    assert result.counts["estimates"] > 0
    assert any("no beam reached" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("narrowed", "where"),
    [({"start": 0.3}, "after --from"), ({"topics": ["/scan", "/odom"]}, "topics")],
)
def test_a_start_that_was_left_out_is_told_so(
    tmp_path: Path, narrowed: dict[str, Any], where: str
) -> None:
    building = hall(tmp_path)
    with pytest.raises(LogError, match=where):
        estimate_log([recorded(tmp_path)], building, tmp_path / "out", RunOptions(**narrowed))


def test_nowhere_to_search_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bare.urdf").write_text('<robot name="bare"><link name="map"/></robot>')
    hall(tmp_path)
    told = RunOptions(global_start=True)
    with pytest.raises(BuildingError, match="needs walls"):
        estimate_log([recorded(tmp_path)], tmp_path / "bare.urdf", tmp_path / "out", told)


def test_what_a_drive_taught_about_the_odometry_is_told(tmp_path: Path) -> None:
    scene = tmp_path / "far.scene.yaml"
    scene.write_text(
        "building: hall.urdf\n"
        "route: {waypoints: [{x: -1.5, y: 0.0}, {x: 5.0, y: 0.5}, {x: -1.5, y: 0.0}]}\n"
        "odometry: {translation_scale: 0.05}\n"
    )
    building = hall(tmp_path)
    estimate_log([simulate(scene, tmp_path / "drive").log], building, tmp_path / "out")
    told = json.loads((tmp_path / "out" / "run.json").read_text())["odometry_error"]
    ahead, aside, turned = np.array(told["systematic"])[:, 0]
    assert ahead == pytest.approx(-0.05 / 1.05, abs=0.015)
    assert max(abs(aside), abs(turned)) < 0.015
    assert 0.0 < told["length_factor"] < 1.0  # of the alphas' variance


def test_progress_grows_to_the_end(tmp_path: Path) -> None:
    building = hall(tmp_path)
    seen: list[tuple[float, float]] = []
    result = estimate_log(
        [recorded(tmp_path)], building, tmp_path / "out", on_progress=lambda *now: seen.append(now)
    )
    assert seen == sorted(seen)
    assert len(seen) == result.counts["Scan"]
    assert 0.0 <= seen[0][0] <= seen[-1][0] <= 1.0
    assert seen[-1][1] == pytest.approx(result.log_seconds, abs=0.5)


@pytest.mark.parametrize("change", [{"x": 3, "width": 0.9}, {"x": 2, "width": 0.8}])
def test_the_digest_of_a_building_tells_other_geometry(
    tmp_path: Path, change: dict[str, float]
) -> None:
    def digest(more: str) -> str:
        path = hall(tmp_path, more)
        return str(describe_building(path, load_building(path))["geometry_sha256"])

    same = DOOR.format(x=2, width=0.9)
    assert digest(same) == digest(same + "<!-- a remark -->")
    assert digest(same) != digest(DOOR.format(**change))


def test_every_file_of_a_bag_folder_is_described(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "b.db3").write_bytes(b"second")
    (tmp_path / "bag" / "a.yaml").write_bytes(b"")
    first, second = describe_log(tmp_path / "bag")
    assert (Path(first["path"]).name, first["bytes"]) == ("a.yaml", 0)
    assert first["sha256"].startswith("e3b0c44298fc1c14")  # of nothing
    assert second["bytes"] == 6


def test_options_are_json() -> None:
    options = RunOptions(initial_pose=np.zeros(3), topics={"/b", "/a"}, mounts={"l": np.eye(4)})
    told = json.loads(json.dumps(options.to_dict()))
    assert told["initial_pose"] == [0, 0, 0]
    assert told["topics"] == ["/a", "/b"]
    assert told["mounts"]["l"][3] == [0, 0, 0, 1]


def test_observers_see_every_record_in_order_and_what_it_changed(tmp_path: Path) -> None:
    class Witness:
        def __init__(self) -> None:
            self.stamps: list[int] = []
            self.kinds: list[str] = []
            self.estimates = 0

        def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
            self.stamps.append(record.stamp_ns)
            self.kinds.append(type(record).__name__)
            self.estimates += len(estimates)
            assert set(estimator.objects) == {"door"}

    building, log = hall(tmp_path, DOOR.format(x=2, width=0.9)), recorded(tmp_path)
    witness = Witness()
    seen = estimate_log([log], building, tmp_path / "seen", observers=[witness])
    assert witness.stamps == sorted(witness.stamps)
    assert {kind: witness.kinds.count(kind) for kind in set(witness.kinds)} == {
        kind: count for kind, count in seen.counts.items() if kind not in ("estimates", "poses")
    }
    assert witness.estimates == seen.counts["estimates"] > 0
    estimate_log([log], building, tmp_path / "alone")
    for name in ("estimates.parquet", "posteriors.parquet", "scans.parquet", "trajectory.tum"):
        assert (tmp_path / "seen" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()


def test_posteriors_are_recorded_once_a_second_while_an_object_is_near(tmp_path: Path) -> None:
    building, log = hall(tmp_path, DOOR.format(x=2, width=0.9)), recorded(tmp_path)
    estimate_log([log], building, tmp_path / "out")
    estimates = read_estimates(tmp_path / "out")
    stamps = read_posteriors(tmp_path / "out")["stamp"].to_numpy()
    assert stamps[0] == estimates["stamp"][0]
    assert (np.diff(stamps) >= 10**9).all()
    assert set(stamps) <= set(estimates["stamp"])
    assert len(stamps) == 1 + (estimates["stamp"][-1] - estimates["stamp"][0]) // 10**9


def test_inputs_are_found_again_when_they_move_with_the_result(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    building, log = hall(tmp_path / "old"), recorded(tmp_path / "old")
    truth = log.parent / "truth.csv"
    estimate_log([log], building, tmp_path / "old" / "out", truth=truth)
    (tmp_path / "old").rename(tmp_path / "new")
    out = tmp_path / "new" / "out"
    inputs = json.loads((out / "run.json").read_text())["inputs"]
    assert (out / inputs["building"]["from_result"]).is_file()
    assert (out / inputs["truth"]["from_result"]).is_file()
    assert "true_path" not in inputs


@pytest.mark.parametrize(
    "dropped",
    [
        "InitialPose dropped: more than 1 s behind others in the log; do all clocks agree?",
        "Belief on /amcl_pose dropped: its covariance is not finite",
        "Belief on /initialpose dropped: it is in the frame 'odom', not 'map'",
        "Message on /robot1/initialpose dropped: it is damaged",
    ],
)
def test_a_start_that_was_dropped_is_not_called_missing(dropped: str) -> None:
    others = "Odometry dropped: a second one of the same stamp", "InitialPose"
    log: Any = SimpleNamespace(counts=dict.fromkeys([*others, dropped], 1))
    told = unknown_start(log, RunOptions())
    assert told.startswith(f"The robot's start is unknown: {dropped}; give --initial-pose")
