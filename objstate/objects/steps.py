"""The stored posteriors of each object after scans, for smoothing.

A step holds the components of mixtures that have weight, 108 bytes each of a door and 40 of
furniture. Between steps at most a second apart, those that are like their neighbours are left out.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later, altered
from objstate.objects.belief import ObjectBelief
from objstate.objects.furniture_mixture import ABSENT, ORDER, FurnitureMixture, Piece
from objstate.objects.mixture import NEVER, PACES, DoorMixture, Doorway, Statics

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
    from objstate.objects import step_kernels
    from objstate.objects.step_kernels import Table
else:
    kernels = Later("objstate.objects.mixture_kernels")
    step_kernels = Later("objstate.objects.step_kernels")

LEAST = 1e-6  # weight below which a component isn't stored
LEAST_THERE = 1e-4  # the same of furniture, in shares of its presence
GAP_NS = 1_000_000_000  # ns; largest gap left by removing steps that are alike
HEAVY = 0.01  # weight from which a component is compared
ALIKE = 0.01  # difference of weights up to which two steps are alike
ALIKE_STDS = 0.1  # difference of the state and of its deviation, in deviations, likewise

VARIANCES = [4, 7, 9]  # of x, y, yaw, columns of furniture's table


class DoorStep(NamedTuple):
    """A door's posterior after a scan."""

    stamp_ns: int
    door: Doorway
    statics: Statics  # the prior variances of its static errors
    paces: FloatArray  # (k,) probabilities of ``PACES``
    table: Table  # (r, 27): component, weights at rest and moving, means, covariances

    @property
    def blank(self) -> DoorMixture:
        """The mixture before any scan."""
        return DoorMixture.unknown(self.door, self.statics)

    def posterior(self, blank: DoorMixture) -> DoorMixture:
        """The posterior without the robot's errors; ``blank`` is the mixture before any scan."""
        index = self.table[:, step_kernels.INDEX].astype(int)
        first = step_kernels.WEIGHTS + 2 * len(PACES)  # column of the means
        means, covariances = blank.means.copy(), blank.covariances.copy()
        by_pace = np.zeros_like(blank.by_pace)
        weights = self.table[:, step_kernels.WEIGHTS : first].T.astype(float)
        weights = weights.reshape(2, len(PACES), -1)
        by_pace[:, :, index] = weights / weights.sum(axis=(0, 2), keepdims=True)
        errors, rows, columns = _errors()
        past = first + len(errors)
        means[index[:, None], errors] = self.table[:, first:past]
        covariances[index[:, None], errors[rows], errors[columns]] = self.table[:, past:]
        covariances[index[:, None], errors[columns], errors[rows]] = self.table[:, past:]
        return altered(
            blank,
            by_pace=by_pace,
            paces=self.paces,
            means=means,
            covariances=covariances,
            stamp_ns=self.stamp_ns,
        )


class FurnitureStep(NamedTuple):
    """The posterior of a piece of furniture after a scan."""

    stamp_ns: int
    piece: Piece
    absent: float  # probability of absence
    table: Table  # (r, 10) given presence: weight, x, y, yaw, and their covariance

    @property
    def weights(self) -> FloatArray:
        """(r,) of components in which it is there."""
        weights = self.table[:, 0].astype(float)
        return np.asarray(weights * (1.0 - self.absent) / max(weights.sum(), NEVER))

    @property
    def places(self) -> FloatArray:
        """(r, 3) x, y, yaw."""
        return self.table[:, 1:4].astype(float)

    @property
    def covariances(self) -> FloatArray:
        """(r, 3, 3) of x, y, yaw."""
        rows, columns = np.triu_indices(3)
        out = np.empty((len(self.table), 3, 3))
        out[:, rows, columns] = out[:, columns, rows] = self.table[:, 4:]
        return out


Step = DoorStep | FurnitureStep


class Past(NamedTuple):
    """A step and those before it. Restoring an earlier belief restores its past."""

    step: Step
    before: Past | None
    is_like: bool  # whether the posterior is nearly that of the step before

    @property
    def steps(self) -> list[Step]:
        """All of them, the earliest first."""
        out, past = list[Step](), self
        while True:
            out.append(past.step)
            if past.before is None:
                return out[::-1]
            past = past.before


def remembered(belief: ObjectBelief) -> ObjectBelief:
    """The belief with its own step added to its past.

    A past begins with the first mixture. Later beliefs on a lattice, or of samples, are steps, too.
    """
    posterior, past = belief.joint, belief.past
    if posterior is None and past is not None:
        posterior = _again(belief, past.step)
    if posterior is None:
        return belief
    return altered(belief, past=_appended(past, step_of(posterior)))


def _again(belief: ObjectBelief, step: Step) -> DoorMixture | FurnitureMixture:
    """A belief without a mixture, converted to one of the earlier kind."""
    if isinstance(step, FurnitureStep):
        return FurnitureMixture.of(step.piece, belief)
    return _on_cells(belief, step)


