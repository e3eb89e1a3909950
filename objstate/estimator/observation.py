"""What one scan says about the objects near the robot, and by them about the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from objstate.estimator.backdrop import Backdrop
from objstate.estimator.believed import Believed
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.localization import PoseBelief
from objstate.objects import ConditionalBelief, ObjectBelief, ScanEvidence, Update
from objstate.sensing import ScanView


@dataclass(frozen=True, eq=False)
class Observation:
    """The objects' beliefs given each robot sample after a scan, and the samples' evidence."""

    beliefs: Mapping[str, ConditionalBelief]
    predicted: Mapping[str, ObjectBelief]  # before it
    unmoved: Mapping[str, ObjectBelief]  # likewise, if nobody has moved them since the scan before
    fits: Mapping[str, float]  # of the objects on which a beam bore
    log_evidence: FloatArray  # (l,) log p(o | l) of the beams towards objects, not tempered

    def settled_by(self, robot: PoseBelief) -> Observation:
        """The same objects, their marginals by what the robot samples weigh after the scan."""
        weights = robot.weights.values
        beliefs = {
            name: each.settled(self.unmoved[name], weights) for name, each in self.beliefs.items()
        }
        return altered(self, beliefs=beliefs)


def observe(
    believed: Believed,
    view: ScanView,
    names: Sequence[str],
    robot: PoseBelief,
    stamp_ns: int,
    tempering: float,
    shift_std: float,
    scenery: Sequence[str] = (),
) -> Observation:
    """Predict each object's p(s | l) and integrate the scan into it, for each robot sample l.

    The view is of the beams that may touch the objects of these ``names``. ``shift_std`` m is how
    far the building is off. Objects of the ``scenery`` stand where they are believed to.
    """
    given = {name: believed.given(name, len(robot.weights), stamp_ns) for name in names}
    beliefs = {name: each.belief for name, each in given.items()}
    unmoved = {name: believed.unmoved(name, stamp_ns) for name in names}
    around = {name: believed.marginals[name] for name in scenery}
    backdrop = Backdrop(view, robot.poses, beliefs | around)
    log_evidence, fits = np.zeros(len(robot.weights)), {}
    for name in names:
        without, absent = backdrop.without(name)
        evidence = ScanEvidence(
            name, view, robot.poses, robot.weights, without, absent, tempering, shift_std
        )
        update = believed.filters[name].update(given[name], evidence, believed.rngs[name])
        if update is None:
            continue
        log_evidence += update.log_evidence / tempering + absent
        given[name] = update.conditional
        fits[name] = _fit(name, update, view, robot, without)
    if len(fits) != 1:  # each has counted the backdrop, which counts once
        log_evidence -= (len(fits) - 1) * backdrop.log_likelihood
    return Observation(given, beliefs, unmoved, fits, log_evidence)


def _fit(
    name: str,
    update: Update,
    view: ScanView,
    robot: PoseBelief,
    without: FloatArray,
) -> float:
    """Share of the beams that bear on an object which its best state explains.

    Seen from the robot sample that explains the scan best.
    """
    belief = update.conditional.belief
    best = int((robot.weights.log + update.log_evidence).argmax())
    states = belief.best[None, :] if belief.presence >= 0.5 else belief.states[:0]
    return view.share_explained(name, states, robot.poses[best], without[best], update.bears)
