"""The place of a piece of furniture at moments of a log, given the whole log."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.symmetry import Symmetry
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.lazy import Later, altered
from objstate.objects import ObjectBelief
from objstate.objects.furniture_mixture import (
    ABSENT,
    ANY_STD,
    FAR,
    FurnitureMixture,
    Piece,
    of_place,
)
from objstate.objects.mixture import NEVER
from objstate.objects.steps import FurnitureStep
from objstate.records import NANOSECONDS
from objstate.smoothing.doors import moments_of

if TYPE_CHECKING:
    from objstate.objects import components
else:
    components = Later("objstate.objects.components")

MOST = 24  # largest number of components of a smoothed mixture
NUMBERS = 1024  # largest number of components of one moment
LEAST = 1e-4  # weight below which a component is dropped
SAME = np.diag(np.square([0.015, 0.015, np.radians(1.5)]))  # (m, m, rad) of places that are one


class FurnitureHistory(NamedTuple):
    """The stored history of a piece of furniture."""

    belief: ObjectBelief  # the last one
    steps: list[FurnitureStep]


class Places(NamedTuple):
    """A mixture over where an object is; the first of its components is its absence."""

    weights: FloatArray  # (c,) sum to one
    places: FloatArray  # (c, 3) x, y, yaw
    covariances: FloatArray  # (c, 3, 3)
    names: IntArray  # (c,) a number that a component keeps while the object stays there
    stands: FloatArray  # (c, 3) where a component of this name stood last
    spreads: FloatArray  # (c, 3, 3) covariances there


@dataclass(frozen=True, eq=False)
class SmoothedFurniture:
    """p(presence, state | the whole log) of one piece of furniture."""

    beliefs: list[ObjectBelief]  # at the moments
    stamps_ns: IntArray  # (n,)
    mixtures: list[Places]  # (n) at the moments
    stays: list[FloatArray]  # (n - 1) of each component (c,) of k + 1: it was there at k


def smoothed_furniture(history: FurnitureHistory, also_ns: Iterable[int] = ()) -> SmoothedFurniture:
    """The places of an object at the moments of its steps, and at others far from them.

    With a(s) the filtered density, g(s) the next moment's smoothed one, and m(s) the density of the
    place at which a moved object arrives, which doesn't depend on where it was, the transition is
    e^(-mu t) times identity, plus (1 - e^(-mu t)) m. So

        g_k(s) = r(s) g_k+1(s) + a_k(s) (1 - integral r g_k+1),
        r(s) = e^(-mu t) a_k(s) / (e^(-mu t) a_k(s) + (1 - e^(-mu t)) m(s)).

    This is exact, absence included. r is taken constant within each component of g_k+1. The place
    of a piece that stays, as filtered Gaussians have it, differs by ``SAME`` from where it stood
    last, through errors of the model. So r is taken at that place, blurred; and the smoothed
    Gaussian is that of Rauch, Tung and Striebel 1965 with this process noise: where the filter knows
    a place, later ones don't replace it, such as the first of those that a carried piece takes.
    """
    stamps = moments_of(history.steps, sorted(set(also_ns)))
    by_stamp = {step.stamp_ns: step for step in history.steps}
    held, filtered = history.steps[0], list[FurnitureStep]()
    for stamp in stamps:
        held = by_stamp.get(stamp, held)
        filtered.append(held)
    after, stays = _filtered(filtered[-1], len(stamps) - 1), list[FloatArray]()
    mixtures = [after]
    for k in range(len(stamps) - 2, -1, -1):
        seconds = (stamps[k + 1] - stamps[k]) / NANOSECONDS
        stay = _stays(filtered[k], after, seconds)
        after = _joined(history.belief.item.symmetry, after, stay, _filtered(filtered[k], k))
        stays.append(stay)
        mixtures.append(after)
    mixtures, stays = mixtures[::-1], stays[::-1]
    piece = history.steps[0].piece
    beliefs = [
        altered(_published(piece, each, history.belief), stamp_ns=stamp, joint=None, past=None)
        for each, stamp in zip(mixtures, stamps, strict=True)
    ]
    return SmoothedFurniture(beliefs, np.array(stamps, dtype=np.int64), mixtures, stays)


def _filtered(step: FurnitureStep, moment: int) -> Places:
    """The filtered mixture of a step."""
    count = 1 + len(step.table)
    places = np.concatenate([[[FAR, FAR, 0.0]], step.places])
    covariances = np.concatenate([np.eye(3)[None], step.covariances])
    names = np.where(np.arange(count) > 0, moment * NUMBERS + np.arange(count), ABSENT)
    weights = np.concatenate([[step.absent], step.weights])
    return Places(weights, places, covariances, names, places, covariances)


def _stays(step: FurnitureStep, after: Places, seconds: float) -> FloatArray:
    """(c,) probability that the object was in each component of the next moment already."""
    piece, there = step.piece, step.piece.settings.presence
    moved = piece.settings.dynamics.moved(seconds)
    before, arrived = np.empty((2, len(after.weights)))
    before[ABSENT], arrived[ABSENT] = step.absent, 1.0 - there
    own = step.weights, step.places, step.covariances
    before[1:] = _densities(piece, *own, after)
    best = step.places[int(np.argmax(step.weights))] if len(step.table) else piece.item.home
    cells = (piece.cells, piece.nearby(best))
    arrived[1:] = there * sum(
        0.5 * _densities(piece, np.full(len(at), 1.0 / len(at)), at, of_cell[None], after)
        for at, of_cell in cells
    )
    kept = (1.0 - moved) * before
    return np.asarray(kept / np.maximum(kept + moved * arrived, NEVER))


def _densities(
    piece: Piece, weights: FloatArray, places: FloatArray, covariances: FloatArray, at: Places
) -> FloatArray:
    """(c - 1,) densities of a mixture, blurred by ``SAME``, where the object stood last."""
    out, symmetry = np.zeros((len(at.weights) - 1, 1)), piece.item.symmetry
    for j in range(len(out)):
        wide = of_place(covariances + at.spreads[1 + j] + SAME, len(weights))
        place = at.stands[1 + j : 2 + j]
        components.densities(
            place, weights, places, wide, ANY_STD, symmetry.order, symmetry.centre, out[j]
        )
    return out[:, 0]


def _joined(symmetry: Symmetry, after: Places, stays: FloatArray, before: Places) -> Places:
    """The next moment's components as far as the object stayed, and the filtered ones otherwise."""
    stayed = after.weights * stays
    moved = 1.0 - stayed.sum()
    weights = np.concatenate([stayed, moved * before.weights[1:]])
    weights[ABSENT] += moved * before.weights[ABSENT]
    heavy = 1 + np.argsort(-weights[1:], kind="stable")[:MOST]
    kept = np.concatenate([[ABSENT], np.sort(heavy[weights[heavy] > LEAST])])
    places, covariances = after.places.copy(), after.covariances.copy()
    for j in kept[(kept > ABSENT) & (kept < len(stayed))]:
        places[j], covariances[j] = _carried_back(symmetry, places[j], covariances[j], before)
    after = after._replace(places=places, covariances=covariances)
    both = (np.concatenate([a, b[1:]])[kept] for a, b in zip(after[1:], before[1:], strict=True))
    return Places(weights[kept] / weights[kept].sum(), *both)


