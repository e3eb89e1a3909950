"""Doors that hang elsewhere than the model says, in whole drives with known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.estimator.believed import Believed
from objstate.geometry import FloatArray, transform
from objstate.objects import ObjectBelief
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.estimator.drives import START, corridor, drive, truth
from tests.rooms import fan, scan_of

OFFSETS = {"a": (0.0, 0.2), "b": (0.12, 0.0), "c": (-0.1, 0.1), "d": (0.05, -0.2)}


def hung_aside(model: Building, name: str, offset: FloatArray) -> Building:
    item = model[name]
    return model.with_object(
        replace(item, origin=transform(np.eye(3), [*offset, 0.0]) @ item.origin)
    )


def real() -> Building:
    place = corridor()
    for name, offset in OFFSETS.items():
        place = hung_aside(place, name, np.array(offset))
    return place


def driven(place: Building, seed: int, settings: Settings | None = None) -> Estimator:
    estimator = Estimator(corridor(), settings, seed=seed, initial_pose=START)
    for record in drive(seed, seconds=11.0, place=place).records:
        estimator.feed(record)
    return estimator


def errors(estimator: Estimator) -> dict[str, float]:
    """deg"""
    return {
        name: float(np.degrees(abs(estimator.objects[name].mean[0] - state[0])))
        for name, state in truth().items()
    }


@pytest.mark.parametrize("seed", [1, 2])
def test_doors_that_hang_elsewhere_are_found_and_their_angles_are_right(seed: int) -> None:
    learnt = driven(real(), seed)
    rigid = driven(real(), seed, Settings.model_validate({"hinges": {"in_place": 1.0}}))
    assert rigid.hung_elsewhere == {}
    assert len(learnt.hung_elsewhere) >= 2
    for name in learnt.hung_elsewhere:
        assert errors(learnt)[name] < 3.0
    assert sum(errors(learnt).values()) < sum(errors(rigid).values()) / 2.0


@pytest.mark.parametrize("seed", [1, 2])
def test_intervals_hold_the_truth_whether_a_hinge_was_found_or_not(seed: int) -> None:
    objects = driven(real(), seed).objects
    inside = [
        bool(objects[name].interval(0.98)[0] <= state <= objects[name].interval(0.98)[1])
        for name, state in truth().items()
    ]
    assert sum(inside) >= len(inside) - 1


@pytest.mark.parametrize("seed", [1, 2])
def test_where_the_model_is_exact_all_doors_stay_in_place(seed: int) -> None:
    exact = driven(corridor(), seed)
    assert exact.hung_elsewhere == {}
    assert max(errors(exact).values()) < 3.0


def test_the_same_records_find_the_same_hinges() -> None:
    first, second = (driven(real(), 3).hung_elsewhere for _ in range(2))
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_a_view_of_a_rehung_door_is_that_of_a_building_where_it_hangs_there() -> None:
    place, rays = corridor(), fan(181)
    aside = hung_aside(place, "b", np.array([0.1, -0.2]))
    poses, states = np.array([START, [4.0, 0.0, -1.2]]), np.array([[0.0], [0.7]])
    model = BeamModel(Settings().beam_model)
    scan = scan_of(np.full(len(rays), 2.0), rays)
    moved = Sensing(place, model).with_object(aside["b"]).view(scan)
    anew = Sensing(aside, model).view(scan)
    for name in place.objects:
        assert np.array_equal(moved.object(name, states, poses), anew.object(name, states, poses))
    assert np.array_equal(moved.walls(poses), anew.walls(poses))
    exact = ExpectedRanges(place).with_object(aside["b"])
    assert np.array_equal(
        exact.object("b", states, poses, rays),
        ExpectedRanges(aside).object("b", states, poses, rays),
    )


def test_what_was_learnt_of_a_hinge_by_a_lost_robot_is_taken_back() -> None:
    place = corridor()
    believed = Believed(place, Settings(), 0, {})
    aside = hung_aside(place, "a", np.array([0.2, 0.0]))["a"]
    rehung: ObjectBelief = replace(believed.marginals["a"], item=aside)
    believed.hang(rehung)
    assert believed.marginals["a"].item is aside
    believed.go_back()
    assert believed.marginals["a"].item is place["a"]
