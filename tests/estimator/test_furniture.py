"""A piece of furniture's posterior as a Gaussian mixture: laws, and pieces that are found by noisy ranges."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Building, Mesh, MovableObject
from objstate.config import Dynamics, FurnitureSettings, ObjectRule, Settings
from objstate.estimator.exposure import Exposure, Exposures, Others
from objstate.estimator.furniture import Furniture
from objstate.estimator.sight import Sight
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import FloatArray, wrap
from objstate.lazy import altered
from objstate.localization import Carried, PoseBelief, RangeNoise, Vantage, WallErrors
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.furniture_mixture import (
    ORDER,
    PROPOSED_STD,
    FurnitureMixture,
    Piece,
)
from objstate.particles import Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import block, building, enclosure, fan, observed, standing, table

SQUARE = table("table", 0.0, 0.0, size=(0.8, 0.8))
STILL = Dynamics(moves_per_hour=0.0, drift_deg=0.0, drift_m=0.0)
LOOKS = ((-2.3, -2.3, 0.7), (-2.0, 0.0, 0.0), (0.0, -2.3, 1.5))
SIGMA = 0.03
KNOWN = np.diag([0.005, 0.005, np.radians(0.2)]) ** 2  # covariance of the robot's pose
CARRIED = Carried(0.5 * np.eye(3), 0.75 * KNOWN)


def legs(width: float, depth: float) -> MovableObject:
    """A table of which a laser sees four legs."""
    mesh = Mesh.joined([block(i * width / 2, j * depth / 2, 0.06, 0.06)
                        for i in (-1, 1) for j in (-1, 1)])  # fmt: skip
    return standing("table", mesh)


def rule(prior_std_m: float, prior: str = "gaussian", **also: object) -> Settings:
    deg = 180.0 if prior == "uniform" else 15.0
    told = {"match": "*", "prior": prior, "prior_std_m": prior_std_m, "prior_std_deg": deg}
    return Settings(objects=(ObjectRule.model_validate(told | also),))


class Blurred:
    """The exposures of a scan, before a background that is known to a centimetre."""

    def __init__(self, exposures: Exposures) -> None:
        self.exposures = exposures

    def of(self, name: str, unless: Collection[str] = ()) -> Exposure:
        exposure = self.exposures.of(name, unless)
        return replace(exposure, blur=np.full(len(exposure.scan), 0.01**2))


class Watch:
    """Looks at a piece of furniture in a room of 6 by 6 m, and what is believed of it."""

    def __init__(self, item: MovableObject, chosen: Settings, seed: int) -> None:
        self.item, self.place = item, building(enclosure(6.0, 6.0), item)
        self.rng, self.settings = np.random.default_rng(seed), chosen
        self.surroundings = Surroundings(self.place)
        self.sensing = Sensing(self.place, BeamModel(chosen.beam_model))
        self.furniture = Furniture(self.place, chosen, self.sensing)
        self.belief = filter_for(item, chosen).prior(self.rng)
        self.seconds = 0.0

    def look(
        self, state: FloatArray | None, poses: Sequence[Sequence[float]], reality: Building | None
    ) -> ObjectBelief:
        """What is believed after a scan from each pose; no state: the object isn't there."""
        expected = ExpectedRanges(reality or self.place)
        states = {} if state is None else {self.item.name: state}
        for pose in map(np.array, poses):
            self.seconds += 0.1
            scan = observed(expected, states, pose, fan(361, 2 * np.pi), self.rng)
            scan = altered(scan, stamp_ns=round(1e9 * self.seconds))
            about = np.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)]) @ np.sqrt(KNOWN)
            robot = PoseBelief(pose + about, Weights.uniform(6))
            vantage = Vantage.of(robot, scan, RangeNoise(SIGMA**2, 0.0, 0.0))
            sight = Sight.of(scan, PoseBelief(pose[None], Weights.uniform(1)), self.sensing,
                             self.surroundings)  # fmt: skip
            surfaces = self.sensing.surfaces(sight.height)
            others = Others((), self.sensing.scenery((), sight.height), np.empty((0, len(scan))))
            walls = WallErrors.unknown(len(surfaces.pieces), 0.0)
            exposures = Exposures(sight, vantage, surfaces, {}, others, walls, lambda *_: CARRIED)
            name = self.item.name
            believed = SimpleNamespace(marginals={name: self.belief}, rngs={name: self.rng})
            seen = self.furniture.observe([name], believed, Blurred(exposures))
            self.belief = seen[name].belief
        return self.belief


