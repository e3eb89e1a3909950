"""The commands on real input: a room with a door, simulated, and all that can be done with it."""

import json
import os
import pty
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.cli import main
from objstate.recording.grids import read_clutter

ROOT = Path(__file__).parents[2]

ROOM = """
<robot name="room">
  <link name="map">
    <collision><origin xyz="2 -2 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
    <collision><origin xyz="-2 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="6 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="0 2 1"/><geometry><box size="4 0.1 2"/></geometry></collision>
    <collision><origin xyz="4.45 2 1"/><geometry><box size="3.1 0.1 2"/></geometry></collision>
    <collision><origin xyz="2 4 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
  </link>
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="office_door" type="revolute">
    <parent link="map"/><child link="leaf"/>
    <origin xyz="2 2 0"/><axis xyz="0 0 -1"/>
    <limit lower="0" upper="1.6" effort="0" velocity="0"/>
  </joint>
</robot>
"""

SCENE = """
building: room.urdf
route: {waypoints: [{x: 1.0, y: 0.0, pause: 0.5}, {x: 3.0, y: 0.3, pause: 0.5}]}
lasers: [{frame: laser, rate: 10.0, range_max: 10.0}]
objects: [{name: office_door, initial: 0.6}]
"""


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a building and a simulated drive through it."""
    folder = tmp_path_factory.mktemp("drive")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    assert main(["simulate", str(folder / "room.scene.yaml"), "--out", str(folder / "log")]) == 0
    return folder


@pytest.fixture(scope="module")
def estimated(drive: Path) -> Path:
    """The result of the drive's estimation."""
    result = drive / "result"
    building, log = drive / "room.urdf", drive / "log" / "log.mcap"
    assert main(["estimate", str(log), "--building", str(building), "--out", str(result)]) == 0
    return result


