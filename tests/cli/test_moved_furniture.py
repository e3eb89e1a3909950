"""Drives past furniture that changes places, from the logs to what the world expects."""

import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

from objstate.cli import main
from objstate.world.store import open_store

WALLS = [(3, -2.5, 8, 0.1), (3, 2.5, 8, 0.1), (-1, 0, 0.1, 5), (7, 0, 0.1, 5), (2, 2.3, 0.3, 0.4)]
PIECES = {"trolley": (0.5, 0.4, 3.0, 1.2), "cabinet": (0.9, 0.6, 4.0, -1.2)}
ONE, OTHER, THIRD = (3.0, 1.2), (4.0, -1.2), (5.5, 1.5)
# They change places by way of a third one.
STOOD = {
    "trolley": (ONE, THIRD, THIRD, OTHER, THIRD, ONE),
    "cabinet": (OTHER, OTHER, ONE, ONE, OTHER, OTHER),
}
BEGIN = int(datetime(2026, 1, 5, 10, tzinfo=UTC).timestamp())
Stood = Mapping[str, Sequence[tuple[float, float]]]  # by day
SETTINGS = {"objects": [{"match": "*", "prior": "uniform", "prior_std_m": 3.0}]}


def box(x: float, y: float, width: float, depth: float, height: float) -> str:
    return (
        f'<collision><origin xyz="{x} {y} {height / 2}"/>'
        f'<geometry><box size="{width} {depth} {height}"/></geometry></collision>'
    )


def room() -> str:
    links = f'<link name="map">{"".join(box(*wall, 2.0) for wall in WALLS)}</link>'
    for name, (width, depth, x, y) in PIECES.items():
        links += f'<link name="{name}_link">{box(0, 0, width, depth, 0.8)}</link>'
        links += (
            f'<joint name="{name}" type="planar"><parent link="map"/><child link="{name}_link"/>'
        )
        links += f'<origin xyz="{x} {y} 0"/><axis xyz="0 0 1"/></joint>'
    return f'<robot name="room">{links}</robot>'


def scene(stood: Stood, day: int) -> str:
    objects = [
        {"name": name, "initial": {"x": places[day][0], "y": places[day][1], "yaw": 0.0}}
        for name, places in stood.items()
    ]
    return yaml.safe_dump(
        {
            "building": "room.urdf",
            "start_time": BEGIN + 86400 * day,
            "seed": day,
            "route": {"waypoints": [{"x": 0.0, "y": 0.0}, {"x": 1.5, "y": 0.0}]},
            "lasers": [{"frame": "laser", "rate": 5.0, "range_max": 10.0, "beams": 181}],
            "objects": objects,
        }
    )


def driven(home: Path, stood: Stood) -> Path:
    """A world of a drive a day."""
    (home / "room.urdf").write_text(room())
    (home / "settings.yaml").write_text(yaml.safe_dump(SETTINGS))
    for day in range(len(stood["trolley"])):
        (home / f"{day}.yaml").write_text(scene(stood, day))
        drive, result = home / f"drive{day}", home / f"result{day}"
        assert main(["simulate", str(home / f"{day}.yaml"), "--out", str(drive), "-q"]) == 0
        given = [
            "--building",
            home / "room.urdf",
            "--out",
            result,
            "--config",
            home / "settings.yaml",
        ]
        words = ["estimate", drive / "log.mcap", *given, "--world", home / "world.db", "-q"]
        assert main([str(word) for word in words]) == 0
    return home / "world.db"


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What six drives on six days made known."""
    return driven(tmp_path_factory.mktemp("moved"), STOOD)


def test_pieces_that_change_places_directly_are_found(tmp_path: Path) -> None:
    stood = {"trolley": (ONE, ONE, OTHER), "cabinet": (OTHER, OTHER, ONE)}
    known = open_store(driven(tmp_path, stood)).load()
    for name, places in stood.items():
        last = known.history(name)[-1]
        assert last.presence > 0.99
        assert last.mean[:2] == pytest.approx(places[-1], abs=0.03)


def test_habits_name_the_places_where_furniture_stood(run, world: Path) -> None:
    found = json.loads(run("world", "habits", world, "--json").out)["furniture"]
    for name, places in STOOD.items():
        told = np.array([(p["state"]["x"], p["state"]["y"]) for p in found[name]["places"]])
        for true in set(places):
            assert np.hypot(*(told - true).T).min() < 0.1
        assert len(told) == len(set(places))


def test_the_world_expects_them_at_their_places_again(world: Path) -> None:
    known = open_store(world).load()
    assert known.latest_ns is not None
    later = known.at(known.latest_ns + 26 * 3600 * 10**9)
    for name, places in STOOD.items():
        states = later[name].states[:, :2]
        shares = [
            float((np.hypot(*(states - place).T) < 0.4).mean()) for place in sorted(set(places))
        ]
        assert min(shares) > 0.02
        assert sum(shares) > 0.6  # of n arrivals, one in n + 1 is somewhere new
