"""A candidate is kept as an object, whole or not at all."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from objstate.building import load_building
from objstate.errors import BuildingError, ObjstateError, ResultError, WorldError
from objstate.maintenance.adoption import adopt
from objstate.recording.candidates import Found, write_candidates
from objstate.world.store import DriveEntry, WorldStore, open_store

CORRIDOR = Path(__file__).parents[2] / "models/corridor/corridor.urdf"
BOX = Found(
    "unknown_1", 0.9, 7, 3.0, -0.5, 0.7, 0.6, 0.4, 100, 200, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
)


@pytest.fixture
def store(tmp_path: Path) -> WorldStore:
    shutil.copyfile(CORRIDOR, tmp_path / "old.urdf")
    (tmp_path / "old.building.yaml").write_text("building_error: {wall_std_m: 0.02}\n")
    (tmp_path / "result").mkdir()
    write_candidates(tmp_path / "result", [BOX])
    store = open_store(tmp_path / "world.db", load_building(tmp_path / "old.urdf"))
    store.add(DriveEntry("a drive", 0, 1000), [])
    return store


def arguments(folder: Path, **other: Any) -> dict[str, Any]:
    usual = {
        "building": folder / "old.urdf",
        "result": folder / "result",
        "candidate": "unknown_1",
        "name": "cabinet",
        "out": folder / "new.urdf",
    }
    return usual | other


def test_it_is_in_the_building_and_in_the_world(store: WorldStore, tmp_path: Path) -> None:
    grown = adopt(store, **arguments(tmp_path))
    assert "cabinet" in load_building(tmp_path / "new.urdf").objects
    again = open_store(tmp_path / "world.db", load_building(tmp_path / "new.urdf"))
    belief = again.load().at(200)["cabinet"]
    assert belief.mean == pytest.approx([3.0, -0.5, 0.7], abs=0.02)
    assert belief.presence == pytest.approx(0.9)
    assert belief.item.home == pytest.approx(grown["cabinet"].home)
    assert (tmp_path / "new.building.yaml").read_text() == (
        tmp_path / "old.building.yaml"
    ).read_text()
    with pytest.raises(WorldError, match="walls, objects or limits differ"):
        open_store(tmp_path / "world.db", load_building(tmp_path / "old.urdf"))


@pytest.mark.parametrize(
    ("other", "error", "message"),
    [
        ({"candidate": "unknown_9"}, ResultError, "it has unknown_1"),
        ({"name": "door_01"}, BuildingError, "another name"),
        ({"name": "a cabinet"}, BuildingError, "can't be an object's name"),
        ({"height": float("nan")}, BuildingError, "above 0 m"),
    ],
)
def test_what_is_refused_changes_nothing(
    store: WorldStore, tmp_path: Path, other: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        adopt(store, **arguments(tmp_path, **other))
    assert not (tmp_path / "new.urdf").exists()
    store.check(load_building(tmp_path / "old.urdf"))


def test_a_result_without_candidates_says_why(store: WorldStore, tmp_path: Path) -> None:
    write_candidates(tmp_path / "result", [])
    with pytest.raises(ResultError, match=r"it has none\."):
        adopt(store, **arguments(tmp_path))
    (tmp_path / "result" / "candidates.json").unlink()
    with pytest.raises(ResultError, match="it has none; estimate the log with --grid"):
        adopt(store, **arguments(tmp_path))


def test_a_building_elsewhere_is_refused(store: WorldStore, tmp_path: Path) -> None:
    with pytest.raises(BuildingError, match="has to lie in the folder"):
        adopt(store, **arguments(tmp_path, out=tmp_path / "result" / "new.urdf"))


def test_a_log_that_the_world_does_not_know_is_refused(store: WorldStore, tmp_path: Path) -> None:
    later = Found(**(vars(BOX) | {"last_ns": 5000}))
    write_candidates(tmp_path / "result", [later])
    with pytest.raises(WorldError, match="hasn't learnt from the log"):
        adopt(store, **arguments(tmp_path))
    assert not (tmp_path / "new.urdf").exists()
    assert not (tmp_path / "new.building.yaml").exists()
    store.check(load_building(tmp_path / "old.urdf"))


def test_the_same_name_twice_is_refused(store: WorldStore, tmp_path: Path) -> None:
    adopt(store, **arguments(tmp_path))
    with pytest.raises(ObjstateError):
        adopt(
            store,
            **arguments(tmp_path, building=tmp_path / "new.urdf", out=tmp_path / "third.urdf"),
        )
    assert not (tmp_path / "third.urdf").exists()
