"""Maps that logs hold."""

from pathlib import Path

import numpy as np
import pytest

from objstate.building import building_from_map, load_building
from objstate.conversion import recorded_map
from objstate.errors import BuildingError, LogError

NOTHING = np.full((3, 3), -1, dtype=np.int8)
FULL = np.full((3, 3), 100, dtype=np.int8)


def room(size: int = 40) -> np.ndarray:
    """Percent of a square room, unknown outside of its walls."""
    percent = np.full((size, size), -1, dtype=np.int8)
    percent[5:35, 5:35] = 100
    percent[7:33, 7:33] = 0
    return percent


@pytest.mark.parametrize("write", ["mcap", "bag1", "bag2"])
def test_the_last_map_of_a_log_becomes_a_building(drive, tmp_path: Path, write: str) -> None:
    drive.grid(0.0, NOTHING).scan(0.5).odometry(0.5).grid(1.0, room(), origin=(1.0, -2.0, 0.0))
    drive.grid(2.0, FULL, topic="/costmap")
    plan = recorded_map(getattr(drive, write)(tmp_path / "drive.log"))
    assert np.count_nonzero(plan.occupied) == 30**2 - 26**2
    walls = load_building(building_from_map(plan, None, tmp_path / "out")).walls.vertices
    low, high = walls[:, :2].min(axis=0), walls[:, :2].max(axis=0)
    np.testing.assert_allclose(low, [1.275, -1.725], atol=0.03)
    np.testing.assert_allclose(high, [2.725, -0.275], atol=0.03)


def test_a_log_without_a_map_and_one_with_several_say_what_to_do(new_drive, tmp_path: Path) -> None:
    bare = new_drive().scan(0.0).odometry(0.0).mcap(tmp_path / "bare.mcap")
    with pytest.raises(LogError, match=r"without a map .*map_saver"):
        recorded_map(bare)
    several = new_drive().grid(0.0, room(), topic="/a").grid(0.0, room(), topic="/b")
    log = several.mcap(tmp_path / "several.mcap")
    with pytest.raises(LogError, match=r"several maps, /a, /b; choose one with --topic"):
        recorded_map(log)
    assert recorded_map(log, "/b").occupied.any()
    with pytest.raises(LogError, match="no map on '/c'; it has /a, /b"):
        recorded_map(log, "/c")


def test_a_map_without_walls_is_refused(drive, tmp_path: Path) -> None:
    log = drive.grid(0.0, np.zeros((3, 3), dtype=np.int8))
    with pytest.raises(BuildingError, match="no occupied cell"):
        recorded_map(log.mcap(tmp_path / "free.mcap"))
