"""The scenes are those that the paper describes, and the tables count what they say."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.experiments.schulz2001 import EXPERIMENTS, desks, doors, movable
from objstate.experiments.trial import Final
from objstate.geometry import FloatArray
from objstate.simulation.drive import Simulation
from objstate.simulation.scene import PlanarState
from tests.experiments.conftest import placed, run_of

ROOT = Path(__file__).parents[2]
SCENES = ROOT / "objstate" / "experiments" / "schulz2001"


@pytest.mark.parametrize("name", ["department", "passage", "offices"])
def test_buildings_are_what_their_script_writes(name: str, tmp_path: Path) -> None:
    runpy.run_path(str(ROOT / "models" / "make.py"))[name]().write(tmp_path / "made.urdf")
    assert (tmp_path / "made.urdf").read_bytes() == (SCENES / f"{name}.urdf").read_bytes()


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_seed_is_one_drive_and_another_seed_another(name: str) -> None:
    trial = EXPERIMENTS[name].trial
    assert trial(3) == trial(3)
    assert list(truth_of(trial(3).scene)) != list(truth_of(trial(4).scene))


def truth_of(scene):
    return Simulation(scene, load_building(scene.building)).truth()


def test_doors_open_by_90_degrees_and_are_passed_at_70_cm_a_second() -> None:
    trial = doors.trial(1)
    building = load_building(trial.scene.building)
    assert {round(np.degrees(door.upper)) for door in building.objects.values()} == {90}
    speeds = np.diff(Simulation(trial.scene, building).motion.at(np.arange(5.0, 30.0))[:, 0])
    np.testing.assert_allclose(speeds, 0.7, atol=1e-6)
    paper, *others = trial.settings.values()
    assert paper.object_updates.inference == "marginal"
    assert {each.object_updates.inference for each in others} == {"joint"}
    steps = [s.for_object("door_01", "door").resolution_deg for s in (paper, *others)]
    assert steps[:2] == [10.0, 10.0]
    assert steps == sorted(steps, reverse=True)
    assert {each.object_updates.max_distance for each in trial.settings.values()} == {3.5}


@pytest.mark.parametrize("seed", range(5))
def test_the_object_is_turned_twice_while_the_robot_pauses(seed: int) -> None:
    scene = movable.trial(seed).scene
    building = load_building(scene.building)
    simulation = Simulation(scene, building)
    history = simulation.history["u_shape"]
    first, second, third = (history.at(time) for time in (0.0, 60.0, 120.0))
    off = first - building["u_shape"].home
    assert np.hypot(*off[:2]) == pytest.approx(0.10)
    assert abs(np.degrees(off[2])) == pytest.approx(12.0)
    for before, after in ((first, second), (second, third)):
        assert np.degrees(after - before)[2] == pytest.approx(30.0, abs=12.0)
        assert np.hypot(*(after - before)[:2]) < 0.05
    for swing in history.swings:
        moments = np.array([swing.start, swing.start + swing.duration])
        at_rest = simulation.motion.at(moments)
        np.testing.assert_allclose(at_rest[0], at_rest[1], atol=1e-6)


def test_samples_are_as_many_as_the_table_says() -> None:
    for count, settings in zip(movable.STATES, movable.trial(0).settings.values(), strict=False):
        own = settings.for_object("u_shape", "furniture")
        assert own.samples == count
        assert settings.object_updates.inference == "marginal"
    assert movable.STATES[0] == 40


@pytest.mark.parametrize("seed", range(3))
def test_the_model_has_the_desks_20_cm_too_near_to_the_middle(seed: int) -> None:
    scene = desks.trial(seed).scene
    homes = load_building(scene.building)
    for rule in scene.objects:
        if rule.name in desks.DESKS:
            off = homes[rule.name].home - pose(rule.initial)
            middle = np.array([2.5 if pose(rule.initial)[0] < 5 else 7.5, 3.3])
            inwards = middle - pose(rule.initial)[:2]
            assert np.hypot(*off[:2]) == pytest.approx(0.20, abs=0.1)
            assert off[:2] @ inwards / np.hypot(*inwards) > 0.1


def pose(state: object) -> FloatArray:
    assert isinstance(state, PlanarState)
    return np.array([state.x, state.y, state.yaw])


def test_the_table_of_doors_counts_in_steps() -> None:
    off = np.radians([2.0, -4.0])
    finals = [Final("door_01", "angle", 1, 0.5, float(e), True, np.radians(0.5)) for e in off]
    runs = [run_of(name, 1, finals) for name in doors.trial(1).settings]
    by_step, by_door = doors.tables(runs)
    row = by_step.rows[2]
    cells = dict(zip(by_step.columns, row, strict=True))
    assert (row[0], cells["doors"], cells["within 5 deg"]) == ("10 deg", "2", "100 %")
    assert cells["final: mean error (deg)"] == "3.00"
    assert row[5] == "0.30"
    assert cells["error / bound"] == "6.3"
    assert by_door.title.endswith("with seed 1, states every 10 deg, marginal")


def test_the_table_of_the_object_tells_its_states_apart() -> None:
    finals = [each for i in range(3) for each in placed("u_shape", i, errors=(0.01 * i, 0, 0))]
    (table,) = movable.tables([run_of("40 samples", 1, finals), run_of("200 samples", 1, [])])
    assert [row[1:4] for row in table.rows[:3]] == [
        ("first", "1", "0.00"), ("second", "1", "1.00"), ("third", "1", "2.00"),
    ]  # fmt: skip
    assert {row[2] for row in table.rows[3:]} == {"0"}


def test_the_table_of_desks_counts_those_that_are_right() -> None:
    wrong = {"desk_3": (0.2, 0.0, 0.0), "table": (0.0, 0.0, 0.5)}
    first = [
        f for name in desks.FURNITURE for f in placed(name, 1, errors=wrong.get(name, (0, 0, 0)))
    ]
    second = [f for name in desks.FURNITURE[1:3] for f in placed(name, 1)]
    (table,) = desks.tables([run_of("defaults", 1, first), run_of("defaults", 2, second)])
    right = {row[0]: row[2:6:3] for row in table.rows}
    assert right == {
        "desk_1": ("1", "100 %"), "desk_2": ("2", "100 %"), "desk_3": ("2", "50 %"),
        "desk_4": ("1", "100 %"), "table": ("1", "0 %"),
    }  # fmt: skip
    assert "2.5 of 4 on average, at least 3 in 50 % of 2 drives" in table.note
