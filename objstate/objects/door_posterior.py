"""A door's posterior, filtered under several priors of its closed bearing side by side.

With a wide prior, a box in a doorway can be taken for the closed leaf of a door whose bearing is
far off, and the right components die out. A narrow prior can't follow a door whose bearing really
is off. So both are kept, with the log evidence of each.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import lazy
from objstate.objects.belief import ObjectBelief
from objstate.objects.mixture import DoorMixture, Doorway, States, Statics

if TYPE_CHECKING:
    from objstate.objects.mixture_kernels import Beams, Noise, Shape

ROUNDING = 1e-9  # relative excess of a prior over the one it is derived from, by rounding


@dataclass(frozen=True, eq=False)
class DoorPosterior:
    """p(mode, s, d | z) of one door. A value: updates return new ones."""

    mixtures: tuple[DoorMixture, ...]  # under each prior, the narrowest first

    @staticmethod
    def of(door: Doorway, belief: ObjectBelief, priors: Sequence[Statics]) -> DoorPosterior:
        """The posterior of a belief on a lattice. Only doors that turn have a bearing."""
        chosen = priors if door.turn else priors[-1:]
        return DoorPosterior(tuple(DoorMixture.of(door, belief, prior) for prior in chosen))

    @property
    def door(self) -> Doorway:
        return self.mixtures[0].door

    @property
    def stamp_ns(self) -> int | None:
        """The moment of the posterior; None before the first scan."""
        return self.mixtures[0].stamp_ns

    def later(self, seconds: float, transfer: FloatArray, added: FloatArray) -> DoorPosterior:
        """The prediction over some time; see ``DoorMixture.later``."""
        return DoorPosterior(tuple(each.later(seconds, transfer, added) for each in self.mixtures))

    def at(self, stamp_ns: int) -> DoorPosterior:
        """The same at a moment."""
        return DoorPosterior(tuple(each.at(stamp_ns) for each in self.mixtures))

    def given(self, beams: Beams, noise: Noise, shape: Shape) -> tuple[DoorPosterior, int]:
        """Bayes' rule for a scan, and the largest number of its beams that reach the leaf."""
        after, reached = zip(
            *(each.given(beams, noise, shape) for each in self.mixtures), strict=True
        )
        return DoorPosterior(tuple(after)), max(reached)

    def evidence(self, bearings: FloatArray) -> tuple[FloatArray, IntArray]:
        """(k,) log p(z) with prior variances (k,) rad^2 of the bearing, up to a constant.

        Each mixture that has a prior as wide approximates it, by those components that it kept. The
        best one, whose index (k,) is returned too, misses least.
        """
        own = np.array(
            [each.total + each.log_evidence("bearing", bearings) for each in self.mixtures]
        )
        priors = np.array([each.statics.bearing for each in self.mixtures])
        wide = bearings <= priors[:, None] * (1.0 + ROUNDING)
        wide[-1] = True
        own = np.where(wide, own, -np.inf)
        best = np.argmax(own, axis=0)
        return own[best, np.arange(len(bearings))], best

    def of_bearing(self, variances: FloatArray) -> FloatArray:
        """(k,) log p(z) with prior variances (k,) rad^2 of the bearing, up to a constant."""
        return self.evidence(variances)[0]

    def of_hinge(
        self, variances: FloatArray, bearings: Iterable[tuple[float, float]]
    ) -> FloatArray:
        """(k,) the same for variances (k,) m^2 of the hinge, averaged over ``bearings``."""
        shares = np.zeros(len(self.mixtures))
        probabilities, priors = np.array(list(bearings)).T
        np.add.at(shares, self.among(priors), probabilities)
        likely = [
            math.log(share) + each.log_evidence("hinge", variances)
            for share, each in zip(shares, self.mixtures, strict=True)
            if share > 0.0
        ]
        return np.asarray(np.logaddexp.reduce(likely, axis=0))

    def among(self, bearings: FloatArray) -> IntArray:
        """(k,) the mixtures to use where the bearing has variances (k,) rad^2."""
        if len(self.mixtures) == 1:
            return np.zeros(len(bearings), dtype=np.int64)
        known, asked = self._best, bearings.tolist()
        fresh = [each for each in dict.fromkeys(asked) if each not in known]
        if fresh:
            known.update(zip(fresh, self.evidence(np.array(fresh))[1].tolist(), strict=True))
        return np.array([known[each] for each in asked], dtype=np.int64)

    @lazy
    def _best(self) -> dict[float, int]:
        """The mixture to use for each variance of the bearing, as far as it was asked for."""
        return {}

    def under(self, priors: Sequence[Statics]) -> States:
        """The states given the same readings, under some priors (k,) of the static errors."""
        chosen = self.among(np.array([prior.bearing for prior in priors]))
        out = States(*(np.empty((len(priors), len(self.door.states))) for _ in States._fields))
        for index in np.unique(chosen):
            rows = np.flatnonzero(chosen == index)
            states = self.mixtures[index].under([priors[int(row)] for row in rows])
            for whole, part in zip(out, states, strict=True):
                whole[rows] = part
        return out
