"""What drives tell a world of walls and lasers, from which later ones start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from objstate.building import load_building
from objstate.building.model import Building
from objstate.building.shapes import Box
from objstate.config import Settings
from objstate.run import RunResult, estimate_log
from objstate.run.memory import Memory, Statics
from objstate.simulation import simulate
from objstate.world.store import DriveEntry, open_store
from objstate.world.surveys import MOST, KeptSurvey
from tests.calibration.test_surveys import COUNT, survey
from tests.discovery.test_refining import ROUTE, TRUTH, stands_in, urdf
from tests.rooms import placed

NORTH = '<collision><origin xyz="3 2 1"/><geometry><box size="12 0.1 2"/></geometry></collision>'
YAW = (0.0, 0.0, 0.02)  # rad
MOUNTS = {"laser": np.asarray(placed(0.1, 0.0, 0.3))}


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with logs of two days, and a model in which a piece of wall stands in by 2 cm."""
    folder = tmp_path_factory.mktemp("hall")
    (folder / "true.urdf").write_text(urdf())
    pieces = "".join(
        f'<collision><origin xyz="{x} {y} 1"/><geometry><box size="4 0.1 2"/></geometry></collision>'
        for x, y in ((-1.0, 2.0), (3.0, 1.98), (7.0, 2.0))
    )
    assert NORTH in urdf()
    (folder / "hall.urdf").write_text(urdf().replace(NORTH, pieces))
    for day in range(2):
        objects = [{"name": name, "initial": 0.3 * day} for name in TRUTH]
        laser = {"frame": "laser", "rate": 5.0, "range_max": 12.0, "sigma": 0.01}
        scene = {"building": "true.urdf", "seed": day, "route": ROUTE, "objects": objects}
        scene |= {"lasers": [laser]}
        (folder / f"day{day}.yaml").write_text(yaml.safe_dump(scene))
        simulate(folder / f"day{day}.yaml", folder / f"day{day}")
    return folder


def drive(hall: Path, day: int, out: Path) -> RunResult:
    log = hall / f"day{day}" / "log.mcap"
    return estimate_log([log], hall / "hall.urdf", out, world=out.parent / "world.db")


def test_later_drives_start_where_earlier_ones_found_walls(hall: Path, tmp_path: Path) -> None:
    model, place = load_building(hall / "hall.urdf"), tmp_path / "world.db"
    stds = [0.02]
    for day in range(2):
        result = drive(hall, day, tmp_path / f"out{day}")
        assert result.world is not None
        assert result.world.surveyed == day
        memory = Memory.opened(place, model, Settings(), "another", 10**18, MOUNTS)
        assert stands_in(memory.building) == pytest.approx(0.0, abs=0.004)
        assert memory.building.error is not None
        stds.append(memory.building.error.wall_std_m)
    assert stands_in(model) == pytest.approx(0.02)
    assert stds == sorted(stds, reverse=True)  # the second drive told something of its own
    again = drive(hall, 1, tmp_path / "again")
    assert again.world is not None
    assert (again.world.had_the_log, again.world.surveyed) == (True, 1)  # not by itself


def test_lasers_are_those_of_the_same_name_and_mounting() -> None:
    building = Building("hall", Box((9.0, 5.0, 2.0)).mesh(), {})
    drives = [KeptSurvey(survey(day, np.zeros((COUNT, 2))), MOUNTS) for day in range(3)]
    (laser,) = Statics.of(building, {}, drives, MOUNTS).lasers
    assert laser.correction[2] == pytest.approx(0.01, abs=0.003)
    turned = Statics.of(building, {}, drives, {"laser": np.asarray(placed(0.1, 0.0, 0.3, YAW))})
    assert turned.lasers == ()
    assert Statics.of(building, {}, drives, {"other": MOUNTS["laser"]}).lasers == ()


def test_a_survey_in_an_adjusted_building_is_kept_beside_the_model() -> None:
    walls, turned = np.full((COUNT, 2), 0.01), np.array([0.0, 0.0, 0.02, 0.0])
    there = survey(0, np.zeros((COUNT, 2)))
    here = there.beside({"laser": turned}, walls)
    found, beside = (np.linalg.solve(each.information, each.pull) for each in (there, here))
    np.testing.assert_allclose(beside, found + np.append(turned, walls), atol=1e-6)
    packed = KeptSurvey.unpacked(KeptSurvey(here, MOUNTS).packed())
    np.testing.assert_allclose(packed.survey.pull, here.pull, rtol=1e-6)
    np.testing.assert_allclose(packed.mounts["laser"], MOUNTS["laser"])


def test_a_world_keeps_surveys_of_its_latest_drives_once(tmp_path: Path) -> None:
    building = Building("hall", Box((9.0, 5.0, 2.0)).mesh(), {})
    store = open_store(tmp_path / "world.db", building)
    kept = [KeptSurvey(survey(day, np.zeros((COUNT, 2))), MOUNTS) for day in range(MOST + 2)]
    for day in (MOST + 1, *range(MOST + 1)):  # the last one first
        assert store.add(DriveEntry(str(day), day, day + 1), [], survey=kept[day])
    assert not store.add(DriveEntry("5", 5, 6), [], survey=kept[5])
    pulls = [each.survey.pull[0] for each in store.surveys()]
    expected = [np.float32(each.survey.pull[0]) for each in kept[2:]]
    assert pulls == pytest.approx(expected)
    assert len(store.surveys(without="7")) == MOST - 1
