"""p(s | l): what is believed of an object given each sample of the robot belief.

Where the robot belief and the objects' beliefs are kept as marginals, a robot
sample that was right about a door is forgotten as such. Here each keeps what it
has seen (Rao-Blackwellized particle filtering; of doors, Avots et al. 2002). All
robot samples share the states and differ in the weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Kind
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later
from objstate.objects.belief import ObjectBelief

if TYPE_CHECKING:
    from objstate.objects import kernels
else:
    kernels = Later("objstate.objects.kernels")


@dataclass(frozen=True, eq=False)
class Descent:
    """How the robot samples of a scan come from those of an earlier one."""

    forgotten: float = 0.0  # share of what each knows by itself that it gives up for the marginal
    ancestors: IntArray | None = None  # (l',) among the earlier samples; None: they are the same

    def then(self, later: Descent) -> Descent:
        """The descent from there to where a ``later`` one ends."""
        mine, theirs = self.ancestors, later.ancestors
        both = mine if theirs is None else theirs if mine is None else mine[theirs]
        return Descent(1.0 - (1.0 - self.forgotten) * (1.0 - later.forgotten), both)

    def of(self, count: int) -> IntArray:
        """The ancestors (l',) among ``count`` samples."""
        return np.arange(count) if self.ancestors is None else self.ancestors


SAME = Descent()  # of samples that are those of before


@dataclass(frozen=True, eq=False)
class ConditionalBelief:
    """An object's belief given each of l robot samples, over n states that they share."""

    belief: ObjectBelief  # p(s), when the robot samples are averaged over
    given: FloatArray  # (l, n) p(s | l) of an object that is there; each row sums to one
    presence: FloatArray  # (l,) p(there | l)
    inherited: FloatArray  # (d,) or (1,) of ``belief.shared``, what no longer shows in ``given``

    @staticmethod
    def independent(belief: ObjectBelief, count: int) -> ConditionalBelief:
        """Of an object that comes into view: each of ``count`` robot samples believes the same."""
        rows = np.tile(belief.weights.values, (count, 1))
        return ConditionalBelief(belief, rows, np.full(count, belief.presence), belief.shared)

    def averaged(self, given: FloatArray, robot_weights: FloatArray) -> ConditionalBelief:
        """With new conditional weights (l, n), the marginal by the robot weights (l,), which sum to one."""
        gone = float(robot_weights @ (1.0 - self.presence))  # exactly 0 where nobody doubts it
        belief = self.belief.mixture(given, robot_weights * self.presence, 1.0 - gone)
        return ConditionalBelief(belief, given, self.presence, self.inherited)

    def apportioned(self, before: ObjectBelief, robot_weights: FloatArray) -> ConditionalBelief:
        """With what a scan left, and made, of the variance that errors of the robot cause.

        What robot samples of weights (l,) disagree about is what their errors cause now. Of what earlier ones
        caused, (v / v0)^2 is left by a scan that takes the variance v0 of the belief ``before``
        it to v: the mean keeps v / v0 of its error. That the object may have been moved since the scan before isn't
        meant: where it wasn't, the error is the same.
        """
        off, inherited = self.belief.deviations, np.empty(len(self.belief.std))
        shared = np.empty(len(inherited))
        kernels.apportion(
            self.given,
            robot_weights * self.presence,
            off,
            self.belief.std,
            before.std,
            self.inherited,
            inherited,
            shared,
        )
        belief = self.belief.with_shared(shared)
        return ConditionalBelief(belief, self.given, self.presence, inherited)

    def handed_on(self, descent: Descent) -> ConditionalBelief:
        """Each robot sample (l',) believes what its ancestor did, but for what it forgets."""
        share, ancestors = descent.forgotten, descent.of(len(self.presence))
        presence = (1.0 - share) * self.presence + share * self.belief.presence
        given = kernels.handed_on(self.given, self.belief.weights.values, share, ancestors)
        return ConditionalBelief(self.belief, given, presence[ancestors], self.hidden_by(share))

    def hidden_by(self, share: float) -> FloatArray:
        """(d,) of ``belief.shared``, what no longer shows when a share of each row is given up."""
        shown = (1.0 - share) ** 2 * (self.belief.shared - self.inherited)
        return np.asarray(self.belief.shared - shown)

    def settled(self, before: ObjectBelief, robot_weights: FloatArray) -> ConditionalBelief:
        """``averaged`` and ``apportioned``, by what robot samples weigh after a scan; for doors one compiled step."""
        if self.belief.item.kind is Kind.PLANAR:
            return self.averaged(self.given, robot_weights).apportioned(before, robot_weights)
        belief, weights = self.belief, np.empty(len(self.belief.states))
        was, inherited = float(before.std[0]), float(self.inherited[0])
        mean, std, shared, left = kernels.settle(
            self.given, robot_weights, *belief.lattice, was, inherited, weights
        )
        belief = belief.on_lattice(weights, mean, std, shared=np.array([shared]))
        return ConditionalBelief(belief, self.given, self.presence, np.array([left]))


@dataclass(frozen=True, eq=False)
class Update:
    """An object's belief after a scan, and what the scan says of the robot samples."""

    conditional: ConditionalBelief
    log_evidence: FloatArray  # (l,) log p(o | l), against the object's absence; tempered
    bears: BoolArray  # (n,) the beams that bear on the object
