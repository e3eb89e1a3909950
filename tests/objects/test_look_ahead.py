"""A scan that narrows a belief much: a look ahead chooses samples, and doesn't change what is believed."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import BeamModelSettings, Dynamics, FurnitureSettings
from objstate.geometry import BoolArray, FloatArray
from objstate.objects import ConditionalBelief, ScanEvidence
from objstate.objects.furniture import SampleFilter
from objstate.particles import Weights
from objstate.sensing import BeamModel, Comparison, ExpectedRanges, Sensing
from tests.rooms import building, enclosure, fan, observed, table

TEMPERING = 0.2
ITEM = table("table", 1.2, 0.3, size=(1.2, 0.6))
ROOM: Building = building(enclosure(6.0, 6.0), ITEM)
SPREAD = np.array([0.045, 0.045, np.radians(3.0)])
SAMPLES = 240
KNOWN = FurnitureSettings(
    prior_std_m=float(SPREAD[0]), prior_std_deg=3.0, samples=SAMPLES, least_samples=SAMPLES,
    first_samples=SAMPLES, scouts=40, dynamics=Dynamics(moves_per_hour=0.0)
)  # fmt: skip
FILTER = SampleFilter(ITEM, KNOWN)


def evidence(seed: int, robot_yaw_deg: float = 1.0) -> ScanEvidence:
    """A scan of the table somewhere about its place, from samples of a robot belief."""
    rng = np.random.default_rng(seed)
    pose = np.array([-1.5, -0.4, 0.2])
    state = ITEM.home + SPREAD * rng.standard_normal(3)
    scan = observed(ExpectedRanges(ROOM), {ITEM.name: state}, pose, fan(181, np.pi), rng)
    view = Sensing(ROOM, BeamModel(BeamModelSettings())).view(scan)
    poses = pose + rng.standard_normal((40, 3)) * [0.02, 0.02, np.radians(robot_yaw_deg)]
    walls = view.walls(poses)
    absent = view.log_likelihood(walls)
    return ScanEvidence(ITEM.name, view, poses, Weights.uniform(40), walls, absent, TEMPERING)


def exact(told: ScanEvidence, count: int = 4000) -> tuple[FloatArray, FloatArray]:
    """Mean (3,) and deviations (3,) of the posterior, by so many samples cast from all robot samples."""
    states = ITEM.home + SPREAD * np.random.default_rng(99).standard_normal((count, 3))
    comparison = Comparison(told.background, TEMPERING)
    log, _ = told.view.object_log_likelihood(ITEM.name, states, told.poses, comparison)
    rows = np.exp(log - log.max()) * np.exp(TEMPERING * told.log_absent)[:, None]
    weights = rows.sum(axis=0) / rows.sum()
    mean = weights @ states
    return mean, np.sqrt(weights @ (states - mean) ** 2)


def estimated(told: ScanEvidence, seed: int) -> tuple[FloatArray, FloatArray]:
    """The same by the filter."""
    rng = np.random.default_rng(seed)
    believed = ConditionalBelief.independent(FILTER.prior(rng), len(told.poses))
    update = FILTER.update(believed, told, rng)
    assert update is not None
    seen = told.robot_weights_after(update.log_evidence).values
    after = update.conditional.averaged(update.conditional.given, seen).belief
    return after.mean, after.std


def test_the_posterior_is_that_of_all_samples_cast_from_all_robot_samples() -> None:
    off, wider = [], []
    for scan in range(4):
        told = evidence(scan)
        mean, std = exact(told)
        assert (std[:2] < 0.8 * SPREAD[:2]).any()  # the scan tells something
        for seed in range(10):
            found, width = estimated(told, seed)
            off.append((found - mean) / std)
            wider.append(np.log(width / std))
    assert np.sqrt(np.mean(np.square(off), axis=0)).max() < 0.3
    assert np.abs(np.mean(off, axis=0)).max() < 0.12
    assert np.abs(np.mean(wider, axis=0)).max() < 0.25


def test_what_all_robot_samples_see_is_cast_once(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[bool] = []
    cast = ScanEvidence.cast

    def counted(
        told: ScanEvidence, states: FloatArray, whole: BoolArray
    ) -> tuple[FloatArray, BoolArray]:
        looks.append(bool(whole.any()))
        return cast(told, states, whole)

    monkeypatch.setattr(ScanEvidence, "cast", counted)
    estimated(evidence(0), 0)
    assert looks == [False, True]


def test_once_a_place_is_known_each_robot_sample_has_it_where_it_sees_it() -> None:
    open_place = FurnitureSettings(prior_std_m=0.08, prior_std_deg=4.0)
    filter_, slopes = SampleFilter(ITEM, open_place), []
    for seed in range(4):
        told, rng = evidence(seed, 0.1), np.random.default_rng(seed)
        believed = ConditionalBelief.independent(filter_.prior(rng), len(told.poses))
        assert not believed.belief.settled
        update = filter_.update(believed, told, rng)
        assert update is not None
        after = update.conditional
        assert after.belief.settled
        seen = after.given[:, : -after.belief.scouts] @ after.belief.standing.states[:, 0]
        slopes.append(np.polyfit(told.poses[:, 0], seen, 1)[0])
    assert 0.65 < min(slopes) <= max(slopes) < 1.2
