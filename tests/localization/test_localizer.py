"""Laws of Monte Carlo localization: prediction, correction, resampling, the start."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings, LocalizationSettings
from objstate.geometry import FloatArray, compose, wrap
from objstate.localization import Localizer, PoseBelief
from objstate.particles import ImpossibleEvidenceError, Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import block, building, enclosure, fan, observed, wall

L_SHAPED = building(
    Mesh.joined(
        [
            enclosure(8.0, 6.0),
            block(2.5, 1.5, 3.0, 3.0),
            wall((-1.0, -3.0), (-1.0, -1.6)),
            block(-3.4, 2.2, 0.6, 0.9, 0.3),
        ]
    )
)
EXPECTED = ExpectedRanges(L_SHAPED)
SENSING = Sensing(L_SHAPED, BeamModel(BeamModelSettings()))
RAYS = fan(91, 1.5 * np.pi)
TRUE_POSE = np.array([-2.0, -0.5, 0.4])
DEFAULT = Localizer(LocalizationSettings())


PoseLogLikelihood = Callable[[FloatArray, float], FloatArray]  # of poses (n, 3), blur m


def gaussian_log_likelihood(mean: FloatArray, std: FloatArray) -> PoseLogLikelihood:
    def log_likelihood(poses: FloatArray, blur: float) -> FloatArray:
        off = poses - mean
        off[:, 2] = wrap(off[:, 2])
        return np.asarray(-0.5 * ((off / std) ** 2).sum(axis=1))

    return log_likelihood


def corrected(
    localizer: Localizer,
    belief: PoseBelief,
    log_likelihood: PoseLogLikelihood,
    rng: np.random.Generator,
) -> PoseBelief:
    """Corrected, and renewed where few samples carry it."""
    told = log_likelihood(belief.poses, localizer.blur(belief))
    renewed, _ = localizer.renew(localizer.correct(belief, told), rng)
    return renewed


def corrected_by_scan(
    localizer: Localizer, belief: PoseBelief, pose: FloatArray, rng: np.random.Generator
) -> PoseBelief:
    view = SENSING.view(observed(EXPECTED, {}, pose, RAYS, rng))
    tempering = localizer.settings.tempering
    return corrected(
        localizer,
        belief,
        lambda poses, blur: tempering * view.pose_log_likelihood(poses, blur, []),
        rng,
    )


def test_no_motion_no_change() -> None:
    belief = DEFAULT.start(TRUE_POSE, DEFAULT.start_covariance, np.random.default_rng(0))
    assert DEFAULT.predict(belief, np.zeros(3), np.random.default_rng(1)) is belief


def test_prediction_moves_the_mean_and_widens_the_belief() -> None:
    rng = np.random.default_rng(0)
    belief = DEFAULT.start(np.array([0.0, 0.0, np.pi]), np.eye(3) * 1e-6, rng)
    moved = DEFAULT.predict(belief, np.array([0.2, 0.0, 0.1]), rng)
    np.testing.assert_allclose(moved.mean[:2], [-0.2, 0.0], atol=0.01)
    assert wrap(moved.mean[2] - np.pi - 0.1) == pytest.approx(0.0, abs=0.01)
    assert (np.diag(moved.covariance) > np.diag(belief.covariance)).all()
    np.testing.assert_array_equal(moved.weights.values, belief.weights.values)


def test_the_start_is_what_was_told() -> None:
    covariance = np.array([[0.09, 0.02, 0.0], [0.02, 0.04, 0.0], [0.0, 0.0, 0.01]])
    settings = LocalizationSettings(max_particles=20_000)
    belief = Localizer(settings).start(TRUE_POSE, covariance, np.random.default_rng(0))
    assert len(belief.weights) == 20_000
    np.testing.assert_allclose(belief.mean, TRUE_POSE, atol=0.01)
    np.testing.assert_allclose(belief.covariance, covariance, atol=0.003)
    assert belief.position_std == pytest.approx(
        np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[1]), rel=0.05
    )


def test_the_covariance_of_a_start_has_its_deviations() -> None:
    s = LocalizationSettings()
    yaw = np.radians(s.initial_yaw_std_deg)
    expected = np.diag([s.initial_xy_std, s.initial_xy_std, yaw]) ** 2
    np.testing.assert_allclose(Localizer(s).start_covariance, expected)


@pytest.fixture
def untempered(monkeypatch: pytest.MonkeyPatch) -> None:
    """However few samples stay effective, the exponent on a scan is one."""
    monkeypatch.setattr(LocalizationSettings, "least_effective", 0.0)


@pytest.mark.usefixtures("untempered")
def test_correction_is_bayes_rule() -> None:
    settings = LocalizationSettings()
    belief = DEFAULT.start(TRUE_POSE, DEFAULT.start_covariance, np.random.default_rng(0))
    told = gaussian_log_likelihood(TRUE_POSE + 0.1, np.array([0.2, 0.2, 0.1]))(belief.poses, 0.0)
    after = Localizer(settings).correct(belief, told)
    assert after.poses is belief.poses
    expected = np.exp(told)
    np.testing.assert_allclose(after.weights.values, expected / expected.sum(), atol=1e-12)


def test_a_scan_that_tells_little_resamples_nothing() -> None:
    belief = DEFAULT.start(TRUE_POSE, DEFAULT.start_covariance, np.random.default_rng(0))
    weak = gaussian_log_likelihood(TRUE_POSE, np.full(3, 5.0))
    assert corrected(DEFAULT, belief, weak, np.random.default_rng(1)).poses is belief.poses
    assert DEFAULT.renew(belief, np.random.default_rng(1)) == (belief, None)


@pytest.mark.usefixtures("untempered")
def test_resampling_keeps_mean_and_covariance(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel widens the covariance by a few hundredths (kernel_width^2 n^(-2/7))."""
    settings = LocalizationSettings(min_particles=2000)
    belief = Localizer(settings).start(
        TRUE_POSE, np.diag([0.04, 0.03, 0.02]), np.random.default_rng(0)
    )
    likelihood = gaussian_log_likelihood(TRUE_POSE + 0.1, np.array([0.1, 0.08, 0.07]))
    with monkeypatch.context() as patched:
        patched.setattr(LocalizationSettings, "resample_below", 0.0)
        weighted = corrected(Localizer(settings), belief, likelihood, np.random.default_rng(1))
    resampled = corrected(Localizer(settings), belief, likelihood, np.random.default_rng(1))
    assert resampled.weights.effective_size == pytest.approx(len(resampled.weights))
    std = np.sqrt(np.diag(weighted.covariance))
    np.testing.assert_allclose(resampled.mean, weighted.mean, atol=0.1 * std.min())
    widened = 1.0 + settings.kernel_width**2 * 2000 ** (-2 / 7)
    scale = np.outer(std, std)
    np.testing.assert_allclose(
        resampled.covariance / scale, widened * weighted.covariance / scale, atol=0.08
    )