def looked(
    item: MovableObject, state: FloatArray | None, chosen: Settings, seed: int, times: int = 4
) -> ObjectBelief:
    reality = building(enclosure(6.0, 6.0)) if state is None else None
    watch = Watch(item, chosen, seed)
    return watch.look(state, np.array(LOOKS).repeat(times, axis=0), reality)


def piece(**chosen: object) -> Piece:
    return Piece(table("table", 0.4, -0.2), FurnitureSettings.model_validate(chosen))


def moments(mixture: FurnitureMixture) -> tuple[FloatArray, FloatArray]:
    """Mean (3,) and covariance (3, 3) of x, y, yaw of what is there, of what looks alike near one yaw."""
    item = mixture.piece.item
    weights = mixture.weights[1:] / mixture.weights[1:].sum()
    places = item.symmetry.nearest(mixture.places[1:], float(item.home[2]))
    mean = weights @ places
    off = places - mean
    within = mixture.covariances[1:][:, ORDER][:, :, ORDER]
    return mean, np.einsum("c,cij->ij", weights, within + off[:, :, None] * off[:, None])


# --- laws ---------------------------------------------------------------------------


@pytest.mark.parametrize(("prior", "ratio"), [("gaussian", 1.0), ("uniform", 1.0 / np.sqrt(3.0))])
def test_cells_have_the_priors_mean_and_deviations(prior: str, ratio: float) -> None:
    mixture = FurnitureMixture.unknown(piece(prior=prior, prior_std_m=0.3, prior_std_deg=10.0))
    mean, covariance = moments(mixture)
    np.testing.assert_allclose(mean, mixture.piece.item.home, atol=1e-9)
    expected = ratio * np.array([0.3, 0.3, np.radians(10.0)])
    np.testing.assert_allclose(covariance, np.diag(expected**2), atol=1e-9)
    assert mixture.weights.sum() == pytest.approx(1.0)
    assert mixture.presence == pytest.approx(FurnitureSettings().presence)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 20.0), st.floats(0.0, 1.0), st.floats(0.0, 60.0))
def test_as_time_goes_by_weights_sum_to_one_and_presence_returns_to_the_priors(
    hours: float, presence: float, moves: float
) -> None:
    mixture = FurnitureMixture.unknown(piece(dynamics={"moves_per_hour": moves}))
    weights = mixture.weights.copy()
    weights[0], weights[1:] = 1.0 - presence, presence / (len(weights) - 1)
    known = FurnitureMixture(
        mixture.piece, weights, mixture.places, mixture.robots, mixture.covariances, mixture.motions
    )
    later = known.later(3600.0 * hours, 0.5 * np.eye(3), 0.75 * KNOWN, KNOWN)
    assert later.weights.sum() == pytest.approx(1.0)
    stays = np.exp(-moves * hours)
    expected = stays * presence + (1.0 - stays) * FurnitureSettings().presence
    assert later.presence == pytest.approx(expected, abs=1e-9)
    assert (np.linalg.eigvalsh(later.covariances[1:]) > -1e-12).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 16))
def test_however_often_a_place_is_proposed_it_weighs_what_the_mixture_has_there(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    mixture = FurnitureMixture.unknown(piece(prior_std_m=0.5, prior_std_deg=40.0))
    place = mixture.piece.item.home + rng.standard_normal((1, 3)) * [0.3, 0.3, 0.4]
    after = mixture.proposing(np.repeat(place, count, axis=0), KNOWN)
    added = after.weights[len(mixture.weights) :]
    peak = 1.0 / (np.sqrt(2.0 * np.pi) ** 3 * PROPOSED_STD.prod())
    assert len(added) == count
    assert added.sum() * peak == pytest.approx(float(mixture.density(place)[0]))


def test_what_is_published_has_the_mixtures_moments() -> None:
    item = SQUARE
    belief = looked(item, np.array([0.1, -0.1, 0.1]), rule(0.2), 0)
    mixture = belief.joint
    assert isinstance(mixture, FurnitureMixture)
    mean, covariance = moments(mixture)
    np.testing.assert_allclose(belief.mean, mean, atol=1e-4)
    variances = np.diag(covariance) + mixture.about.static
    np.testing.assert_allclose(belief.std, np.sqrt(variances), rtol=0.05)
    assert belief.weights.values.sum() == pytest.approx(1.0)
    assert belief.presence == mixture.presence


def test_a_belief_of_samples_is_taken_up_with_its_moments() -> None:
    rng = np.random.default_rng(0)
    states = np.array([0.4, -0.2, 0.3]) + rng.standard_normal((400, 3)) * [0.1, 0.05, 0.2]
    item = piece().item
    belief = ObjectBelief(item, states, Weights.uniform(400), np.zeros(3), presence=0.7)
    mean, covariance = moments(FurnitureMixture.of(piece(), belief))
    np.testing.assert_allclose(mean, belief.mean, atol=0.03)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), belief.std, rtol=0.2)
    assert FurnitureMixture.of(piece(), belief).presence == pytest.approx(0.7)


