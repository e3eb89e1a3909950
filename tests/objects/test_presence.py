"""Laws of presence: near one of what stands and is seen, near none of what is gone, kept where hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.config import BeamModelSettings, Dynamics, FurnitureSettings, Settings
from objstate.estimator.believed import Believed
from objstate.estimator.observation import observe
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ConditionalBelief, Descent, ObjectBelief
from objstate.objects.furniture import SampleFilter
from objstate.particles import Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.objects.views import evidence_by
from tests.rooms import block, building, enclosure, fan, observed, standing, table

ROBOT = np.array([-3.4, -1.5, 0.4])
ROBOTS = 40
RAYS = fan(181, np.pi)
TEMPERING = 0.2
DESK = standing(
    "desk",
    Mesh.joined([block(x, y, 0.06, 0.06) for x in (-0.72, 0.72) for y in (-0.32, 0.32)]),
)
PRIOR = FurnitureSettings().presence


def room(*unmodelled: Mesh) -> Building:
    return building(Mesh.joined([enclosure(8.0, 5.0), *unmodelled]), DESK)


def after_scans(
    reality: Building, state: FloatArray | None, count: int, seed: int
) -> list[ObjectBelief]:
    """The desk's beliefs, one a scan, of a robot that knows its pose to 1 cm and 0.7 degrees."""
    rng, model = np.random.default_rng(seed), Sensing(room(), BeamModel(BeamModelSettings()))
    believed, expected, beliefs = (
        Believed(room(), Settings(), seed, {}),
        ExpectedRanges(reality),
        [],
    )
    states = {} if state is None else {"desk": state}
    for k in range(count):
        view = model.view(observed(expected, states, ROBOT, RAYS, rng))
        about = rng.normal(0.0, [0.01, 0.01, np.radians(0.7)], (ROBOTS, 3))
        robot = PoseBelief(ROBOT + about, Weights.uniform(ROBOTS))
        seen = observe(believed, view, ["desk"], robot, k * 10**8, TEMPERING, 0.0)
        believed.collapse()
        believed.keep({name: each.belief for name, each in seen.beliefs.items()}.items())
        beliefs.append(believed.marginals["desk"])
    return beliefs


@pytest.mark.parametrize("seed", range(4))
def test_a_desk_on_thin_legs_that_is_seen_from_afar_is_there(seed: int) -> None:
    """Some robot samples see beams pass its legs; they count for little."""
    off = np.random.default_rng(seed).normal(0.0, [0.1, 0.1, 0.1])
    presence = [each.presence for each in after_scans(room(), off, 30, seed)]
    assert min(presence[10:]) > 0.98


@pytest.mark.parametrize("seed", range(2))
def test_a_desk_that_is_gone_is_not_there(seed: int) -> None:
    assert after_scans(building(enclosure(8.0, 5.0)), None, 30, seed)[-1].presence < 0.02


def test_a_desk_that_is_hidden_keeps_its_presence() -> None:
    screen = block(-2.8, -1.2, 0.1, 2.5, 0.4)
    presence = [each.presence for each in after_scans(room(screen), np.zeros(3), 30, 0)]
    assert np.abs(np.array(presence) - PRIOR).max() < 0.01


@pytest.mark.parametrize("seed", range(3))
def test_an_unmodelled_box_beside_a_desk_does_not_turn_it(seed: int) -> None:
    """A leg of the desk, were it turned by 48 degrees, would explain a part of the box."""
    box = block(-0.45, -0.75, 0.4, 0.4)
    beliefs = after_scans(room(box), np.zeros(3), 60, seed)
    turned = np.degrees([abs(each.mean[2]) for each in beliefs[20:]])
    assert turned.max() < 3.0