def test_a_robot_that_stands_still_keeps_a_belief_of_distinct_samples() -> None:
    rng = np.random.default_rng(0)
    belief = DEFAULT.start(TRUE_POSE, DEFAULT.start_covariance, rng)
    likelihood = gaussian_log_likelihood(TRUE_POSE, np.array([0.05, 0.05, 0.03]))
    for _ in range(30):
        belief = corrected(DEFAULT, belief, likelihood, rng)
    assert len(np.unique(belief.poses[:, 0])) == len(belief.poses)
    assert 0.0 < belief.position_std < 0.05


@pytest.mark.usefixtures("untempered")
def test_the_sample_size_follows_the_width_of_the_belief() -> None:
    sizes = []
    for std in (0.02, 0.1, 0.5):
        belief = PoseBelief.gaussian(
            TRUE_POSE, np.diag([1.0, 1.0, 0.3]), 2000, np.random.default_rng(0)
        )
        likelihood = gaussian_log_likelihood(TRUE_POSE, np.array([std, std, 0.05]))
        settings = LocalizationSettings(min_particles=50)
        after = corrected(Localizer(settings), belief, likelihood, np.random.default_rng(1))
        sizes.append(len(after.weights))
    assert 50 <= sizes[0] < sizes[1] < sizes[2] <= 2000


def test_evidence_that_no_sample_explains_is_the_named_error() -> None:
    belief = DEFAULT.start(TRUE_POSE, DEFAULT.start_covariance, np.random.default_rng(0))
    with pytest.raises(ImpossibleEvidenceError):
        DEFAULT.correct(belief, np.full(len(belief.poses), -np.inf))


@pytest.mark.parametrize("seed", range(3))
def test_scans_concentrate_the_belief_on_the_true_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    told = TRUE_POSE + np.array([0.2, -0.15, 0.1])
    belief = DEFAULT.start(told, DEFAULT.start_covariance, rng)
    for _ in range(8):
        belief = corrected_by_scan(DEFAULT, belief, TRUE_POSE, rng)
    assert np.hypot(*(belief.mean - TRUE_POSE)[:2]) < 0.02
    assert abs(wrap(belief.mean[2] - TRUE_POSE[2])) < np.radians(0.7)
    assert belief.position_std < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_a_lost_robot_finds_itself_in_a_room_without_symmetry(seed: int) -> None:
    rng = np.random.default_rng(seed)
    localizer = Localizer(LocalizationSettings())
    anywhere = rng.uniform([-4.0, -3.0, -np.pi], [4.0, 3.0, np.pi], (15_000, 3))
    belief = PoseBelief(anywhere, Weights.uniform(15_000))
    pose, step = np.array([-3.0, -2.0, 0.6]), np.array([0.2, 0.0, 0.05])
    for _ in range(12):
        belief = corrected_by_scan(localizer, belief, pose, rng)
        pose, belief = compose(pose, step), localizer.predict(belief, step, rng)
    assert np.hypot(*(belief.mean - pose)[:2]) < 0.1
    assert len(belief.weights) < 2500


def test_thinning_keeps_the_belief_and_small_ones_as_they_are() -> None:
    rng = np.random.default_rng(0)
    weights = Weights.of(rng.dirichlet(np.ones(4000)))
    belief = PoseBelief(rng.normal(0.0, 0.1, (4000, 3)), weights)
    thinned = belief.thinned(500, rng)
    assert len(thinned.poses) == len(thinned.weights) == 500
    np.testing.assert_allclose(thinned.mean, belief.mean, atol=0.02)
    np.testing.assert_allclose(thinned.covariance, belief.covariance, atol=0.003)
    assert thinned.thinned(500, rng) is thinned


def test_moving_a_belief_moves_every_sample_in_its_own_frame() -> None:
    belief = PoseBelief(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, np.pi / 2]]), Weights.uniform(2))
    moved = belief.moved(np.array([1.0, 0.0, 0.1]))
    np.testing.assert_allclose(moved.poses, [[1.0, 0.0, 0.1], [1.0, 2.0, np.pi / 2 + 0.1]])
    assert moved.weights is belief.weights
