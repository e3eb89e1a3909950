"""What is fuzzed: for each kind of file its seeds, and what objstate does with such a file."""

from __future__ import annotations

import shutil
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from objstate.batch.manifest import read_manifest
from objstate.building import building_from_map, inspect_building, load_building
from objstate.calibration.files import read_calibration
from objstate.cli.building_tables import describe_building
from objstate.cli.console import print_parts
from objstate.cli.log_tables import describe_log
from objstate.config import load_settings
from objstate.conversion import convert
from objstate.errors import LogError, ObjstateError, ResultError
from objstate.logs import inspect_log, open_log, open_messages
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.run import RunOptions
from objstate.simulation.scene import load_scene
from tests.fuzz import seeds
from tests.fuzz.scans import plain_count


class FewerFoundError(AssertionError):
    """A reader found fewer messages than a plain scan."""


class PoorMessageError(AssertionError):
    """An error that doesn't say what is wrong where."""


class WrongCountError(AssertionError):
    """A conversion that lists what the new log doesn't hold."""


@dataclass(frozen=True)
class Target:
    """One kind of file."""

    seeds: Callable[[], list[bytes]]
    name: str  # of the file, in a folder of its own
    read: Callable[[Path], object]
    is_text: bool = True
    prepare: Callable[[Path], object] = lambda folder: None  # what lies beside it


def run(target: Target, content: bytes, folder: Path) -> None:
    """What becomes of one file; any exception but objstate's own gets out."""
    path = folder / target.name
    path.write_bytes(content)
    try:
        target.read(path)
    except ObjstateError as error:
        _check_message(str(error), path)


def _check_message(message: str, path: Path) -> None:
    """Where is the file, or what is named in it; the cure, another clause."""
    says_where = path.name in message or path.parent.name in message or "log" in message
    if not says_where or not any(sign in message for sign in (";", ". ", ": ")):
        raise PoorMessageError(message)


def read_log(path: Path) -> None:
    """Everything that can be done with a log."""
    found = sum(1 for _ in open_messages(path))
    if found < (expected := plain_count(path)):
        raise FewerFoundError(f"{found} messages instead of {expected}")
    turn = zlib.crc32(path.read_bytes())  # not all of every file: that would take long
    if turn % 4 == 1:
        _convert(path)
    elif turn % 16 == 0 and found:
        print_parts(describe_log(inspect_log(path)))
    elif turn % 4 == 0 and found:
        inspect_log(path)
    else:
        _read_records(path)


def _read_records(path: Path) -> None:
    try:
        for _ in open_log(path):
            pass
    except LogError as error:
        _check_message(str(error), path)


def _convert(path: Path) -> None:
    """To every format in turn, by the file's length; what is told is what is there."""
    ending = (".log", ".mcap", ".bag")[zlib.crc32(path.read_bytes()) // 4 % 3]
    target = path.parent / f"converted{ending}"
    try:
        result = convert(path, target, overwrite=True)
    except (LogError, ResultError):
        return
    if ending == ".log":
        told = sum(n for topic, n in result.counts.items() if topic in _scan_topics(path))
        held = sum(m.topic in ("/scan", "/rear_scan") for m in _messages_if_any(target))
    else:
        told, held = sum(result.counts.values()), len(_messages_if_any(target))
    target.unlink()
    if told != held:
        raise WrongCountError(f"{told} messages told, {held} in the {ending}")


def _messages_if_any(path: Path) -> list:
    return list(open_messages(path)) if path.stat().st_size else []


def _scan_topics(path: Path) -> set[str]:
    return {m.topic for m in open_messages(path) if m.type == "sensor_msgs/msg/LaserScan"}


def _beside_metadata(folder: Path) -> None:
    (folder / "a.db3").write_bytes(seeds.bag2()[0])


def read_bag(metadata: Path) -> None:
    messages = open_messages(metadata.parent)
    if len(list(messages)) < 17:
        raise FewerFoundError("; ".join(messages.warnings))


def read_building(path: Path) -> None:
    print_parts(describe_building(inspect_building(path)))
    load_building(path)


def read_building_of_mesh(path: Path) -> None:
    read_building(path.parent / "room.urdf")


def _beside_mesh(name: str) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        box, mesh = '<box size="0.1 4 2.5"/>', f'<mesh filename="{name}"/>'
        (folder / "room.urdf").write_text(seeds.URDF.replace(box, mesh, 1))

    return prepare


def _beside_map(folder: Path) -> None:
    (folder / "map.yaml").write_text(seeds.MAP_YAML)
    (folder / "map.pgm").write_bytes(seeds.picture())
    (folder / "doors.csv").write_text(seeds.DOORS)


def make_building(path: Path) -> None:
    """Of the map in the folder, which is mutated in one of its files."""
    folder = path.parent
    out = folder / "out"
    try:
        building_from_map(folder / "map.yaml", folder / "doors.csv", out)
        load_building(next(out.glob("*.urdf")))
    finally:
        shutil.rmtree(out, ignore_errors=True)


def read_manifest_file(path: Path) -> None:
    read_manifest(str(path), None, RunOptions())


def _beside_manifest(folder: Path) -> None:
    (folder / "settings.yaml").write_text(seeds.SETTINGS)


def read_settings(path: Path) -> None:
    settings = load_settings(path)
    for name, kind in (("door_1", "door"), ("chair_1", "furniture")):
        try:
            settings.for_object(name, kind)
        except ObjstateError as error:
            _check_message(f"{path}: {error}", path)


def _text(*texts: str) -> Callable[[], list[bytes]]:
    return lambda: [text.encode() for text in texts]


LOGS = {
    "mcap": Target(seeds.mcap, "a.mcap", read_log, is_text=False),
    "rosbag1": Target(seeds.bag1, "a.bag", read_log, is_text=False),
    "rosbag2": Target(seeds.bag2, "a.db3", read_log, is_text=False),
    "carmen": Target(seeds.carmen, "a.log", read_log),
}
FILES = {
    "metadata": Target(seeds.metadata, "metadata.yaml", read_bag, prepare=_beside_metadata),
    "urdf": Target(_text(seeds.URDF), "room.urdf", read_building),
    "stl": Target(
        _text(seeds.STL), "leaf.stl", read_building_of_mesh, prepare=_beside_mesh("leaf.stl")
    ),
    "obj": Target(
        _text(seeds.OBJ), "leaf.obj", read_building_of_mesh, prepare=_beside_mesh("leaf.obj")
    ),
    "settings": Target(_text(seeds.SETTINGS), "settings.yaml", read_settings),
    "scene": Target(_text(seeds.SCENE), "a.scene.yaml", load_scene),
    "calibration": Target(_text(seeds.CALIBRATION), "calibration.yaml", read_calibration),
    "doors": Target(_text(seeds.DOORS), "doors.csv", make_building, prepare=_beside_map),
    "map": Target(_text(seeds.MAP_YAML), "map.yaml", make_building, prepare=_beside_map),
    "picture": Target(
        seeds.pictures, "map.pgm", make_building, is_text=False, prepare=_beside_map
    ),
    "truth": Target(_text(seeds.TRUTH), "truth.csv", read_truth),
    "path": Target(_text(seeds.PATH), "path.tum", read_tum),
    "manifest": Target(
        _text(seeds.MANIFEST), "manifest.csv", read_manifest_file, prepare=_beside_manifest
    ),
    "manifest-parquet": Target(
        lambda: [seeds.parquet_manifest()], "manifest.parquet", read_manifest_file, is_text=False,
        prepare=_beside_manifest,
    ),
}  # fmt: skip
TARGETS = LOGS | FILES