def test_the_same_scans_give_the_same_belief() -> None:
    one, two = (looked(SQUARE, np.array([0.3, 0.2, 0.4]), rule(0.5), 3) for _ in range(2))
    np.testing.assert_array_equal(one.states, two.states)


# --- found --------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_a_table_on_legs_is_found_anywhere_in_a_room(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    true = rng.uniform([-1.2, -1.0, -3.0], [1.8, 1.8, 3.0])
    chosen = rule(2.3, "uniform", dynamics=STILL)
    belief = looked(legs(0.9, 0.9), true, chosen, seed)
    assert np.hypot(*(belief.mean - true)[:2]) < 0.03
    assert abs(wrap(4.0 * (belief.mean[2] - true[2]))) / 4.0 < np.radians(3.0)
    assert belief.is_certain
    assert belief.presence > 0.99


@pytest.mark.parametrize("prior", ["gaussian", "uniform"])
def test_a_table_that_is_nowhere_is_gone_and_not_somewhere_else(prior: str) -> None:
    chosen = rule(0.2 if prior == "gaussian" else 2.3, prior, dynamics=STILL)
    belief = looked(SQUARE, None, chosen, 0)
    assert belief.presence < 0.2
    assert not belief.is_certain


@pytest.mark.parametrize("nearer", [0.02, 0.03])
def test_a_wall_that_stands_nearer_is_no_chest_behind_it(nearer: float) -> None:
    item = table("chest", 2.7, 0.0, np.pi / 2, size=(1.0, 0.4))
    watch = Watch(item, rule(0.2, dynamics=STILL), 0)
    poses = np.array(LOOKS).repeat(6, axis=0)
    belief = watch.look(None, poses, building(enclosure(6.0 - 2.0 * nearer, 6.0)))
    assert belief.presence < 0.1


@pytest.mark.parametrize("seed", range(3))
def test_errors_are_as_large_as_deviations_say(seed: int) -> None:
    rng, off = np.random.default_rng(seed), []
    for k in range(4):
        true = rng.normal(0.0, [0.1, 0.1, 0.1])
        belief = looked(table("table", 0.0, 0.0), true, rule(0.2), 10 * seed + k, times=1)
        off.append((belief.mean - true) / belief.std)
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 1.6


@pytest.mark.parametrize("aside", [0.3, 0.5, 0.8])
def test_a_table_that_was_moved_while_nobody_looked_is_found_again(aside: float) -> None:
    item = table("table", 0.0, 0.0)
    watch = Watch(item, rule(0.2), 0)
    here, there = np.array([0.05, 0.0, 0.1]), np.array([0.05 + aside, 0.1, 0.5])
    poses = np.array(LOOKS).repeat(4, axis=0)
    assert np.hypot(*(watch.look(here, poses, None).mean - here)[:2]) < 0.03
    watch.seconds += 600.0
    belief = watch.look(there, poses, None)
    assert np.hypot(*(belief.mean - there)[:2]) < 0.03
    assert belief.presence > 0.99


def test_a_table_that_is_hidden_for_a_while_is_not_the_box_beside_it() -> None:
    item = table("table", 0.0, 0.0, size=(0.6, 0.5))
    watch, here = Watch(item, rule(0.2), 0), np.array([0.0, 0.0, 0.05])
    box = block(0.75, -0.1, 0.5, 0.45)
    poses = np.array([[-1.5, -2.0, 0.9], [-1.4, -2.0, 0.9], [-1.3, -2.0, 0.9]]).repeat(8, axis=0)
    known = watch.look(here, poses, building(Mesh.joined([enclosure(6.0, 6.0), box]), item))
    assert np.hypot(*(known.mean - here)[:2]) < 0.02
    screen = block(-1.3, -1.1, 1.66, 0.1)
    reality = building(Mesh.joined([enclosure(6.0, 6.0), box, screen]), item)
    belief = watch.look(here, poses[-8:].repeat(3, axis=0), reality)
    assert np.hypot(*(belief.mean - here)[:2]) < 0.02
    assert belief.presence > 0.9