def _on_cells(belief: ObjectBelief, step: DoorStep) -> DoorMixture:
    """A door's belief on a lattice as a mixture with the mean and variance of each cell."""
    door, weights, states = step.door, belief.weights.values, belief.states[:, 0]
    mixture = DoorMixture.of(door, belief, step.statics)
    where = np.floor((states - door.item.lower) / door.cell).astype(int).clip(0, door.cells - 1)
    total = np.bincount(where, weights, door.cells)
    known = np.flatnonzero(total > LEAST)
    means, covariances = mixture.means.copy(), mixture.covariances.copy()
    off = states - door.states[where]
    first = np.bincount(where, weights * off, door.cells)[known]
    means[known, kernels.STATE] = first / total[known]
    squares = np.bincount(where, weights * off**2, door.cells)[known] / total[known]
    variances = squares - means[known, kernels.STATE] ** 2 + belief.cell[0] ** 2 / 12.0
    covariances[known, kernels.STATE, kernels.STATE] = variances
    covariances[:, kernels.ZERO, kernels.ZERO] = 0.0  # included in the lattice's states
    return altered(mixture, means=means, covariances=covariances)


def step_of(posterior: DoorMixture | FurnitureMixture) -> Step:
    """The stored form of a posterior after a scan."""
    if isinstance(posterior, FurnitureMixture):
        return _furniture_step(posterior)
    assert posterior.stamp_ns is not None
    return DoorStep(
        posterior.stamp_ns,
        posterior.door,
        posterior.statics,
        posterior.posterior_paces,
        _table(posterior),
    )


def _furniture_step(mixture: FurnitureMixture) -> FurnitureStep:
    assert mixture.stamp_ns is not None
    there = 1 + np.flatnonzero(mixture.weights[1:] > LEAST_THERE * mixture.presence)
    rows, columns = np.triu_indices(3)
    order = np.array(ORDER)
    covariances = mixture.covariances[there]
    covariances[:, ORDER, ORDER] += mixture.about.static
    parts = (
        mixture.weights[there, None],
        mixture.places[there],
        covariances[:, order[rows], order[columns]],
    )
    table = np.concatenate(parts, axis=1, dtype=np.float32)
    return FurnitureStep(mixture.stamp_ns, mixture.piece, float(mixture.weights[ABSENT]), table)


def _table(mixture: DoorMixture) -> Table:
    """The stored form of a door's components."""
    errors, rows, _ = _errors()
    width = step_kernels.WEIGHTS + 2 * len(PACES) + len(errors) + len(rows)
    out = np.empty((len(mixture.door.states), width), dtype=np.float32)
    gaussians = mixture.means, mixture.covariances
    count = step_kernels.store(mixture.weights, mixture.by_pace, *gaussians, LEAST, out)
    return out[:count].copy()


def _appended(past: Past | None, step: Step) -> Past:
    """The past with a step added; the step before is dropped if it is like its neighbours."""
    if past is None:
        return Past(step, None, False)
    if past.before is not None and past.is_like:
        kept = past.before.step
        if step.stamp_ns - kept.stamp_ns <= GAP_NS and _alike(kept, step):
            return Past(step, past.before, True)
    return Past(step, past, _alike(past.step, step))


def _alike(one: Step, other: Step) -> bool:
    """Whether an object has nearly the same posterior in two steps."""
    if isinstance(one, FurnitureStep) or isinstance(other, FurnitureStep):
        return (
            isinstance(one, FurnitureStep)
            and isinstance(other, FurnitureStep)
            and _stands(one, other)
        )
    return _rests(one, other)


def _stands(one: FurnitureStep, other: FurnitureStep) -> bool:
    """Whether a piece of furniture has nearly the same place, given presence."""
    if len(one.table) == 0 or len(other.table) == 0:
        return len(one.table) == len(other.table) and abs(one.absent - other.absent) < ALIKE
    a, b = (step.table[int(np.argmax(step.table[:, 0]))] for step in (one, other))
    stds, others = np.sqrt(a[VARIANCES]), np.sqrt(b[VARIANCES])
    off = np.maximum(np.abs(a[1:4] - b[1:4]), np.abs(stds - others))
    is_near = bool((off <= ALIKE_STDS * np.minimum(stds, others)).all())
    return is_near and abs(a[0] - b[0]) < ALIKE and abs(one.absent - other.absent) < ALIKE


def _rests(one: DoorStep, other: DoorStep) -> bool:
    """Whether the components of a door with weight are nearly the same."""
    tables = one.table, one.paces, other.table, other.paces
    return bool(step_kernels.are_alike(*tables, HEAVY, ALIKE, ALIKE_STDS))


@cache
def _errors() -> tuple[IntArray, IntArray, IntArray]:
    """The stored errors of a component, and the rows and columns of their covariance."""
    errors = np.array(step_kernels.STORED)
    return (errors, *np.triu_indices(len(errors)))