def words(text: str, first: str) -> list[str]:
    """The words of the line that begins with ``first``."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


def test_estimate_finds_the_door_and_shows_it_beside_the_truth(run, drive: Path) -> None:
    log = drive / "log"
    outcome = run(
        "estimate", log / "log.mcap", "--building", drive / "room.urdf", "--out", drive / "shown",
        "--truth", log / "truth.csv", "--path", log / "path.tum",
    )  # fmt: skip
    assert outcome.code == 0
    name, state, unit, angle, lower, _, upper, true, error, seen = words(outcome.out, "office_door")
    assert (name, state, unit) == ("office_door", "angle", "(deg)")
    assert float(true) == pytest.approx(34.4)  # 0.6 rad
    assert abs(float(error)) < 5
    assert float(lower) <= float(angle) <= float(upper)
    assert float(seen) > 1
    assert float(words(outcome.out, "position")[2]) < 0.2
    assert str(drive / "shown" / "estimates.parquet") in outcome.out


def test_a_result_holds_what_the_formats_say(estimated: Path) -> None:
    frame = pl.read_parquet(estimated / "estimates.parquet")
    assert frame.columns == [
        "stamp", "object", "coordinate", "mean", "std", "lower", "upper", "observed",
        "fit", "presence", "lost", "p_closed", "p_localized", "median",
    ]  # fmt: skip
    assert frame["object"].unique().to_list() == ["office_door"]
    summary = json.loads((estimated / "run.json").read_text())
    assert summary["options"]["seed"] == 0
    assert summary["options"]["settings"]["beam_model"]["sigma_hit"] > 0
    assert len(summary["inputs"]["logs"][0]["sha256"]) == 64
    assert summary["counts"]["estimates"] == len(frame)
    assert summary["objects"] == ["office_door"]
    poses = (estimated / "trajectory.tum").read_text().splitlines()[1:]
    assert len(poses) == summary["counts"]["Scan"] == summary["counts"]["poses"]


def test_the_same_seed_gives_the_same_bytes(run, drive: Path, estimated: Path) -> None:
    again = drive / "again"
    log, building = drive / "log" / "log.mcap", drive / "room.urdf"
    assert run("estimate", log, "--building", building, "--out", again).code == 0
    for name in ("estimates.parquet", "trajectory.tum"):
        assert (again / name).read_bytes() == (estimated / name).read_bytes()


def test_what_the_building_does_not_know_is_mapped_where_asked(run, drive: Path) -> None:
    scene = SCENE + "boxes: [{size: [0.5, 0.5, 1.0], pose: {x: 4.5, y: -0.8}}]\n"
    (drive / "box.scene.yaml").write_text(scene)
    assert run("simulate", drive / "box.scene.yaml", "--out", drive / "boxed").code == 0
    given = ["estimate", drive / "boxed" / "log.mcap", "--building", drive / "room.urdf", "--out"]
    outcome = run(*given, drive / "mapped", "--grid")
    assert outcome.code == 0, outcome.err
    files = ("clutter.parquet", "grid.yaml", "grid.pgm")
    for name in files:
        assert str(drive / "mapped" / name) in outcome.out
    last = read_clutter(drive / "mapped").row(-1, named=True)
    at = np.column_stack([last["x"], last["y"]]) / 100.0
    assert len(at) > 3
    assert (np.abs(at - [4.5, -0.8]) < 0.35).all(axis=1).mean() > 0.9
    outcome = run(*given, drive / "plain")
    assert outcome.code == 0
    assert not any((drive / "plain" / name).exists() for name in files)
    for name in ("estimates.parquet", "trajectory.tum"):  # the map changes no estimate
        assert (drive / "plain" / name).read_bytes() == (drive / "mapped" / name).read_bytes()


def test_an_existing_result_is_replaced_only_when_asked(run, drive: Path, estimated: Path) -> None:
    before = (estimated / "run.json").read_bytes()
    log, building = drive / "log" / "log.mcap", drive / "room.urdf"
    outcome = run("estimate", log, "--building", building, "--out", estimated)
    assert outcome.code == 1
    assert "--overwrite" in outcome.err
    assert (estimated / "run.json").read_bytes() == before


def test_a_path_alone_is_evaluated_and_aligned(run, drive: Path, estimated: Path) -> None:
    path = drive / "log" / "path.tum"
    outcome = run("evaluate", estimated, "--path", path, "--align", "--json", drive / "path.json")
    assert outcome.code == 0
    assert "ATE" in outcome.out
    assert "moved by" in outcome.out
    assert "object" not in outcome.out
    assert json.loads((drive / "path.json").read_text())["robot"]["position"]["rms"] < 0.2
    assert "--path TUM" in run("evaluate", estimated).err
    assert "--path TUM" in run("evaluate", estimated, "--truth", "t.csv", "--align").err


def test_a_log_of_no_length_is_no_success(run, drive: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf", "-q",
        "--out", drive / "moment", "--from", "1", "--to", "1.01", "--initial-pose", "1,0,0",
        "--world", drive / "moment.db",
    )  # fmt: skip
    assert outcome.code == 3
    assert "error: The log has no duration" in outcome.err
    assert "learnt nothing, since the result isn't reliable" in outcome.out
    assert json.loads((drive / "moment" / "run.json").read_text())["success"] is False


def test_a_truth_of_another_building_is_doubted(run, drive: Path) -> None:
    truth = drive / "other.csv"
    truth.write_text("stamp,object,coordinate,value\n0,garage_door,angle,0\n")
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "doubted", "--truth", truth, "--to", "1",
    )  # fmt: skip
    assert outcome.code == 0
    assert "truth names none" in outcome.err


def test_a_path_of_another_log_is_an_error_after_the_result(run, drive: Path) -> None:
    path = drive / "other.tum"
    path.write_text("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n")
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "pathless", "--path", path, "--to", "1",
    )  # fmt: skip
    assert outcome.code == 1
    assert "use the path of the same log" in outcome.err
    assert "Written: " in outcome.out


def test_evaluate_prints_no_empty_tables(run, drive: Path, estimated: Path) -> None:
    blind = drive / "blind"
    shutil.copytree(estimated, blind)
    states = pl.read_parquet(blind / "smoothed.parquet")
    states.with_columns(observed=pl.lit(False)).write_parquet(blind / "smoothed.parquet")
    outcome = run("evaluate", blind, "--truth", drive / "log" / "truth.csv")
    assert outcome.code == 0
    assert outcome.out == (
        "No object was observed while its true state is known.\nNever observed: office_door\n"
    )


def test_a_truth_that_begins_after_the_log_is_refused(run, drive: Path, estimated: Path) -> None:
    truth = drive / "late.csv"
    truth.write_text("stamp,object,coordinate,value\n1700000000000000000,office_door,angle,0.6\n")
    outcome = run("evaluate", estimated, "--truth", truth)
    assert outcome.code == 1
    assert "s after the log's end; is it that of another drive?" in outcome.err


def test_a_building_without_objects_is_shown_without_a_table(run, tmp_path: Path) -> None:
    (tmp_path / "walls.urdf").write_text(ROOM.partition('<link name="leaf">')[0] + "</robot>")
    outcome = run("inspect", tmp_path / "walls.urdf")
    assert outcome.code == 0
    assert outcome.out.splitlines()[-2:] == ["No movable objects.", "No problems found."]


def test_a_height_that_is_none_is_refused(run, drive: Path) -> None:
    outcome = run("inspect", drive / "room.urdf", "--height", "nan")
    assert outcome.code == 1
    assert "--height" in outcome.err


def test_a_failed_run_leaves_nothing_behind(run, drive: Path) -> None:
    log, building, out = drive / "log" / "log.mcap", drive / "room.urdf", drive / "failed"
    outcome = run("estimate", log, "--building", building, "--out", out, "--belief", "recorded")
    assert outcome.code == 1
    assert "--belief own" in outcome.err
    assert not out.exists()
    assert not list(drive.glob(".failed*"))


@pytest.mark.parametrize(
    ("options", "cure"),
    [
        (["--initial-pose", "1,2"], "X,Y,YAW"),
        (["--initial-pose", "1,0,0", "--global"], "exclude each other"),
        (["--topics", "/scna"], "/scan"),
        (["--mount", "laser=1"], "FRAME=x,y,z,roll,pitch,yaw"),
        (["--from", "1000"], "start and the end"),
        (["--from", "nan"], "--from nan"),
        (["--to", "inf"], "--to inf"),
        (["--seed", "-1"], "greater than or equal to 0"),
        (["--config", "{config}"], "sigma_hit"),
        (["--truth", "{scene}"], "is a scene, not a table of true states"),
        (["--belief", "recrded"], "recorded"),
    ],
)
def test_a_wrong_option_is_refused_with_its_cure(
    run, drive: Path, options: list[str], cure: str
) -> None:
    config = drive / "settings.yaml"
    config.write_text("beam_model: {sigma_hitt: 0.1}\n")
    given = [each.format(config=config, scene=drive / "room.scene.yaml") for each in options]
    log, building, out = drive / "log" / "log.mcap", drive / "room.urdf", drive / "refused"
    outcome = run("estimate", log, "--building", building, "--out", out, *given)
    assert outcome.code == 1
    assert outcome.err.startswith("error: ")
    assert cure in outcome.err
    assert not out.exists()


def test_the_start_may_be_given_in_degrees_and_part_of_the_log_be_taken(run, drive: Path) -> None:
    log, out = drive / "log" / "log.mcap", drive / "part"
    outcome = run(
        "estimate", log, "--building", drive / "room.urdf", "--out", out,
        "--initial-pose", "1,0,8.5deg", "--to", "1.05", "--seed", "3", "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    options = json.loads((out / "run.json").read_text())["options"]
    assert options["initial_pose"] == pytest.approx([1, 0, 0.148353])
    assert (options["seed"], options["end"]) == (3, 1.05)
    assert len((out / "trajectory.tum").read_text().splitlines()) - 1 in (10, 11)


def test_evaluate_prints_errors_and_writes_them(run, drive: Path, estimated: Path) -> None:
    figures = drive / "errors.json"
    log = drive / "log"
    outcome = run(
        "evaluate", estimated, "--truth", log / "truth.csv", "--path", log / "path.tum",
        "--json", figures,
    )  # fmt: skip
    assert outcome.code == 0
    name, state, unit, count, mean, *_ = words(outcome.out, "office_door")
    assert (name, state, unit, count) == ("office_door", "angle", "(deg)", "1")
    written = json.loads(figures.read_text())
    (door,) = written["objects"]
    assert f"{door['final']['mean'] * 57.29578:.1f}" == mean
    assert written["robot"]["position"]["end"] < 0.2


def test_evaluate_names_the_file_it_cannot_write(run, drive: Path, estimated: Path) -> None:
    truth = drive / "log" / "truth.csv"
    outcome = run("evaluate", estimated, "--truth", truth, "--json", drive)
    assert outcome.code == 1
    assert str(drive) in outcome.err
    assert "choose another place" in outcome.err


def test_inspect_shows_a_log(run, drive: Path) -> None:
    outcome = run("inspect", drive / "log" / "log.mcap")
    assert outcome.code == 0
    topic, kind, *_ = words(outcome.out, "/scan")
    assert (topic, kind) == ("/scan", "sensor_msgs/msg/LaserScan")
    assert words(outcome.out, "laser") == ["laser", "0.000", "0.000", "0.300", "0.0", "0.0", "0.0"]


def test_a_reader_of_tables_may_leave_early(drive: Path) -> None:
    command = [sys.executable, ROOT / "cli.py", "inspect", drive / "log" / "log.mcap"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        process.stdout.close()
        _, err = process.communicate()
    assert (process.returncode, err) == (0, b"")


def test_inspect_shows_the_same_to_programs(run, drive: Path) -> None:
    shown = json.loads(run("inspect", drive / "log" / "log.mcap", "--json").out)
    (laser,) = shown["lasers"]
    assert (laser["frame"], laser["beams"]) == ("laser", [181])
    assert {topic["name"] for topic in shown["topics"]} >= {"/scan", "/odom", "/tf_static"}


def test_convert_keeps_every_message(run, drive: Path) -> None:
    log, bag = drive / "log" / "log.mcap", drive / "log.bag"
    outcome = run("convert", log, bag)
    assert outcome.code == 0
    before, after = (json.loads(run("inspect", path, "--json").out) for path in (log, bag))
    for key in ("name", "count"):
        assert [t[key] for t in before["topics"]] == [t[key] for t in after["topics"]]


def test_an_unknown_format_is_refused_with_the_known(run, drive: Path) -> None:
    outcome = run("convert", drive / "log" / "log.mcap", drive / "x", "--format", "mcapp")
    assert outcome.code == 1
    assert "rosbag2" in outcome.err


def test_a_folder_stands_for_the_building_in_it(run, drive: Path, tmp_path: Path) -> None:
    shutil.copy(drive / "room.urdf", tmp_path / "room.urdf")
    assert run("inspect", tmp_path).out == run("inspect", tmp_path / "room.urdf").out
    log, out = drive / "log" / "log.mcap", tmp_path / "out"
    assert run("estimate", log, "--building", tmp_path, "--out", out).code == 0
    told = json.loads((out / "run.json").read_text())["inputs"]["building"]
    assert told["path"] == str(tmp_path / "room.urdf")
    shutil.copy(log, tmp_path)
    assert "Records:" in run("inspect", tmp_path).out


def test_inspect_shows_a_building(run, drive: Path) -> None:
    outcome = run("inspect", drive / "room.urdf")
    assert outcome.code == 0
    name, kind, x, y, *states = words(outcome.out, "office_door")
    assert (name, kind, x, y) == ("office_door", "hinged", "2.00", "2.00")
    assert states[:4] == ["0", "to", "92", "deg"]


def test_a_building_is_known_by_its_content(run, drive: Path) -> None:
    unnamed = drive / "room"
    unnamed.write_text(ROOM)
    shown = json.loads(run("inspect", unnamed, "--json").out)
    assert [item["name"] for item in shown["objects"]] == ["office_door"]


def test_problems_found_are_no_failure(run, drive: Path) -> None:
    endless = drive / "endless.urdf"
    endless.write_text(ROOM.replace('<limit lower="0" upper="1.6" effort="0" velocity="0"/>', ""))
    outcome = run("inspect", endless)
    assert outcome.code == 0
    assert "limit" in outcome.out.partition("Problems:")[2]


def test_buildings_are_inspected_one_by_one(run, drive: Path) -> None:
    outcome = run("inspect", drive / "room.urdf", drive / "log" / "log.mcap")
    assert outcome.code == 1
    assert "alone" in outcome.err


def test_a_map_becomes_a_building_that_tells_what_was_done(run, tmp_path: Path) -> None:
    rows = ["0 " * 40] * 2 + ["0 0 " + "254 " * 36 + "0 0"] * 36 + ["0 " * 40] * 2
    (tmp_path / "map.pgm").write_text("P2\n40 40\n255\n" + "\n".join(rows) + "\n")
    (tmp_path / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "doors.csv").write_text(
        "door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg\n"
        "exit,1.0,3.85,0,cw,0.9,90\n"
    )
    outcome = run(
        "building", "from-map", tmp_path / "map.yaml", "--doors", tmp_path / "doors.csv",
        "--out", tmp_path / "made",
    )  # fmt: skip
    assert outcome.code == 0
    assert "exit" in outcome.out
    urdf = outcome.out.rpartition("Written: ")[2].strip()
    shown = json.loads(run("inspect", urdf, "--json").out)
    assert [item["name"] for item in shown["objects"]] == ["exit"]


def test_a_terminal_sees_how_far_the_run_is_and_a_pipe_does_not(run, drive: Path) -> None:
    arguments = [
        "estimate", drive / "log" / "log.mcap",
        "--building", drive / "room.urdf", "--out", drive / "watched", "--overwrite",
    ]  # fmt: skip
    assert b"x real time" in stderr_of_a_terminal([sys.executable, ROOT / "cli.py", *arguments])
    piped = run(*arguments)  # its output is caught, and no terminal
    assert (piped.code, piped.err) == (0, "")


def stderr_of_a_terminal(arguments: list[object]) -> bytes:
    """What a program writes to stderr when that is a terminal."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=theirs) as process:
        os.close(theirs)
        seen = b""
        with suppress(OSError):  # Linux reports the end of a terminal as an error
            while part := os.read(ours, 4096):
                seen += part
    os.close(ours)
    assert process.returncode == 0
    return seen


def test_evaluate_takes_the_whole_log_unless_asked_not_to(
    run, drive: Path, estimated: Path
) -> None:
    truth, errors = drive / "log" / "truth.csv", dict[str, float]()
    for name, option in (("smoothed", ()), ("filtered", ("--filtered",))):
        figures = drive / f"{name}.json"
        outcome = run("evaluate", estimated, "--truth", truth, "--json", figures, *option)
        assert outcome.code == 0
        (door,) = json.loads(figures.read_text())["objects"]
        errors[name] = door["updates"]["mean"]
    assert errors["smoothed"] < errors["filtered"]
