"""The update of objects by one scan in marginal inference (section 2.2 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from objstate.config import ObjectUpdateSettings
from objstate.estimator.backdrop import Backdrop
from objstate.estimator.believed import Believed
from objstate.estimator.publishing import Fits
from objstate.estimator.robot import Robot
from objstate.estimator.sight import Near, Sight
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief, ScanEvidence, Update
from objstate.sensing import ScanView


@dataclass(frozen=True, eq=False)
class Observation:
    """The objects' beliefs after a scan."""

    beliefs: Mapping[str, ObjectBelief]
    fits: Mapping[str, float]  # of the objects that a beam reached


class MarginalUpdate:
    """The update of marginals by samples of the robot belief."""

    def __init__(self, settings: ObjectUpdateSettings, believed: Believed) -> None:
        self._settings, self._believed = settings, believed

    def observe(self, near: Near, sight: Sight, robot: Robot) -> Fits:
        """Update the near objects at which beams point; return the share explained for each."""
        s, believed = self._settings, self._believed
        samples, stamp_ns = robot.samples(s.robot_samples), sight.scan.stamp_ns
        view, names = sight.view(near.beams), near.pointed_at
        seen = observe(believed, view, names, samples, stamp_ns, s.tempering, robot.wall_std)
        believed.keep(seen.beliefs.items())
        return {name: seen.fits.get(name) for name in seen.beliefs}


def observe(
    believed: Believed,
    view: ScanView,
    names: Sequence[str],
    robot: PoseBelief,
    stamp_ns: int,
    tempering: float,
    shift_std: float,
) -> Observation:
    """Predict each object's p(s) and update it by the scan, averaged over robot samples.

    The view is of the beams that may touch the objects of these ``names``. ``shift_std`` m is the
    deviation of the building.
    """
    beliefs, fits = {name: believed.at(name, stamp_ns) for name in names}, {}
    backdrop = Backdrop(view, robot.poses, dict(beliefs))
    for name in names:
        without, absent = backdrop.without(name)
        evidence = ScanEvidence(
            name, view, robot.poses, robot.weights, without, absent, tempering, shift_std
        )
        update = believed.filters[name].update(beliefs[name], evidence, believed.rngs[name])
        if update is not None:
            beliefs[name] = update.belief
            fits[name] = _fit(name, update, view, robot, without)
    return Observation(beliefs, fits)


def _fit(
    name: str, update: Update, view: ScanView, robot: PoseBelief, without: FloatArray
) -> float:
    """Share of the beams reaching an object that its most probable state explains.

    Seen from the robot sample that explains the scan best.
    """
    belief = update.belief
    best = int((robot.weights.log + update.log_evidence).argmax())
    states = belief.best[None, :] if belief.presence >= 0.5 else belief.states[:0]
    return view.share_explained(name, states, robot.poses[best], without[best], update.bears)
