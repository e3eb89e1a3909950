"""Pieces of furniture of one form: no two stand at one place, and none is told from another.

For several pieces with places c_1 .. c_k,

    p(c_1 .. c_k | z) = prod_i f_i(c_i) L(c_i) * prod_{i<j} phi(c_i, c_j).

phi is the probability that two don't overlap. L is one function for all, since they look alike: of
two pieces at one place, the one is likelier there whose predicted density there is larger. The
factors f_i are those for which the prediction, without L, has each piece's own marginals; they are
found by iterative proportional fitting (Deming and Stephan 1940). So phi is used once, however many
scans there are, and what isn't known of identities stays unknown. This is joint probabilistic data
association (Fortmann, Bar-Shalom and Scheffe 1983) of places to pieces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import MovableObject
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later
from objstate.objects.footprint import OBJECTS_KEPT, silhouette
from objstate.objects.furniture_mixture import (
    ABSENT,
    ANY_STD,
    ORDER,
    Conditioned,
    FurnitureMixture,
    Piece,
)
from objstate.particles.weights import NEVER

if TYPE_CHECKING:
    from scipy import special
else:
    special = Later("scipy.special")

SAME_FORM = 1e-3  # m by which corners of one form may differ
TOUCHING = 0.9  # of the least distance at which two pieces touch: nearer ones overlap
PLACES = 6  # most places that are looked for to a piece
HYPOTHESES = 2000  # most combinations of places
ROUNDS = 30  # of proportional fitting
TAKEN = 1e-6  # probability from which a piece may take a place
NARROW = 0.25  # of that distance: deviation up to which a component is at one place
WEIGHED = 1e-5  # weight from which a component competes for a place
IMPOSSIBLE = -1e9  # a log-probability


def alike(pieces: Mapping[str, Piece]) -> list[list[str]]:
    """The names of pieces of one form, by form."""
    groups = list[list[str]]()
    for name, piece in pieces.items():
        corners = piece.item.upright_mesh.vertices
        for group in groups:
            others = pieces[group[0]].item.upright_mesh.vertices
            if corners.shape == others.shape and np.allclose(corners, others, atol=SAME_FORM):
                group.append(name)
                break
        else:
            groups.append([name])
    return groups


def compete(one: FurnitureMixture, other: FurnitureMixture) -> bool:
    """Whether two pieces may stand at one place, so that neither is background of the other."""
    a, b = (m.places[1:][m.weights[1:] > WEIGHED, :2] for m in (one, other))
    return bool((_distances(a, b) < spacing(one.piece.item)).any())


@lru_cache(maxsize=OBJECTS_KEPT)
def spacing(item: MovableObject) -> float:
    """m; the middles of two pieces of an item's form are farther apart."""
    import shapely

    widest = shapely.maximum_inscribed_circle(silhouette(item).convex_hull)
    return TOUCHING * 2.0 * float(shapely.length(widest))


def exclusive(pieces: Sequence[Conditioned]) -> list[FurnitureMixture]:
    """The mixtures of several pieces of one form after a scan of them all."""
    together = dict[int, FurnitureMixture]()
    if len(pieces) > 1:
        near = spacing(pieces[0].mixture.piece.item)
        places = _places(pieces, near)
        for group in _groups(pieces, places, near):
            shown = [place for place in places if place.owner in group]
            candidates = {i: Candidate.of(pieces[i], shown, near) for i in group}
            together |= _together(candidates, shown, near)
    return [
        together[i] if i in together else each.weighed(each.alone) for i, each in enumerate(pieces)
    ]


class Place(NamedTuple):
    """Where a scan may show a piece of the form."""

    owner: int  # the piece by whose mixture it is known
    share: float  # logarithm of that piece's own probability of being there
    at: FloatArray  # (3,) x, y, yaw
    spread: FloatArray  # (2, 2) m^2 of x and y
    seen: IntArray  # (k,) the owner's components there