# --- Bayes' rule --------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_presence_follows_bayes_rule_over_the_robot_samples(seed: int) -> None:
    """p(there | o) = sum_l w_l p E_l / sum_l w_l (p E_l + 1 - p), E_l for being there against absence."""
    rng = np.random.default_rng(seed)
    told, weights = rng.normal(0.0, 4.0, 6), rng.dirichlet(np.ones(6))
    poses = np.column_stack([np.arange(6.0), np.zeros((6, 2))])

    def formula(states: FloatArray, robots: FloatArray) -> FloatArray:
        return np.tile(told[robots[:, 0].astype(int), None], (1, len(states)))

    filter_ = SampleFilter(table("table", 0.0, 0.0), FurnitureSettings())
    believed = ConditionalBelief.independent(filter_.prior(rng), 6)
    evidence = evidence_by(formula, poses, Weights.of(weights))
    update = filter_.update(believed, evidence, rng)
    assert update is not None
    likely = PRIOR * np.exp(told)
    exact = weights @ likely / (weights @ (likely + 1.0 - PRIOR))
    assert update.conditional.belief.presence == pytest.approx(exact, rel=1e-6)
    np.testing.assert_allclose(
        update.conditional.presence, likely / (likely + 1.0 - PRIOR), rtol=1e-6, atol=2e-6
    )
    np.testing.assert_allclose(update.log_evidence, np.log(likely + 1.0 - PRIOR), atol=1e-6)


def test_scouts_win_nothing_by_robot_samples_that_miss_the_object() -> None:
    """To half of the robot samples all states are unlikely, and scouts less so than others."""
    table_, rng = table("table", 0.0, 0.0), np.random.default_rng(0)
    still = FurnitureSettings(prior_std_m=0.01, prior_std_deg=1.0, nudge_m=0.3, nudge_deg=30.0,
                              dynamics=Dynamics(moves_per_hour=0.0))  # fmt: skip
    filter_ = SampleFilter(table_, still)
    poses, robots = np.array([[0.0, 0, 0], [1.0, 0, 0]]), Weights.uniform(2)

    def formula(states: FloatArray, seen_from: FloatArray) -> FloatArray:
        near = np.hypot(states[:, 0], states[:, 1]) < 0.1
        misses = seen_from[:, :1] > 0.5
        return np.where(near, np.where(misses, -20.0, 0.0), -3.0)

    believed = ConditionalBelief.independent(filter_.prior(rng), 2)
    for _ in range(5):
        update = filter_.update(believed, evidence_by(formula, poses, robots), rng)
        assert update is not None
        believed = ConditionalBelief.independent(update.conditional.belief, 2)
        values = believed.belief.weights.values
        assert values[-still.scouts :].sum() < 1e-3
    assert believed.belief.std[:2].max() < 0.02  # they lie 30 cm about it


def rows(presence: Sequence[float]) -> ConditionalBelief:
    """What robot samples believe of a table that each thinks there with another probability."""
    prior = SampleFilter(table("table", 0.0, 0.0), FurnitureSettings()).prior(
        np.random.default_rng(0)
    )
    alike = ConditionalBelief.independent(prior, len(presence))
    return replace(alike, presence=np.array(presence))


def test_presence_is_averaged_blended_and_handed_on_like_all_that_robot_samples_believe() -> None:
    weights, ancestors = np.array([0.5, 0.3, 0.2]), np.array([2, 0, 0])
    believed = rows([0.9, 0.5, 0.1])
    averaged = believed.averaged(believed.given, weights)
    assert averaged.belief.presence == pytest.approx(0.5 * 0.9 + 0.3 * 0.5 + 0.2 * 0.1)
    blended = averaged.handed_on(Descent(0.25))
    assert weights @ blended.presence == pytest.approx(averaged.belief.presence)
    np.testing.assert_allclose(blended.presence[0], 0.75 * 0.9 + 0.25 * averaged.belief.presence)
    np.testing.assert_array_equal(
        averaged.handed_on(Descent(0.0, ancestors)).presence, [0.1, 0.9, 0.9]
    )
