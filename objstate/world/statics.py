"""What drives tell of where doors hang and of their leaves: likelihoods, put together.

A drive's filter has, of each door, a mixture over its states with a Gaussian of the static errors in
each component. Where the door may have been closed, the direction of its leaf tells of the bearing;
elsewhere nothing does. So a drive's likelihood of the bearing is kept on a grid, that of the hinge
and of where the leaf lies beside it as information. A leaf that is thicker or wider than modelled
looks like one that hangs elsewhere, in another place at each of its angles. A door that is found in
one direction in most drives is closed there. One or two drives can't tell that from a door that is
ajar: many a door comes to rest ajar at an angle of its own, where its bolt meets the strike plate.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.config import BuildingErrorSettings, DoorErrorSettings
from objstate.estimator.doors import OUTLIERS, Deviation
from objstate.geometry import FloatArray, rotation_about, transform
from objstate.objects import ObjectBelief
from objstate.objects.doorframe import BearingReading
from objstate.objects.doors import AJAR, AJAR_DEG
from objstate.objects.mixture import DoorMixture
from objstate.objects.mixture_kernels import STATE, ZERO
from objstate.packing import pack, unpack
from objstate.world.widths import STEP_M, WIDTHS, WidthEvidence, wider

WIDEST_DEG, STEP_DEG = 9.0, 0.1  # of bearings that are considered
BEARINGS = np.radians(np.arange(-WIDEST_DEG, WIDEST_DEG + STEP_DEG / 2, STEP_DEG))  # (g,)
ROUGH_M = 0.002  # deviation of a hinge that one drive finds, beside what its filter knows of
WIDEST_HINGE_M = 0.1  # m; hinges farther off are typing errors
CONTRADICTS = 1e-6  # probability of a drive that differs so much from the others
ROUGHNESS_M = 0.004  # first guess of a drive's own error of a hinge, beside ROUGH_M
ROUGHNESS_DEG = 0.1  # the same of a bearing
ELSE = np.array([0.01, 0.03, 0.1, 0.3])  # shares of closed leaves that are something else
ROUGHNESS = np.geomspace(0.25, 8.0, 11)  # times this, that are considered
AJAR_STEP_DEG = 0.2  # between the angles at which a door may be ajar, all equally probable
OF_HINGE = np.diag([1.0, 1.0, 0.0, 0.0])  # the hinge's part of hinge and leaf
LEAF_M = 0.01  # deviation of where a leaf lies beside its hinge, along it and across
OF_LEAF = np.diag([0.0, 0.0, LEAF_M**-2.0, LEAF_M**-2.0])  # what is known of that before drives
# the same by door, (4, 4) 1/m^2, where widths aren't known so well
Leaves = Mapping[str, FloatArray]
WIDTH_M, WIDEST_WIDTH_M = 0.01, 0.1  # first guess of leaves' deviation from their width; largest
OWN_WIDTH_M = 0.005  # deviation of a width by one drive, beside what its scans tell
ANGLES = 9  # of a leaf over which the deviation of its hinge is averaged
LEAST_DRIVES = 3  # of which one can contradict the others
LEAST_STD_M, LEAST_STD_DEG = 0.001, 0.02  # of what is learnt: models of leaves aren't finer


@dataclass(frozen=True, eq=False)
class DoorEvidence:
    """What one drive tells of one door's static errors, beside any prior."""

    # (4, 4) 1/m^2, information about the hinge's offset, and the closed leaf's beside it; x and y
    places: FloatArray
    pull: FloatArray  # (4,) 1/m, that times these errors
    bearing: FloatArray  # (g,) log-likelihood of ``BEARINGS``, up to a constant
    width: WidthEvidence = field(default_factory=WidthEvidence)
    drives: int = 1  # number that tell this together

    @staticmethod
    def of(mixture: DoorMixture, width: WidthEvidence | None = None) -> DoorEvidence:
        """What a filter knows when its drive has ended, without its prior; and of the ``width``."""
        mean, covariance = mixture.hinge
        covariance = covariance + ROUGH_M**2 * np.eye(2)
        told = np.linalg.inv(covariance)
        information = _positive(told - np.eye(2) / mixture.statics.hinge)
        offset = np.linalg.solve(information + 1e-9 * np.eye(2), told @ mean)
        seen = np.hstack([np.eye(2), _turned(mixture)])
        if not mixture.door.turn:  # a sliding leaf is where its rail is: it is told as one place
            seen[:, 2:] = 0.0
        places = seen.T @ information @ seen
        pull, bearing = seen.T @ information @ offset, _log_bearing(mixture)
        return DoorEvidence(places, pull, bearing, width or WidthEvidence())

    @property
    def found(self) -> tuple[FloatArray, FloatArray] | None:
        """The hinge (2,) m and its covariance (2, 2); None where it isn't told in all directions."""
        return self.found_with(OF_LEAF)

    def found_with(self, of_leaf: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """The same with other information (4, 4) about the leaf before drives."""
        information = self.places + of_leaf
        if np.linalg.eigvalsh(information)[0] < WIDEST_HINGE_M**-2.0:
            return None
        covariance = np.asarray(np.linalg.inv(information))
        return (covariance @ self.pull)[:2], covariance[:2, :2]

    def __add__(self, other: DoorEvidence) -> DoorEvidence:
        """What both tell."""
        bearing = self.bearing + other.bearing
        return DoorEvidence(
            self.places + other.places,
            self.pull + other.pull,
            bearing - bearing.max(),
            self.width + other.width,
            self.drives + other.drives,
        )

    def beside(
        self,
        hinge: FloatArray,
        bearing: float,
        leaf: FloatArray | None = None,
        width: float = 0.0,
    ) -> DoorEvidence:
        """The same about a model, where this is about one that is off it by so much.

        That is by the hinge's place (2,), the bearing, the leaf's place beside the hinge (2,), and
        its width.
        """
        shifted = np.interp(BEARINGS - bearing, BEARINGS, self.bearing)
        off = np.append(hinge, np.zeros(2) if leaf is None else leaf)
        return DoorEvidence(
            self.places,
            self.pull + self.places @ off,
            shifted - shifted.max(),
            self.width.beside(hinge, width),
            self.drives,
        )

    def rougher(self, variance: float) -> DoorEvidence:
        """The same with an own error of the drive, of a ``variance`` in m^2, of the hinge."""
        left = np.linalg.inv(np.eye(4) + variance * self.places @ OF_HINGE)
        return replace(self, places=left @ self.places, pull=left @ self.pull)

    def doubted(self, deviation: float, share: float) -> DoorEvidence:
        """The same with an own error of the drive, of a ``deviation`` in rad, in the bearing.

        With the probability ``share`` it was something else in the doorway that looked closed.
        """
        likelihood = np.exp(self.bearing)
        kernel = np.exp(-0.5 * (BEARINGS / max(deviation, np.radians(STEP_DEG / 4.0))) ** 2)
        padded = np.pad(likelihood, len(kernel) // 2, mode="edge")
        blurred = np.convolve(padded, kernel / kernel.sum(), mode="valid")
        log = np.log((1.0 - share) * blurred + share * likelihood.mean())
        return replace(self, bearing=np.asarray(log))

    def packed(self) -> bytes:
        """As bytes."""
        arrays = {"hinge": self.places, "pull": self.pull, "bearing": self.bearing}
        arrays["width"] = np.array(self.width.words())
        return pack(
            {"drives": self.drives},
            {name: np.asarray(each, dtype="<f8") for name, each in arrays.items()},
        )

    @staticmethod
    def unpacked(content: bytes, name: str) -> DoorEvidence:
        """What was packed of a door. Raises WorldError for damage."""
        words, arrays = unpack(content, f"What is known of the hinge of '{name}'")
        hinge, pull, bearing = (arrays[each].astype(float) for each in ("hinge", "pull", "bearing"))
        width = WidthEvidence.read(arrays["width"]) if "width" in arrays else WidthEvidence()
        return DoorEvidence(*_of_four(hinge, pull), bearing, width, words.get("drives", 1))

    def words(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "hinge": self.places.round(3).tolist(),
            "pull": self.pull.round(4).tolist(),
            "bearing": self.bearing.round(3).tolist(),
            "width": self.width.words(),
        }

    @staticmethod
    def read(words: Mapping[str, Any]) -> DoorEvidence:
        """Raises KeyError, TypeError or ValueError for what isn't such words."""
        hinge, pull, bearing = (
            np.array(words[name], dtype=float) for name in ("hinge", "pull", "bearing")
        )
        shapes = hinge.shape, pull.shape, bearing.shape
        width = WidthEvidence.read(words["width"]) if "width" in words else WidthEvidence()
        if shapes not in (((size, size), (size,), BEARINGS.shape) for size in (2, 4)):
            raise ValueError("the evidence has another form")
        return DoorEvidence(*_of_four(hinge, pull), bearing, width)


def _of_four(information: FloatArray, pull: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Information and pull of all errors, where earlier versions kept those of the hinge alone."""
    more = 4 - len(pull)
    return np.pad(information, (0, more)), np.pad(pull, (0, more))


Cases = Sequence[tuple[float, float]]  # probability, variance
Drive = Mapping[str, DoorEvidence]  # by door


@dataclass(frozen=True, eq=False)
class DoorStatics:
    """The posterior of one door's static errors."""

    name: str
    drives: int  # that tell of it
    hinge: FloatArray  # (2,) m, offset from the model; of a sliding door, that of its rail
    leaf: FloatArray  # (2,) m, offset of the closed leaf beside the hinge; none beside a rail
    covariance: FloatArray  # (4, 4) m^2, of both
    bearing: float  # rad, of the closed leaf, beside the model's
    bearing_std: float  # rad
    width: float = 0.0  # m, by which the leaf's free edge is farther from its hinge than modelled
    width_std: float = 0.0  # m

    @property
    def hinge_std(self) -> float:
        """m, the root of the mean variance of the hinge in both directions."""
        return math.sqrt(float(np.trace(self.covariance[:2, :2])) / 2.0)

    @property
    def leaf_std(self) -> float:
        """m, the same of the leaf's place beside it."""
        return math.sqrt(float(np.trace(self.covariance[2:, 2:])) / 2.0)

    def seen_std(self, turns: FloatArray) -> float:
        """m, the same of where the leaf makes its hinge seem to be, at turns (k,) from closed, rad."""
        seen = np.concatenate([np.tile(np.eye(2), (len(turns), 1, 1)), _rotations(turns)], axis=2)
        covariances = seen @ self.covariance @ np.swapaxes(seen, 1, 2)
        return math.sqrt(float(np.trace(covariances, axis1=1, axis2=2).mean()) / 2.0)


def _rotations(turns: FloatArray) -> FloatArray:
    """(k, 2, 2) by turns (k,) rad."""
    cos, sin = np.cos(turns), np.sin(turns)
    return np.stack([np.stack([cos, -sin], axis=-1), np.stack([sin, cos], axis=-1)], axis=-2)


def _turned(mixture: DoorMixture) -> FloatArray:
    """(2, 2) the mean rotation of the leaf from the closed one, when a drive ends."""
    door = mixture.door
    count = len(door.states)
    off = mixture.means[:count, STATE].copy()
    off[door.cells :] += mixture.means[door.cells : count, ZERO]  # at a limit by the bearing
    rotations = _rotations(door.placements[:count, 2] + door.turn * off)
    return np.asarray(np.einsum("c,cij->ij", mixture.weights, rotations))


def evidence_of(
    beliefs: Mapping[str, ObjectBelief], widths: Mapping[str, WidthEvidence] | None = None
) -> dict[str, DoorEvidence]:
    """What a drive told of the doors whose leaves beams met, by its beliefs at the end.

    ``widths`` are what it told of these by door.
    """
    return {
        name: DoorEvidence.of(belief.joint, (widths or {}).get(name))
        for name, belief in sorted(beliefs.items())
        if isinstance(belief.joint, DoorMixture)
        and belief.last_observed_ns is not None
        and belief.presence >= 0.5
    }


def rehung(building: Building, doors: Sequence[DoorStatics]) -> Building:
    """The building with its doors where they were learnt to hang, and how surely."""
    if not doors:
        return building
    error = building.error or BuildingErrorSettings()
    own = {
        each.name: DoorErrorSettings(
            hinge_std_m=max(_seen_std(each, building.objects[each.name]), LEAST_STD_M),
            bearing_std_deg=max(math.degrees(each.bearing_std), LEAST_STD_DEG),
            width_std_m=_width_std(each, error),
            stop_is_known=each.name not in error.doors or error.doors[each.name].stop_is_known,
        )
        for each in doors
    }
    moved = {each.name: _moved(building.objects[each.name], each) for each in doors}
    return replace(
        building,
        objects={**building.objects, **moved},
        error=error.model_copy(update={"doors": {**error.doors, **own}}),
    )


def _width_std(learnt: DoorStatics, error: BuildingErrorSettings) -> float | None:
    """m, deviation of a width, for doors of which the building had one."""
    own = error.doors.get(learnt.name)
    if own is None or own.width_std_m is None:
        return None
    return max(learnt.width_std, LEAST_STD_M)


def leaves(building: Building) -> Leaves:
    """What is known before drives of leaves whose widths the building's errors tell of.

    A width that is off moves the free edge along the leaf, as a leaf does that lies elsewhere.
    """
    out, error = {}, building.error or BuildingErrorSettings()
    for name, own in error.doors.items():
        item = building.objects[name]
        if own.width_std_m is None or item.kind is not Kind.HINGED:
            continue
        along = item.origin[:2, 0] / np.hypot(*item.origin[:2, 0])
        covariance = LEAF_M**2 * np.eye(2) + own.width_std_m**2 * np.outer(along, along)
        out[name] = np.zeros((4, 4))
        out[name][2:, 2:] = np.linalg.inv(covariance)
    return out


def _seen_std(learnt: DoorStatics, item: MovableObject) -> float:
    """m, deviation of where a leaf makes its hinge seem to be, over its angles; or of its rail."""
    if item.kind is not Kind.HINGED:
        return learnt.hinge_std
    states = np.linspace(item.lower, item.upper, ANGLES) - item.home[0]
    return learnt.seen_std(math.copysign(1.0, item.direction[2]) * states)


def _moved(item: MovableObject, learnt: DoorStatics) -> MovableObject:
    """A door with another hinge, another closed bearing, and another place of its leaf."""
    turn = transform(rotation_about(item.axis, learnt.bearing), np.zeros(3))
    origin = item.origin @ turn
    origin[:2, 3] = item.hinge + learnt.hinge
    aside = item.origin[:3, :3].T @ np.append(learnt.leaf, 0.0)
    mesh = item.mesh.moved(transform(np.eye(3), aside))
    if learnt.width != 0.0:
        mesh = wider(mesh, learnt.width - float(aside[0]))
    return replace(item, origin=origin, mesh=mesh)


def combined(
    drives: Sequence[Drive],
    error: BuildingErrorSettings,
    downward: Collection[str] = (),
    by_walls: Mapping[str, BearingReading] | None = None,
    known_leaves: Leaves | None = None,
) -> list[DoorStatics]:
    """The posterior of each door that some drive tells of, in the order of their names.

    Each drive has an own error, as large as the differences between drives show. Its causes,
    handles, frames, walls off their place, are there in every drive. So all drives are assumed to
    share another error that is as large. Hinges are told from leaves beside them, as far as drives
    saw a leaf at different angles.

    How far hinges and bearings are off on the whole is learnt from all doors, but for those whose
    own deviations ``error`` has: those are of all that is known of them. The doors that are
    ``downward`` are closed at their upper limit. What the walls tell of bearings is in
    ``by_walls``, by door, and what is known of their leaves in ``known_leaves``, see ``leaves``.
    """
    of_leaf = known_leaves or {}
    drives, rough = agreed(drives, of_leaf)
    names = sorted({name for drive in drives for name in drive})
    hinges = Deviation(error.hinge_std_m, WIDEST_HINGE_M)
    bearings = Deviation(math.radians(error.bearing_std_deg), math.radians(3.0))
    drives, swung = _doubted(drives, bearings.variances, downward)
    told = {name: [drive[name] for drive in drives if name in drive] for name in names}
    logs = {name: _log_bearings(told[name], downward=name in downward) for name in names}
    for name, evidence in told.items():
        if name in error.doors:
            continue
        if by_walls and name in by_walls:
            reading = by_walls[name]
            logs[name] = logs[name] + _log_normal(BEARINGS - reading.error, reading.variance)
        hinges.observe(name, _of_hinge(evidence, hinges.variances))
        bearings.observe(name, _of_bearing(logs[name], bearings.variances))
    out = []
    for name in names:
        of_hinge, of_bearing = hinges.cases(name), bearings.cases(name)
        if name in error.doors:
            own = error.doors[name]
            of_hinge = [(1.0, own.hinge_std_m**2)]
            of_bearing = [(1.0, math.radians(own.bearing_std_deg) ** 2)]
        cases = of_hinge, of_bearing, of_leaf.get(name, OF_LEAF)
        out.append(_posterior(name, told[name], logs[name], *cases, rough, swung))
    return _with_widths(out, told, error)


def _with_widths(
    doors: Sequence[DoorStatics],
    told: Mapping[str, Sequence[DoorEvidence]],
    error: BuildingErrorSettings,
) -> list[DoorStatics]:
    """The same with widths.

    How far these are off on the whole is learnt from all doors, but for those of which ``error``
    tells it.
    """
    widths, logs = Deviation(WIDTH_M, WIDEST_WIDTH_M), dict[str, FloatArray]()
    stds = {name: own.width_std_m for name, own in error.doors.items() if own.width_std_m}
    for door in doors:
        if any(each.width.count for each in told[door.name]):
            logs[door.name] = _log_width(told[door.name], door.hinge, door.covariance[:2, :2])
            if door.name not in stds:
                widths.observe(door.name, _of_width(logs[door.name], widths.variances))
    out = []
    for door in doors:
        own = stds.get(door.name)
        width, std = 0.0, own or math.sqrt(widths.variance)
        if door.name in logs:
            cases = [(1.0, own**2)] if own else widths.cases(door.name)
            width, std = _width(logs[door.name], cases)
        out.append(replace(door, width=width, width_std=std))
    return out


def agreed(
    drives: Sequence[Drive], known_leaves: Leaves | None = None
) -> tuple[list[Drive], float]:
    """The same drives, each door's hinge with an own error of each drive, and without outliers.

    Also returned is the variance of these errors, m^2.

    Boxes, handles and other thicknesses than modelled make a drive find a hinge off its place by
    more than its filter knows. How much is learnt from how drives differ. One in a hundred is an
    outlier, which took something else for the leaf, and tells nothing of that door.
    """
    kept: list[dict[str, DoorEvidence]] = [dict(drive) for drive in drives]
    of_leaf = known_leaves or {}
    while True:
        rough = _roughness(kept, of_leaf)
        outliers = [
            (odds, number, name)
            for name in sorted({name for drive in kept for name in drive})
            for odds, number in _outlying(kept, name, rough, of_leaf.get(name, OF_LEAF))
        ]
        if not outliers or max(outliers)[0] < math.log((1.0 - OUTLIERS) / OUTLIERS):
            return [_rougher(own, rough) for own in kept], rough
        _, number, name = max(outliers)
        del kept[number][name]


def _rougher(drive: Drive, variance: float) -> Drive:
    return {name: each.rougher(variance) for name, each in drive.items()}


def _roughness(drives: Sequence[Drive], of_leaf: Leaves) -> float:
    """m^2, variance of a drive's own error of a hinge, by how drives differ."""
    deviations = ROUGHNESS * ROUGHNESS_M
    log = -0.5 * np.log(ROUGHNESS) ** 2  # a lognormal prior
    for name in sorted({name for drive in drives for name in drive}):
        told = [drive[name] for drive in drives if name in drive]
        log += _log_agreement(told, deviations**2, of_leaf.get(name, OF_LEAF))
    weights = np.exp(log - log.max())
    return float(weights @ deviations / weights.sum()) ** 2


def _log_agreement(
    told: Sequence[DoorEvidence], variances: FloatArray, of_leaf: FloatArray
) -> FloatArray:
    """(k,) log p(z of all drives), up to a constant, by variances (k,) of a drive's own error.

    The hinge may be anywhere.
    """
    if len(told) < 2:
        return np.zeros(len(variances))
    places, pull = np.array([each.places for each in told]), np.array([each.pull for each in told])
    inside = np.eye(4) + variances[:, None, None, None] * (places @ OF_HINGE)  # (k, d, 4, 4)
    sides = np.broadcast_to(
        np.concatenate([places, pull[..., None]], axis=2), (*inside.shape[:3], 5)
    )
    left = np.linalg.solve(inside, sides)
    total = OF_HINGE / WIDEST_HINGE_M**2 + of_leaf + left[..., :4].sum(axis=1)  # (k, 4, 4)
    pulls = left[..., 4].sum(axis=1)  # (k, 4)
    gained = variances * np.einsum("di,ij,kdj->k", pull, OF_HINGE, left[..., 4])
    log = gained - np.linalg.slogdet(inside)[1].sum(axis=1) - np.linalg.slogdet(total)[1]
    found = np.linalg.solve(total, pulls[..., None])[..., 0]
    return np.asarray(0.5 * (log + np.sum(pulls * found, axis=1)))


def _doubted(
    drives: Sequence[Drive], variances: FloatArray, downward: Collection[str]
) -> tuple[list[Drive], float]:
    """The same drives, each with an own error in each bearing; and the variance of these, rad^2.

    How large they are, and in how many drives something else looked like a closed leaf, is learnt.
    """
    prior = np.asarray(np.logaddexp.reduce([_prior(each) for each in variances], axis=0))
    count = Counter(name for drive in drives for name in drive)
    log = np.empty((len(ROUGHNESS), len(ELSE)))
    for k, times in enumerate(ROUGHNESS):
        for m, share in enumerate(ELSE):
            by_door: dict[str, list[DoorEvidence]] = {}
            for drive in drives:
                for name, each in drive.items():
                    if count[name] < 2:
                        continue
                    own = each.doubted(math.radians(times * ROUGHNESS_DEG), share)
                    by_door.setdefault(name, []).append(own)
            log[k, m] = sum(
                float(np.logaddexp.reduce(prior + _log_bearings(told, downward=name in downward)))
                for name, told in by_door.items()
            )
    log -= 0.5 * np.log(ROUGHNESS)[:, None] ** 2 + np.log(ELSE)  # priors; few doorways are full
    weights = np.exp(log - log.max())
    weights /= weights.sum()
    deviation = math.radians(ROUGHNESS_DEG) * float(weights.sum(axis=1) @ ROUGHNESS)
    share = float(weights.sum(axis=0) @ ELSE)
    doubted: list[Drive] = [
        {name: each.doubted(deviation, share) for name, each in own.items()} for own in drives
    ]
    return doubted, deviation**2


def _outlying(
    drives: Sequence[Drive], name: str, rough: float, of_leaf: FloatArray
) -> list[tuple[float, int]]:
    """Log of the factor by which a drive's hinge is rather an outlier, and the drive's number."""
    told = {
        number: found
        for number, drive in enumerate(drives)
        if name in drive and (found := drive[name].rougher(rough).found_with(of_leaf)) is not None
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
        rough = _roughness(others, {})
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


def _log_bearing(mixture: DoorMixture) -> FloatArray:
    """(g,) the log-likelihood of bearings, without what the walls tell."""
    if not mixture.door.turn:
        return np.zeros(len(BEARINGS))
    weights, cells = mixture.weights, mixture.door.cells
    error, before = mixture.door.zero_before(mixture.statics)
    step = np.radians(STEP_DEG / 2.0) ** 2
    likelihood = np.full(len(BEARINGS), float(weights[:cells].sum()))
    for k in range(cells, len(weights)):  # the limits
        mean, variance = mixture.means[k, ZERO], mixture.covariances[k, ZERO, ZERO]
        if variance >= before:  # by cells with different means; its ratio would grow without end
            likelihood += weights[k]
            continue
        after = _log_normal(BEARINGS - mean, variance + step)
        likelihood += weights[k] * np.exp(after - _log_normal(BEARINGS - error, before + step))
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
        np.sum([each.places for each in evidence], axis=0),
        np.sum([each.pull for each in evidence], axis=0),
    )


def _of_hinge(evidence: Sequence[DoorEvidence], variances: FloatArray) -> FloatArray:
    """(k,) log p(z | variance) of the hinge, up to a constant."""
    information, pull = _sums(evidence)
    out = np.empty(len(variances))
    for k, variance in enumerate(variances):
        total = information + OF_HINGE / variance + OF_LEAF
        _, log_det = np.linalg.slogdet(total)
        out[k] = 0.5 * (pull @ np.linalg.solve(total, pull) - log_det) - math.log(variance)
    return out


def _log_bearings(evidence: Sequence[DoorEvidence], *, downward: bool) -> FloatArray:
    """(g,) log-likelihood of bearings by all drives.

    In each, the door may have been ajar instead of closed, at the angle of its own, which is summed
    over.
    """
    likelihoods = np.exp([each.bearing for each in evidence])  # (d, g)
    shares = np.array([AJAR**each.drives for each in evidence])[:, None, None]
    least, most = AJAR_DEG
    angles = np.arange(least, most + AJAR_STEP_DEG / 2.0, AJAR_STEP_DEG)
    cells = np.round(angles / STEP_DEG).astype(int)[:, None] * (-1 if downward else 1)
    ahead = (np.arange(len(BEARINGS)) + cells).clip(0, len(BEARINGS) - 1)  # (a, g)
    ajar = likelihoods[:, ahead]  # (d, a, g)
    log = np.log(likelihoods[:, None] + shares * ajar).sum(axis=0)
    return np.asarray(np.logaddexp.reduce(log, axis=0) - math.log(len(log)))


def _of_bearing(log: FloatArray, variances: FloatArray) -> FloatArray:
    """(k,) the same of the bearing, by its log-likelihood (g,)."""
    return np.array([float(np.logaddexp.reduce(log + _prior(v))) for v in variances])


def _log_width(
    evidence: Sequence[DoorEvidence], hinge: FloatArray, covariance: FloatArray
) -> FloatArray:
    """(h,) log-likelihood of a width by all drives, where the hinge is known so far.

    Each drive has an own error, and all share one that is as large.
    """
    total = WidthEvidence()
    for each in evidence:
        seen = each.width.beside(-hinge, 0.0)
        total = total + replace(seen, log=seen.blurred(OWN_WIDTH_M))
    variance = OWN_WIDTH_M**2 + float(total.aim @ covariance @ total.aim)
    return total.blurred(math.sqrt(variance))


def _width_prior(variance: float) -> FloatArray:
    """(h,) log-probabilities of widths before any drive."""
    log = -0.5 * WIDTHS**2 / max(variance, STEP_M**2 / 4.0)
    return np.asarray(log - np.logaddexp.reduce(log))


def _of_width(log: FloatArray, variances: FloatArray) -> FloatArray:
    """(k,) log p(z | variance) of a width, up to a constant."""
    return np.array([float(np.logaddexp.reduce(log + _width_prior(v))) for v in variances])


def _width(log: FloatArray, widths: Cases) -> tuple[float, float]:
    """m, by which a leaf is wider, and its standard deviation."""
    priors = [math.log(share) + _width_prior(variance) for share, variance in widths]
    log = log + np.logaddexp.reduce(priors, axis=0)
    weights = np.exp(log - np.logaddexp.reduce(log))
    mean = float(weights @ WIDTHS)
    return mean, math.sqrt(float(weights @ (WIDTHS - mean) ** 2))


def _prior(variance: float) -> FloatArray:
    """(g,) log-probabilities of bearings before any drive."""
    log = -0.5 * BEARINGS**2 / max(variance, np.radians(STEP_DEG / 2.0) ** 2)
    return np.asarray(log - np.logaddexp.reduce(log))


def _posterior(
    name: str,
    evidence: Sequence[DoorEvidence],
    bearing_log: FloatArray,
    hinges: Cases,
    bearings: Cases,
    of_leaf: FloatArray,
    rough: float,
    swung: float,
) -> DoorStatics:
    """Of one door, with the log-likelihood (g,) of its bearing; variances have probabilities.

    All drives share errors with variances, ``rough`` m^2 and ``swung`` rad^2.
    """
    information, pull = _sums(evidence)
    left = np.linalg.inv(np.eye(4) + rough * information @ OF_HINGE)
    information, pull = left @ information, left @ pull
    mean, second = np.zeros(4), np.zeros((4, 4))
    for share, variance in hinges:
        covariance = np.linalg.inv(information + OF_HINGE / variance + of_leaf)
        own = covariance @ pull
        mean += share * own
        second += share * (covariance + np.outer(own, own))
    log = bearing_log - bearing_log.max()
    log = DoorEvidence(information, pull, log).doubted(math.sqrt(swung), 0.0).bearing
    priors = [math.log(share) + _prior(variance) for share, variance in bearings]
    log = log + np.logaddexp.reduce(priors, axis=0)
    weights = np.exp(log - np.logaddexp.reduce(log))
    bearing = float(weights @ BEARINGS)
    variance = float(weights @ (BEARINGS - bearing) ** 2)
    covariance = second - np.outer(mean, mean)
    return DoorStatics(
        name,
        len(evidence),
        mean[:2],
        mean[2:],
        covariance,
        bearing,
        math.sqrt(variance),
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
