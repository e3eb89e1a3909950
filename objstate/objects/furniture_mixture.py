"""A piece of furniture's joint posterior p(s, l | z): a Gaussian mixture over x, y, yaw.

Each component is a place with a Gaussian over the error of the robot's pose and the object's offset
from that place. One component represents an object that isn't there. Cells cover the prior and the
surroundings of the most probable place, where a moved object arrives. Where readings show it
elsewhere, components are proposed, which weigh what the mixture has there. See
docs/model/furniture.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import MovableObject
from objstate.building.outline import outline
from objstate.config import FurnitureSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, whitened, wrap
from objstate.lazy import Later, altered, lazy
from objstate.objects import pushing
from objstate.objects.belief import ObjectBelief
from objstate.objects.furniture import kernel_width
from objstate.objects.ground import NO_WALLS, OUTLINE_STD, Floor, ground_of
from objstate.objects.mixture import NEVER
from objstate.objects.proposals import TracedOutline
from objstate.objects.shape import shape_of
from objstate.particles import Weights, evenly

if TYPE_CHECKING:
    from objstate.objects import components, repeats
    from objstate.objects import mixture_kernels as kernels
    from objstate.objects.mixture_kernels import Beams, Noise, Shape
else:
    kernels = Later("objstate.objects.mixture_kernels")
    components = Later("objstate.objects.components")

OF_PRIOR, NEARBY = 64, 16  # number of cells
FOUND = 24  # most components besides cells
ABSENT = 0  # the component of an object that isn't there
PRESENT = slice(1, None)  # the others
ANY_STD = np.zeros(3)  # deviations that every component exceeds
FAR = 1e6  # m; no object is there
PROPOSED = 16  # most components proposed by a scan
# m, m, rad; small enough for linear ranges
PROPOSED_STD = np.array([0.05, 0.05, math.radians(4.0)])
HEIGHT_STEP = 0.01  # m; outlines at closer heights are the same
HARDLY = 1e-6  # probability below which a place isn't possible
LEAST = 1e-9  # weight below which a component that isn't a cell is dropped
TELLING = 1e-4  # weight from which a component is published
PUBLISHED, FEWEST = 400, 6  # samples that are published, and the least number of a component
OF_SAMPLES = 32  # components that represent a belief of samples
STATE = slice(3, 6)  # of the errors: yaw, x, y
ORDER = [4, 5, 3]  # x, y, yaw of the errors


class About(NamedTuple):
    """What is about a piece of furniture."""

    static: FloatArray  # (3,) variances of x, y, yaw by which the place that readings show is off
    std: float  # m, deviation of walls, of other bodies and of its outline from their models
    bodies: FloatArray  # (m, 6) other bodies, see ``components.possible``


NOTHING = About(np.zeros(3), OUTLINE_STD, np.empty((0, 6)))


@dataclass(frozen=True)
class Piece:
    """The constant data of a piece of furniture: its outline, its cells, and its dynamics."""

    item: MovableObject
    settings: FurnitureSettings
    floor: Callable[[], Floor] = lambda: NO_WALLS

    @property
    def columns(self) -> int:
        """Number of columns that describe a component's velocity."""
        return pushing.COLUMNS if self.settings.motion == "pushed" else 0

    @lazy
    def prior_covariance(self) -> FloatArray:
        """(3, 3) of x, y, yaw about home."""
        s, by_shape = self.settings, 1.0
        *place, yaw = s.prior_std
        if s.prior == "uniform":
            yaw, by_shape = min(yaw, math.pi / self.item.symmetry.order), 1.0 / math.sqrt(3.0)
        return np.diag((by_shape * np.array([*place, yaw])) ** 2)

    @lazy
    def cells(self) -> tuple[FloatArray, FloatArray]:
        """Places (c, 3) of the prior's cells and the covariance (3, 3) of each."""
        is_gaussian = self.settings.prior == "gaussian"
        return _covered(self.item.home, self.prior_covariance, OF_PRIOR, is_gaussian)

    @lazy
    def ground(self) -> components.Ground:
        """Where it can stand."""
        return ground_of(self.item, self.floor(), self.reach)

    def possible(self, places: FloatArray, covariances: FloatArray, about: About) -> FloatArray:
        """(c,) probability that it can stand in components at places (c, 3).

        Their errors have ``covariances`` (c, 8, 8).
        """
        out, bodies = np.empty(len(places)), about.bodies
        components.possible(places, covariances, self.ground, bodies, about.std, out)
        return out

    def nearby(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places (c, 3) to which it may be pushed from a place (3,), and the covariance of each."""
        return _covered(place, np.diag(np.square(self.settings.nudge)), NEARBY, is_gaussian=True)

    def drift(self, seconds: float) -> FloatArray:
        """(3,) variances of x, y, yaw that drift adds."""
        return np.asarray(seconds * np.square(self.settings.dynamics.drift))

    def shape(self, height: float) -> Shape:
        """Its outline at a height above the floor, m, about its origin at yaw 0."""
        segments = outline(self.item.upright_mesh, height - self.item.origin[2, 3]).reshape(-1, 4)
        return shape_of(segments, 1.0, np.zeros(2))

    @lazy
    def reach(self) -> float:
        """Its largest distance from its origin, m, seen from above."""
        return float(np.hypot(*self.item.upright_mesh.vertices[:, :2].T).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class FurnitureMixture:
    """p(s, l | z) of one piece of furniture. A value: updates return new ones.

    Component 0 is its absence. Then come the prior's cells, those near its place, and components
    that were found.
    """

    piece: Piece
    weights: FloatArray  # (c,) sum to one
    places: FloatArray  # (c, 3) x, y, yaw
    robots: FloatArray  # (c, 3) mean error of the robot's pose
    covariances: FloatArray  # (c, 8, 8) of errors, see ``mixture_kernels``
    motions: FloatArray  # (c, 10) of furniture that may be pushed, see ``pushing``; else (c, 0)
    about: About = NOTHING
    ends: Mapping[str, repeats.Ends] = field(default_factory=dict)  # of each laser's last scan
    stamp_ns: int | None = None

    @staticmethod
    def unknown(piece: Piece) -> FurnitureMixture:
        """The mixture before any scan."""
        presence = piece.settings.presence
        nowhere = np.empty((0, 3))
        blank = FurnitureMixture._of(piece, nowhere, np.zeros((3, 3)), np.empty(0))
        cells = slice(1, 1 + OF_PRIOR)
        shares = piece.possible(blank.places[cells], blank.covariances[cells], blank.about)
        blank.weights[ABSENT] = 1.0 - presence
        blank.weights[cells] = presence * shares / shares.sum()
        return blank

    @staticmethod
    def of(piece: Piece, belief: ObjectBelief) -> FurnitureMixture:
        """The mixture of a belief of samples."""
        off = belief.deviations
        covariance = (belief.weights.values[:, None] * off).T @ off
        chosen = off[evenly(belief.weights, OF_SAMPLES)]
        share = kernel_width(OF_SAMPLES) ** 2
        places = belief.mean + math.sqrt(1.0 - share) * chosen
        weights = np.full(OF_SAMPLES, belief.presence / OF_SAMPLES)
        out = FurnitureMixture._of(piece, places, share * covariance, weights)
        out.weights[ABSENT] = 1.0 - belief.presence
        return out.at(belief.stamp_ns)

    @staticmethod
    def _of(
        piece: Piece, places: FloatArray, covariance: FloatArray, weights: FloatArray
    ) -> FurnitureMixture:
        """Cells without weight, and components of some weights (c,) at places (c, 3)."""
        cells, of_cell = piece.cells
        near, of_near = piece.nearby(piece.item.home)
        nowhere = np.array([[FAR, FAR, 0.0]])
        count = 1 + OF_PRIOR + NEARBY
        covariances = np.concatenate(
            [
                of_place(each, number)
                for each, number in (
                    (np.zeros((3, 3)), 1),
                    (of_cell, OF_PRIOR),
                    (of_near, NEARBY),
                    (covariance, len(places)),
                )
            ]
        )
        all_places = np.concatenate([nowhere, cells, near, places])
        return FurnitureMixture(
            piece,
            np.concatenate([np.full(count, NEVER), weights]),
            all_places,
            np.zeros((len(all_places), 3)),
            covariances,
            np.zeros((len(all_places), piece.columns)),
            NOTHING,
        )

    def at(self, stamp_ns: int | None) -> FurnitureMixture:
        """The same at a moment."""
        return altered(self, stamp_ns=stamp_ns)

    @property
    def presence(self) -> float:
        """Probability that it is there."""
        return float(1.0 - self.weights[ABSENT])

    @property
    def p_moving(self) -> float:
        """Probability that it is being pushed, if it is there."""
        weights = self.weights[1:]
        return float(weights[pushing.moving(self.motions[1:])].sum() / weights.sum())

    @property
    def best(self) -> FloatArray:
        """(3,) the place of the heaviest component in which it is there."""
        return np.asarray(self.places[1 + int(np.argmax(self.weights[1:]))])

    def later(
        self,
        seconds: float,
        transfer: FloatArray,
        added: FloatArray,
        robot: FloatArray,
        about: About | None = None,
    ) -> FurnitureMixture:
        """The prediction over some time, in which the object may have been moved.

        The robot's error is ``transfer`` (3, 3) times the earlier one, plus an independent one of
        covariance ``added`` (3, 3); its own covariance is ``robot`` (3, 3). What is
        ``about`` the object has changed to that; None: it hasn't.
        """
        piece, moved = self.piece, self.piece.settings.dynamics.moved(seconds)
        about = about or self.about
        places, covariances = self.places.copy(), self.covariances.copy()
        means = np.zeros((len(places), kernels.ERRORS))
        means[:, :3] = self.robots
        covariances[:, ORDER, ORDER] += piece.drift(seconds)
        kernels.renew_robot(means, covariances, transfer, added)
        there = piece.settings.presence
        weights = (1.0 - moved) * self.weights
        weights[ABSENT] += moved * (1.0 - there)
        robots, first = np.ascontiguousarray(means[:, :3]), 1
        for cells, covariance in (piece.cells, piece.nearby(self.best)):
            part = slice(first, first + len(cells))
            shares = piece.possible(cells, of_place(covariance, len(cells)), about)
            components.arrive(
                0.5 * moved * there * shares / shares.sum(),
                cells,
                covariance,
                robot,
                weights[part],
                places[part],
                robots[part],
                covariances[part],
            )
            first += len(cells)
        after = weights, places, robots, covariances, self.motions
        if piece.columns:
            after = _pushed(seconds, *after)
        return FurnitureMixture(piece, *after, about, self.ends, self.stamp_ns)

    def density(
        self,
        places: FloatArray,
        std: FloatArray = PROPOSED_STD,
        part: slice | BoolArray = PRESENT,
    ) -> FloatArray:
        """Density (p,) at places (p, 3) of components wider than ``std`` (3,), or of a part of them."""
        symmetry, out = self.piece.item.symmetry, np.empty(len(places))
        components.densities(
            np.ascontiguousarray(places),
            self.weights[part],
            self.places[part],
            self.covariances[part],
            std,
            symmetry.order,
            symmetry.centre,
            out,
        )
        return out

    def proposing(self, proposed: FloatArray, robot: FloatArray) -> FurnitureMixture:
        """The mixture with components at places (p, 3), which weigh what it has there.

        That is the density of its wider components times the volume of the new one, shared by those
        that overlap. So a proposal is no evidence. Where it has next to nothing, none is added.
        """
        if len(proposed) == 0:
            return self
        std, covariances = PROPOSED_STD, of_place(np.diag(PROPOSED_STD**2), len(proposed))
        covariances[:, :3, :3] = robot
        possible = self._possible(self.places, self.covariances)
        whole = np.where(possible > HARDLY, self.weights / possible, 0.0)
        density = altered(self, weights=whole).density(proposed)
        density *= self._possible(proposed, covariances)
        off = proposed[:, None] - proposed
        off[..., 2] = wrap(off[..., 2])
        crowd = np.exp(-0.5 * ((off / std) ** 2).sum(axis=2)).sum(axis=1)
        weights = density * (math.sqrt(2.0 * math.pi) ** 3 * std.prod()) / crowd
        able = weights > NEVER
        proposed = proposed[able]
        motions = pushing.shared(
            self.motions, self.weights, self.places, self.covariances, proposed, std
        )
        return altered(
            self,
            weights=np.concatenate([self.weights, weights[able]]),
            places=np.concatenate([self.places, proposed]),
            robots=np.concatenate([self.robots, np.zeros((len(proposed), 3))]),
            covariances=np.concatenate([self.covariances, covariances[able]]),
            motions=np.concatenate([self.motions, motions]),
        )

    def given(self, beams: Beams, noise: Noise, shape: Shape) -> tuple[Conditioned, int]:
        """Bayes' rule for a scan, and the number of beams that reach the most probable place.

        The prior ends where the piece would reach into walls, as each component's Gaussian doesn't.
        """
        means = np.zeros((len(self.weights), kernels.ERRORS))
        means[:, :3] = self.robots
        covariances, log_evidence = self.covariances.copy(), np.empty(len(means))
        kinds = np.zeros((len(means), len(kernels.KINDS)))  # neither handles nor glass
        best = [1 + int(np.argmax(self.weights[1:]))]
        once, reached = np.ones(len(beams.measured)), 0
        arrived = np.zeros(len(means), dtype=bool)
        for part in (slice(None), best):
            reached = kernels.condition(
                beams,
                shape,
                noise,
                once,
                once,
                arrived[part],
                self.places[part],
                np.maximum(self.weights[part], NEVER),
                kernels.FLAT,
                means[part],
                covariances[part],
                kinds[part],
                log_evidence[part],
            )
        shift = means[:, ORDER]
        places = self.places + shift
        places[:, 2] = wrap(places[:, 2])
        log_weights = np.log(np.maximum(self.weights, NEVER)) + log_evidence
        log_weights += np.log(self._possible(places, covariances))
        log_weights -= np.log(self._possible(self.places, self.covariances))
        robots = np.ascontiguousarray(means[:, :3])
        motions = pushing.corrected(self.motions, self.covariances, covariances, shift[:, :2])
        after = Conditioned(self, log_weights, places, robots, covariances, motions)
        return after, int(reached)

    def _possible(self, places: FloatArray, covariances: FloatArray) -> FloatArray:
        return self.piece.possible(places, covariances, self.about)

    def circles(self) -> FloatArray:
        """(c, 3) x, y, radius m of circles that hold the object, by component, given presence."""
        variances = self.covariances[1:, 4, 4] + self.covariances[1:, 5, 5]
        radius = self.piece.reach + 2.0 * np.sqrt(variances)
        return np.column_stack([self.places[1:, :2], radius])

    def sampled(self, belief: ObjectBelief) -> ObjectBelief:
        """The posterior of the state as weighted samples at fixed normal draws."""
        there = self.weights[1:] / self.weights[1:].sum()
        telling = 1 + np.flatnonzero(there > TELLING * there.max())
        there = self.weights[telling] / self.weights[telling].sum()
        counts = np.maximum(np.rint(PUBLISHED * there).astype(int), FEWEST)
        states, weights = np.empty((counts.sum(), 3)), np.repeat(there / counts, counts)
        first = 0
        for k, count in zip(telling.tolist(), counts.tolist(), strict=True):
            own = self.covariances[k][np.ix_(ORDER, ORDER)] + np.diag(self.about.static)
            root = np.linalg.cholesky(own)
            states[first : first + count] = self.places[k] + _draws(count) @ root.T
            first += count
        states[:, 2] = wrap(states[:, 2])
        return altered(
            belief,
            states=states,
            weights=Weights.of(weights),
            presence=self.presence,
            stamp_ns=self.stamp_ns,
            joint=self,
            p_moving=np.array([self.p_moving]),
        )


class Conditioned(NamedTuple):
    """The components of a mixture after a scan."""

    mixture: FurnitureMixture  # before it
    log_weights: FloatArray  # (c,) logarithms of prior weight times likelihood
    places: FloatArray  # (c, 3) as in the mixture
    robots: FloatArray
    covariances: FloatArray
    motions: FloatArray

    @property
    def alone(self) -> FloatArray:
        """(c,) weights, if nothing else is known of where it stands."""
        weights = np.exp(self.log_weights - self.log_weights.max())
        return np.asarray(weights / weights.sum())

    def only(self, chosen: IntArray) -> Conditioned:
        """Some of the components."""
        return Conditioned(self.mixture, *(each[chosen] for each in self[1:]))

    def weighed(self, weights: FloatArray) -> FurnitureMixture:
        """The mixture of weights (c,); components at one place are merged, the heaviest kept."""
        mixture, weights = self.mixture, weights.copy()
        places, robots = self.places.copy(), self.robots.copy()
        covariances = self.covariances.copy()
        symmetry, is_moving = mixture.piece.item.symmetry, pushing.moving(self.motions)
        modes = [each for each in (~is_moving, is_moving) if each.any()]
        for mode in modes:
            own = weights * mode
            components.merge(
                own, places, robots, covariances, symmetry.order, symmetry.centre, LEAST
            )
            weights[mode] = own[mode]
        cells = 1 + OF_PRIOR + NEARBY
        found = cells + np.flatnonzero(weights[cells:] > LEAST)
        found = found[np.argsort(-weights[found], kind="stable")[:FOUND]]
        kept = np.concatenate([np.arange(cells), found])
        weights = np.maximum(weights[kept], NEVER)
        return FurnitureMixture(
            mixture.piece,
            weights / weights.sum(),
            places[kept],
            robots[kept],
            covariances[kept],
            self.motions[kept],
            mixture.about,
            mixture.ends,
            mixture.stamp_ns,
        )


def _pushed(
    seconds: float,
    weights: FloatArray,
    places: FloatArray,
    robots: FloatArray,
    covariances: FloatArray,
    motions: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """The components (c,) after some time in which they may begin and cease to be pushed."""
    left, of, parts, new = pushing.switched(seconds, weights, motions, ABSENT)
    places, covariances = (np.concatenate([each, each[of]]) for each in (places, covariances))
    motions = np.concatenate([motions, new])
    pushing.advance(seconds, places, covariances, motions)
    robots = np.concatenate([robots, robots[of]])
    return np.concatenate([left, parts]), places, robots, covariances, motions


def of_place(covariance: FloatArray, count: int) -> FloatArray:
    """(count, 8, 8) covariances of errors, those of x, y, yaw being (3, 3) or (count, 3, 3)."""
    out = np.zeros((count, kernels.ERRORS, kernels.ERRORS))
    out[np.ix_(range(count), ORDER, ORDER)] = covariance
    return out


def traced(item: MovableObject, height: float) -> TracedOutline | None:
    """Points along an object's outline at a height above the floor, m."""
    return TracedOutline.of(outline(item.upright_mesh, height - item.origin[2, 3]))


def _covered(
    middle: FloatArray, covariance: FloatArray, count: int, is_gaussian: bool
) -> tuple[FloatArray, FloatArray]:
    """Places (count, 3), and the covariance of each, of Gaussians with a joint covariance."""
    share = kernel_width(count) ** 2
    root = np.linalg.cholesky(covariance)
    places = middle + math.sqrt(1.0 - share) * _spread(count, is_gaussian) @ root.T
    places[:, 2] = wrap(places[:, 2])
    return places, share * covariance


@lru_cache(maxsize=8)
def _spread(count: int, is_gaussian: bool) -> FloatArray:
    """Low-discrepancy points (count, 3) of a standard normal or uniform distribution.

    Scaled to its covariance.
    """
    ratio = 1.2207440846057596  # the real root of x^4 = x + 1 (Roberts 2018)
    steps = ratio ** -np.arange(1.0, 4.0)
    unit = (0.5 + np.outer(np.arange(1, count + 1), steps)) % 1.0
    if is_gaussian:
        unit = np.vectorize(NormalDist().inv_cdf)(unit)
    return whitened(unit)


@lru_cache(maxsize=PUBLISHED)
def _draws(count: int) -> FloatArray:
    """Points (count, 3) of a standard normal distribution, with exactly its mean and covariance."""
    if count < 4 * FEWEST:
        axes = math.sqrt(3.0) * np.concatenate([np.eye(3), -np.eye(3)])
        return np.asarray(axes[np.arange(count) % len(axes)])
    return whitened(np.random.default_rng(0).standard_normal((count, 3)))
