"""What drives tell of where doors hang: likelihoods of hinges and bearings, put together.

A drive's filter has, of each door, a mixture over its states with a Gaussian of the static errors in
each component. Where the door may have been closed, the direction of its leaf tells of the bearing;
elsewhere nothing does. So a drive's likelihood of the bearing is kept on a grid, that of the hinge as
information. A door that is found in one direction drive after drive is closed there; one drive
alone can't tell that from a door that is ajar.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.config import BuildingErrorSettings, DoorErrorSettings
from objstate.estimator.doors import OUTLIERS, Deviation
from objstate.geometry import FloatArray, rotation_about, transform
from objstate.objects import ObjectBelief
from objstate.objects.door_posterior import DoorPosterior
from objstate.objects.mixture_kernels import ZERO
from objstate.packing import pack, unpack

WIDEST_DEG, STEP_DEG = 9.0, 0.1  # of bearings that are considered
BEARINGS = np.radians(np.arange(-WIDEST_DEG, WIDEST_DEG + STEP_DEG / 2, STEP_DEG))  # (g,)
ROUGH_M = 0.002  # deviation of a hinge that one drive finds, beside what its filter knows of
WIDEST_HINGE_M = 0.1  # m; hinges farther off are typing errors
CONTRADICTS = 1e-6  # probability of a drive that differs so much from the others
ROUGHNESS_M = 0.004  # first guess of a drive's own error of a hinge, beside ROUGH_M
ROUGHNESS_DEG = 0.1  # the same of a bearing
ELSE = np.array([0.01, 0.03, 0.1, 0.3])  # shares of closed leaves that are something else
ROUGHNESS = np.geomspace(0.25, 8.0, 11)  # times this, that are considered
LEAST_DRIVES = 3  # of which one can contradict the others
LEAST_STD_M, LEAST_STD_DEG = 0.001, 0.02  # of what is learnt: models of leaves aren't finer


@dataclass(frozen=True, eq=False)
class DoorEvidence:
    """What one drive tells of one door's static errors, beside any prior."""

    hinge: FloatArray  # (2, 2) 1/m^2, information about its offset
    pull: FloatArray  # (2,) 1/m, that times the offset
    bearing: FloatArray  # (g,) log-likelihood of ``BEARINGS``, up to a constant

    @staticmethod
    def of(posterior: DoorPosterior) -> DoorEvidence:
        """What a filter knows when its drive has ended, without its prior."""
        mixture = posterior.mixtures[-1]  # under the widest prior
        mean, covariance = mixture.hinge
        covariance = covariance + ROUGH_M**2 * np.eye(2)
        told = np.linalg.inv(covariance)
        information = _positive(told - np.eye(2) / mixture.statics.hinge)
        offset = np.linalg.solve(information + 1e-9 * np.eye(2), told @ mean)
        return DoorEvidence(information, information @ offset, _log_bearing(posterior))

    @property
    def found(self) -> tuple[FloatArray, FloatArray] | None:
        """The hinge (2,) m and its covariance (2, 2); None where it isn't told in all directions."""
        if np.linalg.eigvalsh(self.hinge)[0] < WIDEST_HINGE_M**-2.0:
            return None
        covariance = np.asarray(np.linalg.inv(self.hinge))
        return covariance @ self.pull, covariance

    def __add__(self, other: DoorEvidence) -> DoorEvidence:
        """What both tell."""
        bearing = self.bearing + other.bearing
        return DoorEvidence(
            self.hinge + other.hinge, self.pull + other.pull, bearing - bearing.max()
        )

    def beside(self, hinge: FloatArray, bearing: float) -> DoorEvidence:
        """The same about a model, where this is about one whose hinge and bearing are off it by so much."""
        shifted = np.interp(BEARINGS - bearing, BEARINGS, self.bearing)
        return DoorEvidence(self.hinge, self.pull + self.hinge @ hinge, shifted - shifted.max())

    def rougher(self, variance: float) -> DoorEvidence:
        """The same with an own error of the drive, of a ``variance`` in m^2, in each direction."""
        left = np.linalg.inv(np.eye(2) + variance * self.hinge)
        return DoorEvidence(left @ self.hinge, left @ self.pull, self.bearing)

    def doubted(self, deviation: float, share: float) -> DoorEvidence:
        """The same with an own error of the drive, of a ``deviation`` in rad, in the bearing.

        With the probability ``share`` it was something else in the doorway that looked closed.
        """
        likelihood = np.exp(self.bearing)
        kernel = np.exp(-0.5 * (BEARINGS / max(deviation, np.radians(STEP_DEG / 4.0))) ** 2)
        padded = np.pad(likelihood, len(kernel) // 2, mode="edge")
        blurred = np.convolve(padded, kernel / kernel.sum(), mode="valid")
        log = np.log((1.0 - share) * blurred + share * likelihood.mean())
        return DoorEvidence(self.hinge, self.pull, np.asarray(log))

    def packed(self) -> bytes:
        """As bytes."""
        arrays = {"hinge": self.hinge, "pull": self.pull, "bearing": self.bearing}
        return pack({}, {name: np.asarray(each, dtype="<f8") for name, each in arrays.items()})

    @staticmethod
    def unpacked(content: bytes, name: str) -> DoorEvidence:
        """What was packed of a door. Raises WorldError for damage."""
        _, arrays = unpack(content, f"What is known of the hinge of '{name}'")
        return DoorEvidence(*(arrays[each].astype(float) for each in ("hinge", "pull", "bearing")))

    def words(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "hinge": self.hinge.round(3).tolist(),
            "pull": self.pull.round(4).tolist(),
            "bearing": self.bearing.round(3).tolist(),
        }

    @staticmethod
    def read(words: Mapping[str, Any]) -> DoorEvidence:
        """Raises KeyError, TypeError or ValueError for what isn't such words."""
        hinge, pull, bearing = (
            np.array(words[name], dtype=float) for name in ("hinge", "pull", "bearing")
        )
        if (hinge.shape, pull.shape, bearing.shape) != ((2, 2), (2,), BEARINGS.shape):
            raise ValueError("the evidence has another form")
        return DoorEvidence(hinge, pull, bearing)


Cases = Sequence[tuple[float, float]]  # probability, variance
Drive = Mapping[str, DoorEvidence]  # by door


@dataclass(frozen=True, eq=False)
class DoorStatics:
    """The posterior of one door's static errors."""

    name: str
    drives: int  # that tell of it
    hinge: FloatArray  # (2,) m, offset from the model
    hinge_covariance: FloatArray  # (2, 2) m^2
    bearing: float  # rad, of the closed leaf, beside the model's
    bearing_std: float  # rad

    @property
    def hinge_std(self) -> float:
        """m, the root of the mean variance in both directions."""
        return math.sqrt(float(np.trace(self.hinge_covariance)) / 2.0)


def evidence_of(beliefs: Mapping[str, ObjectBelief]) -> dict[str, DoorEvidence]:
    """What a drive told of the doors that it passed, by its beliefs at the end."""
    return {
        name: DoorEvidence.of(belief.joint)
        for name, belief in sorted(beliefs.items())
        if isinstance(belief.joint, DoorPosterior) and belief.last_observed_ns is not None
    }


def rehung(building: Building, doors: Sequence[DoorStatics]) -> Building:
    """The building with its doors where they were learnt to hang, and how surely."""
    if not doors:
        return building
    error = building.error or BuildingErrorSettings()
    own = {
        each.name: DoorErrorSettings(
            hinge_std_m=max(each.hinge_std, LEAST_STD_M),
            bearing_std_deg=max(math.degrees(each.bearing_std), LEAST_STD_DEG),
        )
        for each in doors
    }
    moved = {each.name: _moved(building.objects[each.name], each) for each in doors}
    return replace(
        building,
        objects={**building.objects, **moved},
        error=error.model_copy(update={"doors": {**error.doors, **own}}),
    )


def _moved(item: MovableObject, learnt: DoorStatics) -> MovableObject:
    """A door with another hinge and another closed bearing."""
    turn = transform(rotation_about(item.axis, learnt.bearing), np.zeros(3))
    origin = item.origin @ turn
    origin[:2, 3] = item.hinge + learnt.hinge
    return replace(item, origin=origin)


def combined(drives: Sequence[Drive], error: BuildingErrorSettings) -> list[DoorStatics]:
    """The posterior of each door that some drive tells of, in the order of their names.

    Each drive has an own error, as large as the differences between drives show. Its causes, leaves
    of other thickness, handles, walls off their place, are there in every drive. So all drives are
    assumed to share another error that is as large.

    How far hinges and bearings are off on the whole is learnt from all doors, but for those whose
    own deviations ``error`` has.
    """
    drives, rough = agreed(drives)
    names = sorted({name for drive in drives for name in drive})
    hinges = Deviation(error.hinge_std_m, WIDEST_HINGE_M)
    bearings = Deviation(math.radians(error.bearing_std_deg), math.radians(3.0), 3)
    drives, swung = _doubted(drives, bearings.variances)
    told = {name: [drive[name] for drive in drives if name in drive] for name in names}
    for name, evidence in told.items():
        if name in error.doors:
            continue
        hinges.observe(name, _of_hinge(evidence, hinges.variances))
        bearings.observe(name, _of_bearing(evidence, bearings.variances))
    out = []
    for name in names:
        of_hinge, of_bearing = hinges.cases(name), bearings.cases(name)
        if name in error.doors:
            own = error.doors[name]
            of_hinge = [(1.0, own.hinge_std_m**2)]
            of_bearing = [(1.0, math.radians(own.bearing_std_deg) ** 2)]
        out.append(_posterior(name, told[name], of_hinge, of_bearing, rough, swung))
    return out


def agreed(drives: Sequence[Drive]) -> tuple[list[Drive], float]:
    """The same drives, each door's hinge with an own error of each drive, and without outliers.

    Also returned is the variance of these errors, m^2.

    Boxes, handles and other thicknesses than modelled make a drive find a hinge off its place by
    more than its filter knows. How much is learnt from how drives differ. One in a hundred is an
    outlier, which took something else for the leaf, and tells nothing of that door.
    """
    kept: list[dict[str, DoorEvidence]] = [dict(drive) for drive in drives]
    while True:
        rough = _roughness(kept)
        outliers = [
            (odds, number, name)
            for name in sorted({name for drive in kept for name in drive})
            for odds, number in _outlying(kept, name, rough)
        ]
        if not outliers or max(outliers)[0] < math.log((1.0 - OUTLIERS) / OUTLIERS):
            return [_rougher(own, rough) for own in kept], rough
        _, number, name = max(outliers)
        del kept[number][name]


def _rougher(drive: Drive, variance: float) -> Drive:
    return {name: each.rougher(variance) for name, each in drive.items()}


def _roughness(drives: Sequence[Drive]) -> float:
    """m^2, variance of a drive's own error of a hinge, by how drives differ."""
    deviations = ROUGHNESS * ROUGHNESS_M
    log = -0.5 * np.log(ROUGHNESS) ** 2  # a lognormal prior
    for name in {name for drive in drives for name in drive}:
        found = [drive[name].found for drive in drives if name in drive]
        told = [each for each in found if each is not None]
        for k, deviation in enumerate(deviations):
            log[k] += _log_agreement(told, deviation**2)
    weights = np.exp(log - log.max())
    return float(weights @ deviations / weights.sum()) ** 2


def _log_agreement(told: Sequence[tuple[FloatArray, FloatArray]], variance: float) -> float:
    """log p(differences of hinges found), with a drive's own error of such a variance."""
    if len(told) < 2:
        return 0.0
    information, pull, log = np.zeros((2, 2)), np.zeros(2), 0.0
    for mean, covariance in told:
        own = np.linalg.inv(covariance + variance * np.eye(2))
        information, pull = information + own, pull + own @ mean
        log += 0.5 * (float(np.linalg.slogdet(own)[1]) - float(mean @ own @ mean))
    _, log_det = np.linalg.slogdet(information)
    return log + 0.5 * (float(pull @ np.linalg.solve(information, pull)) - float(log_det))


def _doubted(drives: Sequence[Drive], variances: FloatArray) -> tuple[list[Drive], float]:
    """The same drives, each with an own error in each bearing; and the variance of these, rad^2.

    How large they are, and in how many drives something else looked like a closed leaf, is learnt.
    """
    prior = np.asarray(np.logaddexp.reduce([_prior(each) for each in variances], axis=0))
    count = Counter(name for drive in drives for name in drive)
    log = np.empty((len(ROUGHNESS), len(ELSE)))
    for k, times in enumerate(ROUGHNESS):
        for m, share in enumerate(ELSE):
            by_door: dict[str, FloatArray] = {}
            for drive in drives:
                for name, each in drive.items():
                    if count[name] < 2:
                        continue
                    own = each.doubted(math.radians(times * ROUGHNESS_DEG), share).bearing
                    by_door[name] = by_door.get(name, prior) + own
            log[k, m] = sum(float(np.logaddexp.reduce(each)) for each in by_door.values())
    log -= 0.5 * np.log(ROUGHNESS)[:, None] ** 2 + np.log(ELSE)  # priors; few doorways are full
    weights = np.exp(log - log.max())
    weights /= weights.sum()
    deviation = math.radians(ROUGHNESS_DEG) * float(weights.sum(axis=1) @ ROUGHNESS)
    share = float(weights.sum(axis=0) @ ELSE)
    doubted: list[Drive] = [
        {name: each.doubted(deviation, share) for name, each in own.items()} for own in drives
    ]
    return doubted, deviation**2


def _outlying(drives: Sequence[Drive], name: str, rough: float) -> list[tuple[float, int]]:
    """Log of the factor by which a drive's hinge is rather an outlier, and the drive's number."""
    told = {
        number: found
        for number, drive in enumerate(drives)
        if name in drive and (found := drive[name].rougher(rough).found) is not None
    }
    if len(told) < LEAST_DRIVES:
        return []
    out = []
    for number, (mean, covariance) in told.items():
        rest = [np.linalg.inv(each[1]) for k, each in told.items() if k != number]
        means = [each[0] for k, each in told.items() if k != number]
        others = np.linalg.inv(np.sum(rest, axis=0))
        off = mean - others @ np.sum(
            [own @ each for own, each in zip(rest, means, strict=True)], axis=0
        )
        usual = covariance + others
        wide = usual + WIDEST_HINGE_M**2 * np.eye(2)
        log = 0.5 * float(off @ (np.linalg.solve(usual, off) - np.linalg.solve(wide, off)))
        log -= 0.5 * float(np.linalg.slogdet(wide)[1] - np.linalg.slogdet(usual)[1])
        out.append((log, number))
    return out


def contradicting(drives: Sequence[Drive]) -> int | None:
    """The drive that contradicts all others most, if one does.

    By the hinges, which drives tell of whether doors stood open or closed.
    """
    if len(drives) < LEAST_DRIVES:
        return None
    probabilities = []
    for number, own in enumerate(drives):
        others = [*drives[:number], *drives[number + 1 :]]
        rough = _roughness(others)
        summed = _summed([_rougher(each, rough) for each in others])
        probabilities.append(_probability(_rougher(own, rough), summed))
    worst = int(np.argmin(probabilities))
    return worst if probabilities[worst] < CONTRADICTS else None


def _summed(drives: Sequence[Drive]) -> Drive:
    """What all tell together."""
    out: dict[str, DoorEvidence] = {}
    for drive in drives:
        for name, each in drive.items():
            out[name] = out[name] + each if name in out else each
    return out


def _log_bearing(posterior: DoorPosterior) -> FloatArray:
    """(g,) the log-likelihood of bearings."""
    if not posterior.door.turn:
        return np.zeros(len(BEARINGS))
    mixture = posterior.mixtures[-1]
    weights, tied = mixture.weights, posterior.door.tied > 0.0
    before = mixture.statics.bearing
    likelihood = np.full(len(BEARINGS), float(weights[~tied].sum()))
    for k in np.flatnonzero(tied):
        mean, variance = mixture.means[k, ZERO], mixture.covariances[k, ZERO, ZERO]
        variance += np.radians(STEP_DEG / 2.0) ** 2
        after = _log_normal(BEARINGS - mean, variance)
        likelihood += weights[k] * np.exp(after - _log_normal(BEARINGS, before))
    log = np.log(np.maximum(likelihood, 1e-300))
    return np.asarray(log - log.max())


def _log_normal(off: FloatArray, variance: float) -> FloatArray:
    return np.asarray(-0.5 * off**2 / variance - 0.5 * math.log(2.0 * math.pi * variance))


def _positive(information: FloatArray) -> FloatArray:
    """The nearest matrix that tells nothing negative."""
    values, vectors = np.linalg.eigh((information + information.T) / 2.0)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _sums(evidence: Sequence[DoorEvidence]) -> tuple[FloatArray, FloatArray]:
    return (
        np.sum([each.hinge for each in evidence], axis=0),
        np.sum([each.pull for each in evidence], axis=0),
    )


def _of_hinge(evidence: Sequence[DoorEvidence], variances: FloatArray) -> FloatArray:
    """(k,) log p(z | variance) of the hinge, up to a constant."""
    information, pull = _sums(evidence)
    out = np.empty(len(variances))
    for k, variance in enumerate(variances):
        total = information + np.eye(2) / variance
        _, log_det = np.linalg.slogdet(variance * total)
        out[k] = 0.5 * (pull @ np.linalg.solve(total, pull) - log_det)
    return out


def _of_bearing(evidence: Sequence[DoorEvidence], variances: FloatArray) -> FloatArray:
    """(k,) the same of the bearing."""
    log = np.sum([each.bearing for each in evidence], axis=0)
    return np.array([float(np.logaddexp.reduce(log + _prior(v))) for v in variances])


def _prior(variance: float) -> FloatArray:
    """(g,) log-probabilities of bearings before any drive."""
    log = -0.5 * BEARINGS**2 / max(variance, np.radians(STEP_DEG / 2.0) ** 2)
    return np.asarray(log - np.logaddexp.reduce(log))


def _posterior(
    name: str,
    evidence: Sequence[DoorEvidence],
    hinges: Cases,
    bearings: Cases,
    rough: float,
    swung: float,
) -> DoorStatics:
    """Of one door, whose variances have probabilities.

    All drives share errors with variances, ``rough`` m^2 and ``swung`` rad^2.
    """
    information, pull = _sums(evidence)
    left = np.linalg.inv(np.eye(2) + rough * information)
    information, pull = left @ information, left @ pull
    mean, second = np.zeros(2), np.zeros((2, 2))
    for share, variance in hinges:
        covariance = np.linalg.inv(information + np.eye(2) / variance)
        own = covariance @ pull
        mean += share * own
        second += share * (covariance + np.outer(own, own))
    log = np.sum([each.bearing for each in evidence], axis=0)
    log = DoorEvidence(information, pull, log - log.max()).doubted(math.sqrt(swung), 0.0).bearing
    priors = [math.log(share) + _prior(variance) for share, variance in bearings]
    log = log + np.logaddexp.reduce(priors, axis=0)
    weights = np.exp(log - np.logaddexp.reduce(log))
    bearing = float(weights @ BEARINGS)
    variance = float(weights @ (BEARINGS - bearing) ** 2)
    return DoorStatics(
        name, len(evidence), mean, second - np.outer(mean, mean), bearing, math.sqrt(variance)
    )


def contradicts(known: Drive, new: Drive) -> bool:
    """Whether a drive tells of hinges that can't be those which others told of."""
    return _probability(new, known) < CONTRADICTS


def _probability(own: Drive, others: Drive) -> float:
    """How probably a hinge is off by more than the median one, if the building is the same.

    Something in a doorway may be taken for its leaf: a few hinges that differ are no contradiction.
    """
    squares = []
    for name in sorted(own.keys() & others.keys()):
        one, other = own[name].found, others[name].found
        if one is not None and other is not None:
            off, covariance = one[0] - other[0], one[1] + other[1]
            squares.append(float(off @ np.linalg.solve(covariance, off)))
    return math.exp(-0.5 * float(np.median(squares))) if squares else 1.0