def _places(pieces: Sequence[Conditioned], near: float) -> list[Place]:
    """The places at which pieces may be, the most probable first, each named once."""
    found = list[Place]()
    for owner, piece in enumerate(pieces):
        own, total = list[Place](), special.logsumexp(piece.log_weights)
        narrow = _narrow(piece.covariances, near)
        for c in np.argsort(-piece.log_weights, kind="stable").tolist():
            at = piece.places[c]
            if len(own) == PLACES or not narrow[c] or not _is_new(at, own, near):
                continue
            here = narrow & (_distances(at[None], piece.places)[0] < near / 2.0)
            spread = piece.covariances[c][np.ix_(ORDER[:2], ORDER[:2])]
            share = float(piece.log_weights[c] - total)
            own.append(Place(owner, share, at, spread, np.flatnonzero(here)))
        found += own
    kept = list[Place]()
    for place in sorted(found, key=lambda place: -place.share):
        if _is_new(place.at, kept, near):
            kept.append(place)
    return kept


def _is_new(at: FloatArray, places: Sequence[Place], near: float) -> bool:
    return all(np.hypot(*(at - each.at)[:2]) >= near / 2.0 for each in places)


def _groups(pieces: Sequence[Conditioned], places: Sequence[Place], near: float) -> list[list[int]]:
    """The pieces that may take one another's places, directly or through others."""
    of, at = list(range(len(pieces))), _at(places)
    takes = [(_distances(at, each.places) < near / 2.0) @ each.alone > TAKEN for each in pieces]
    close = _distances(at, at) < near
    for i, j in combinations(range(len(pieces)), 2):
        if (np.outer(takes[i], takes[j]) & close).any():
            of = [of[i] if each == of[j] else each for each in of]
    groups = [[k for k in range(len(of)) if of[k] == each] for each in dict.fromkeys(of)]
    return [group for group in groups if len(group) > 1]


class Candidate(NamedTuple):
    """A piece that is at one of some places (m,) or, the last, anywhere else or absent."""

    piece: Conditioned
    prior: FloatArray  # (m + 1,) logarithm of what it weighed before the scan
    resting: FloatArray  # (m,) log-density before the scan, of having been at the place
    arriving: FloatArray  # (m,) the same, of having been elsewhere
    taken: BoolArray  # (c,) components that are at a place after the scan
    none: float  # log-likelihood of its absence

    @staticmethod
    def of(piece: Conditioned, places: Sequence[Place], near: float) -> Candidate:
        """A piece and some places."""
        before, at = piece.mixture, _at(places)
        there = (_distances(at, before.places) < near / 2.0) & _narrow(before.covariances, near)
        anywhere = np.asarray(~there.any(axis=0))
        prior = np.append(there @ before.weights, before.weights @ anywhere)
        after = _distances(at, piece.places) < near / 2.0  # wide ones, too: they explain it as well
        return Candidate(
            piece,
            np.log(np.maximum(prior / prior.sum(), NEVER)),
            _log_density(before, at, np.asarray(~anywhere)),
            _log_density(before, at, anywhere),
            np.asarray(after.any(axis=0)),
            float(piece.log_weights[ABSENT] - np.log(max(before.weights[ABSENT], NEVER))),
        )

    def likelihood(self, place: Place, k: int) -> float:
        """Logarithm of how much likelier the scan is with a piece at its place ``k``."""
        density = np.logaddexp(self.resting[k], self.arriving[k])
        return float(special.logsumexp(self.piece.log_weights[place.seen]) - self.none - density)

    def scores(self, factor: FloatArray, likelihoods: FloatArray) -> FloatArray:
        """(m + 1,) logarithm of its weight after the scan, for a factor (m + 1,) before it."""
        ratio = factor - self.prior
        there = np.logaddexp(ratio[:-1] + self.resting, ratio[-1] + self.arriving) + likelihoods
        left = special.logsumexp(self.piece.log_weights[~self.taken]) - self.none
        return np.asarray(np.maximum(np.append(there, ratio[-1] + left), IMPOSSIBLE))

    def mixture(
        self, seen: Sequence[tuple[Conditioned, IntArray]], marginal: FloatArray
    ) -> FurnitureMixture:
        """Its mixture, at each place as the owner has it, by the probability (m + 1,) of each."""
        own = self.piece
        weights = [marginal[-1] * special.softmax(np.where(self.taken, -np.inf, own.log_weights))]
        parts = [own]
        for (owner, here), share in zip(seen, marginal, strict=False):
            parts.append(owner.only(here))
            weights.append(share * special.softmax(owner.log_weights[here]))
        joined = (np.concatenate(each) for each in zip(*(part[1:] for part in parts), strict=True))
        return Conditioned(own.mixture, *joined).weighed(np.concatenate(weights))