def _carried_back(
    symmetry: Symmetry, place: FloatArray, covariance: FloatArray, before: Places
) -> tuple[FloatArray, FloatArray]:
    """A Gaussian of the moment before, of an object that stayed, by that of the next moment.

    The filtered component that most probably led to it is the one that it corrects.
    """
    off = _alike(symmetry, place, before.places[1:]) - before.places[1:]
    off[:, 2] = wrap(off[:, 2])
    wide = before.covariances[1:] + SAME
    expected = wide + covariance
    squared = np.einsum("ci,ci->c", off, np.linalg.solve(expected, off[..., None])[..., 0])
    log = np.log(before.weights[1:] + NEVER)
    best = int(np.argmax(log - 0.5 * (squared + np.linalg.slogdet(expected)[1])))
    own = before.covariances[1 + best]
    gain = own @ np.linalg.inv(wide[best])
    state = before.places[1 + best] + gain @ off[best]
    state[2] = wrap(state[2])
    return state, own + gain @ (covariance - wide[best]) @ gain.T


def _alike(symmetry: Symmetry, place: FloatArray, others: FloatArray) -> FloatArray:
    """(c, 3) of the places that look like one (3,), the nearest to each of others (c, 3)."""
    return np.array([symmetry.nearest(place[None], float(yaw))[0] for yaw in others[:, 2]])


def _published(piece: Piece, mixture: Places, belief: ObjectBelief) -> ObjectBelief:
    """A mixture as samples; where the object surely isn't there, those of the last belief."""
    if mixture.weights[1:].sum() <= NEVER:
        return altered(belief, presence=0.0)
    count = len(mixture.weights)
    whole = FurnitureMixture(
        piece,
        mixture.weights,
        mixture.places,
        np.zeros((count, 3)),
        of_place(mixture.covariances, count),
        np.zeros((count, piece.columns)),
    )
    return whole.sampled(belief)
