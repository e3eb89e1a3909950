"""log p(o | l) of a scan, averaged over the states of the objects in sight."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np

from objstate.config import Settings
from objstate.estimator.believed import Believed
from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.sensing import Around, UncertainObject
from objstate.sensing.circles import evenly_spread

KEPT = 1024  # number of beliefs whose samples are cached
Beliefs = Mapping[str, ObjectBelief]


class Scenery:
    """The likelihood of a scan from robot poses, averaged over the states of objects."""

    def __init__(self, settings: Settings, believed: Believed) -> None:
        self._believed = believed
        self._states = settings.localization.object_states
        self._widest = settings.object_updates.max_position_std
        self._most = settings.localization.max_beams
        self._represented = lru_cache(maxsize=KEPT)(ObjectBelief.represented_by)

    def log_likelihood(
        self, sight: Sight, beams: BoolArray, blur: float, beliefs: Beliefs | None = None
    ) -> FloatArray:
        """log p(o | l) (p,) of some beams (n,) from the samples of a sight's robot belief.

        Ranges are blurred by some m. While the robot's position is known well enough, objects
        before the walls are included, by their present beliefs or by other ``beliefs``.
        """
        robot = sight.robot
        objects = self.objects(sight, beams, beliefs) if self.is_narrow(sight) else []
        return sight.view(beams).pose_log_likelihood(robot.poses, blur, objects)

    def log_likelihood_of_mean(
        self, sight: Sight, beams: BoolArray, blur: float, beliefs: Beliefs
    ) -> float:
        """The same from the mean of the robot belief, for which the walls are known."""
        objects = self.objects(sight, beams, beliefs) if self.is_narrow(sight) else []
        mean, walls = sight.robot.mean[None], sight.walls[None, beams]
        return float(sight.view(beams).pose_log_likelihood(mean, blur, objects, walls)[0])

    def objects(
        self,
        sight: Sight,
        beams: BoolArray,
        beliefs: Beliefs | None = None,
    ) -> list[UncertainObject]:
        """The objects that some beams (n,) may meet, with their states; see ``Sight.seen_by``."""
        return self.represented(sight.seen_by(beams), beliefs)

    def represented(
        self, names: Iterable[str], beliefs: Beliefs | None = None
    ) -> list[UncertainObject]:
        """Some objects in states of their present beliefs, or of other ``beliefs``."""
        known = self._believed.marginals if beliefs is None else beliefs
        return [self._represented(known[name], self._states) for name in names]

    @lazy
    def around(self) -> Around:
        """All objects, each in states of its prior."""
        priors, surroundings = self._believed.priors, self._believed.surroundings
        objects = tuple(priors[name].represented_by(self._states) for name in surroundings.names)
        return Around(objects, surroundings.all_circles)

    def is_narrow(self, sight: Sight) -> bool:
        """Whether the robot's position is known well enough to include objects."""
        return sight.robot.position_std <= self._widest

    def thinned(self, beams: BoolArray) -> BoolArray:
        """The beams (n,) that localize: as many as allowed, evenly spread."""
        return np.asarray(evenly_spread(beams, self._most))
