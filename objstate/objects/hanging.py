"""Where a door hangs whose hinge may be decimetres off its place in the model.

A door's state is an angle about its hinge. Where the hinge itself is off, the angle that
fits best is a wrong one, and may fit well. So hinges at offsets d are held against the same
looks, each with its own p(s | d) on the lattice: Rao-Blackwellized, as robot samples are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.config import HingeSettings
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects.belief import ObjectBelief
from objstate.objects.conditional import ConditionalBelief
from objstate.objects.doors import LatticeFilter
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights
from objstate.records import NANOSECONDS
from objstate.sensing import ScanView

HEXAGON = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])  # steps of a grid: six neighbours as near
FINER = 4.0  # by which places about the best are denser, on a grid as much smaller


@dataclass(frozen=True, eq=False)
class Look:
    """What the beams that may touch a door read from one place."""

    stamp_ns: int
    view: ScanView  # of n beams
    pose: FloatArray  # (3,) of the robot
    background: FloatArray  # (n,) m, expected ranges of everything else
    shift_std: float  # m by which robot and walls may be off


@dataclass(frozen=True, eq=False)
class Hanging:
    """p(s, d | o): where a door's hinge may be, and the door's state given each place."""

    offsets: FloatArray  # (m, 2) m from its place in the model; the first is none
    weights: Weights  # (m,)
    given: ConditionalBelief  # p(s | d), a row for each offset

    @property
    def elsewhere(self) -> float:
        """Probability that it isn't where the model has it."""
        return float(self.weights.values[1:].sum())

    @property
    def offset(self) -> FloatArray:
        """(2,) m, on average, of a hinge that is elsewhere."""
        return np.asarray(self.weights.values[1:] @ self.offsets[1:] / self.elsewhere)

    @property
    def covariance(self) -> FloatArray:
        """(2, 2) m^2 of that offset."""
        off = self.offsets[1:] - self.offset
        return np.asarray((self.weights.values[1:, None] * off).T @ off / self.elsewhere)

    @property
    def belief_in_place(self) -> ObjectBelief:
        """p(s) of a door that hangs where the model has it."""
        alone = np.zeros(len(self.offsets))
        alone[0] = 1.0
        return self.given.averaged(self.given.given, alone).belief

    @property
    def belief(self) -> ObjectBelief:
        """p(s), averaged over where the hinge may be."""
        return self.given.averaged(self.given.given, self.weights.values).belief


def find_hinge(
    door: LatticeFilter, looks: Sequence[Look], settings: HingeSettings, sharper: float = 1.0
) -> Hanging:
    """Where the hinge of a door as the model has it is, by looks in the order of their stamps.

    They tell by a factor ``sharper`` more than the settings have it. Places all about are tried first; then, on a
    finer grid, those about the best.
    """
    tempering = min(sharper * settings.tempering, 1.0)
    spacing, fine = settings.spacing_m, settings.spacing_m / FINER
    around = _hexagons(settings.most_m, spacing, np.zeros(2))
    first = _held_against(door, looks, around, settings, spacing, tempering)
    best = first.offsets[int(np.argmax(first.weights.log))]
    return _held_against(door, looks, _hexagons(spacing, fine, best), settings, fine, tempering)


def _held_against(
    door: LatticeFilter,
    looks: Sequence[Look],
    places: FloatArray,
    settings: HingeSettings,
    spacing: float,
    tempering: float,
) -> Hanging:
    """Hold hinges in the model's place and in others (m, 2) so far apart against looks.

    A leaf that hangs aside looks as it does from a robot that stands aside the other way.
    """
    offsets = np.concatenate([np.zeros((1, 2)), places[np.hypot(*places.T) > spacing / 2.0]])
    weights, count = _prior(offsets, settings, spacing), len(offsets)
    aside = np.column_stack([offsets, np.zeros(count)])
    rng = np.random.default_rng(0)  # a lattice draws nothing
    given = ConditionalBelief.independent(door.prior(rng), count)
    stamp_ns = looks[0].stamp_ns
    for look in looks:
        seconds, stamp_ns = (look.stamp_ns - stamp_ns) / NANOSECONDS, look.stamp_ns
        if seconds > 0.0:
            given = door.predict_each(given, seconds, rng)
        evidence = ScanEvidence(
            name=door.item.name,
            view=look.view,
            poses=look.pose - aside,
            robot_weights=weights,
            background=np.tile(look.background, (count, 1)),
            log_absent=np.zeros(count),
            tempering=tempering,
            shift_std=float(np.hypot(look.shift_std, spacing / np.sqrt(12.0))),
        )
        update = door.update(given, evidence, rng)
        if update is not None:
            given = update.conditional
            weights, _ = weights.reweight(update.log_evidence)
    belief = altered(given.belief, stamp_ns=stamp_ns, last_observed_ns=stamp_ns)
    return Hanging(offsets, weights, altered(given, belief=belief))


def _prior(offsets: FloatArray, settings: HingeSettings, spacing: float) -> Weights:
    """Of offsets (m, 2), each with its cell of a grid; the first is the model's own place."""
    cell, variance = np.sqrt(0.75) * spacing**2, settings.std_m**2
    density = np.exp(-0.5 * (offsets**2).sum(axis=1) / variance) / (2.0 * np.pi * variance)
    shares = (1.0 - settings.in_place) * cell * density
    shares[0] = settings.in_place
    return Weights.of(shares)


def _hexagons(radius: float, spacing: float, about: FloatArray) -> FloatArray:
    """Places (m, 2) on a hexagonal grid about one (2,), all within a radius of it, m."""
    reach = np.arange(-np.ceil(1.2 * radius / spacing), np.ceil(1.2 * radius / spacing) + 1.0)
    steps = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    places = spacing * steps @ HEXAGON
    return np.asarray(about + places[np.hypot(*places.T) <= (1.0 + 1e-9) * radius])
