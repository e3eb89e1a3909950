"""Laws of presence: near one of what stands and is seen, near none of what is gone, kept where hidden."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.config import BeamModelSettings, FurnitureSettings, Settings
from objstate.estimator.believed import Believed
from objstate.estimator.observation import observe
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
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
        believed.keep(seen.beliefs.items())
        beliefs.append(believed.marginals["desk"])
    return beliefs


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
    evidence = evidence_by(formula, poses, Weights.of(weights))
    update = filter_.update(filter_.prior(rng), evidence, rng)
    assert update is not None
    likely = PRIOR * np.exp(told)
    exact = weights @ likely / (weights @ (likely + 1.0 - PRIOR))
    assert update.belief.presence == pytest.approx(exact, rel=1e-6)