def _together(
    candidates: Mapping[int, Candidate], places: Sequence[Place], near: float
) -> dict[int, FurnitureMixture]:
    """The mixtures of pieces, by number, of which no two are at one place."""
    apart, pieces = _log_apart(places, near), list(candidates.values())
    likelihoods = np.array(
        [candidates[place.owner].likelihood(place, k) for k, place in enumerate(places)]
    )
    priors = [each.prior for each in pieces]
    chosen = _combinations(priors, [each.scores(each.prior, likelihoods) for each in pieces], apart)
    factors = list(priors)
    for _ in range(ROUNDS):
        for i, prior in enumerate(priors):
            factors[i] = factors[i] + prior - _marginal(factors, chosen, apart, i)
    scores = [
        each.scores(factor, likelihoods) for each, factor in zip(pieces, factors, strict=True)
    ]
    seen = [(candidates[place.owner].piece, place.seen) for place in places]
    return {
        number: each.mixture(seen, np.exp(_marginal(scores, chosen, apart, k)))
        for k, (number, each) in enumerate(candidates.items())
    }


def _combinations(
    priors: Sequence[FloatArray], scores: Sequence[FloatArray], apart: FloatArray
) -> IntArray:
    """The places (h, k) of k pieces together that are probable before or after a scan."""
    chosen = np.zeros((1, 0), dtype=np.int64)
    before, after = np.zeros(1), np.zeros(1)
    for prior, score in zip(priors, scores, strict=True):
        count = len(prior)
        excluded = apart[chosen].sum(axis=1)  # (h, m + 1)
        before = (before[:, None] + prior + excluded).ravel()
        after = (after[:, None] + score + excluded).ravel()
        place = np.tile(np.arange(count), len(chosen))
        chosen = np.column_stack([chosen.repeat(count, axis=0), place])
        best = np.maximum(before - before.max(), after - after.max())
        kept = np.sort(np.argsort(-best, kind="stable")[:HYPOTHESES])
        chosen, before, after = chosen[kept], before[kept], after[kept]
    return chosen


def _marginal(
    logs: Sequence[FloatArray], chosen: IntArray, apart: FloatArray, piece: int
) -> FloatArray:
    """(m + 1,) log-probability of each place of one piece, of weights (m + 1,) of each."""
    together = sum(each[chosen[:, i]] for i, each in enumerate(logs))
    for i, j in combinations(range(len(logs)), 2):
        together = together + apart[chosen[:, i], chosen[:, j]]
    total = np.bincount(
        chosen[:, piece], np.exp(together - np.max(together)), minlength=len(logs[piece])
    )
    return np.asarray(np.log(np.maximum(total / total.sum(), NEVER)))


def _log_apart(places: Sequence[Place], near: float) -> FloatArray:
    """(m + 1, m + 1) log-probability that pieces at two places are ``near`` m apart."""
    at, spread = _at(places), np.array([place.spread for place in places])
    off = at[:, None, :2] - at[:, :2]
    distance = np.hypot(off[..., 0], off[..., 1])
    along = off / np.maximum(distance, NEVER)[..., None]
    variance = np.einsum("abi,abij,abj->ab", along, spread[:, None] + spread, along)
    out = np.zeros((len(places) + 1, len(places) + 1))
    out[:-1, :-1] = special.log_ndtr((distance - near) / np.sqrt(np.maximum(variance, NEVER)))
    return np.maximum(out, IMPOSSIBLE)


def _log_density(mixture: FurnitureMixture, at: FloatArray, part: BoolArray) -> FloatArray:
    """(m,) log-density of some components (c,) of a mixture at places (m, 3)."""
    part = part & (np.arange(len(part)) != ABSENT)
    return np.log(np.maximum(mixture.density(at, ANY_STD, part), NEVER))


def _narrow(covariances: FloatArray, near: float) -> BoolArray:
    """Which components (c,) are at one place, for pieces that are ``near`` m apart."""
    x, y, _ = ORDER
    out = covariances[:, x, x] + covariances[:, y, y] < (NARROW * near) ** 2
    out[ABSENT] = False
    return np.asarray(out)


def _at(places: Sequence[Place]) -> FloatArray:
    return np.array([place.at for place in places]).reshape(-1, 3)


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """(m, n) m on the floor between places (m, 2 or 3) and (n, 2 or 3)."""
    off = a[:, None, :2] - b[:, :2]
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))
