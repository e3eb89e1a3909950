"""p(s_i, d_i | o_k) of doors and furniture, given the Gaussian of the robot's pose."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.estimator.believed import Believed
from objstate.estimator.doors import Doors
from objstate.estimator.exposure import Exposures, Others, Seen
from objstate.estimator.furniture import Furniture
from objstate.estimator.publishing import Fits, share_explained
from objstate.estimator.robot import Robot
from objstate.estimator.scenery import Scenery
from objstate.estimator.sight import Sight
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.objects.steps import DoorStep, FurnitureStep, Step
from objstate.records import Scan
from objstate.sensing import Sensing
from objstate.smoothing import DoorHistory, FurnitureHistory, History


class JointModel(Protocol):
    """How scans update the joint posteriors of one kind of objects."""

    def __contains__(self, name: str) -> bool:
        """Whether an object is of this kind."""

    def observe(
        self, names: Sequence[str], believed: Believed, exposures: Exposures
    ) -> dict[str, Seen]:
        """Beliefs after a scan, of those named objects that some beam may meet."""


class JointUpdate:
    """The update of joint posteriors, and what is learnt over all objects."""

    def __init__(
        self,
        building: Building,
        settings: Settings,
        sensing: Sensing,
        believed: Believed,
        scenery: Scenery,
    ) -> None:
        self._sensing, self._believed, self._scenery = sensing, believed, scenery
        self._is_wanted = settings.object_updates.inference == "joint"
        self._doors = Doors(building, settings, sensing)
        furniture = Furniture(building, settings, sensing)
        self._models: tuple[JointModel, ...] = (self._doors, furniture)

    def is_linear(self, scan: Scan) -> bool:
        """Whether objects are inferred jointly with the errors of robot and hinges, by outlines."""
        return self._is_wanted and self._sensing.is_level(scan)

    def known(self, names: Iterable[str], sight: Sight) -> dict[str, FloatArray]:
        """Expected ranges (n,) m of each object whose state is certain."""
        out = {}
        for name in names:
            belief = self._believed.marginals[name]
            if belief.is_certain:
                ranges = np.full(len(sight.scan), np.inf)
                alone = sight.whole.object(name, belief.mean[None], sight.robot.mean[None])
                ranges[sight.valid] = alone[0, 0]
                out[name] = ranges
        return out

    def observe(
        self, names: Sequence[str], sight: Sight, robot: Robot, known: Mapping[str, FloatArray]
    ) -> Fits:
        """Update the named objects, at which beams point; return the share explained for each.

        Objects whose state is certain are expected at ranges ``known`` (n,) m, others in states of
        their beliefs.
        """
        fits = Fits()
        if not names:
            return fits
        vantage = robot.vantage(sight.scan)
        surfaces = self._sensing.surfaces(sight.height)
        rows = [k for k, name in enumerate(sight.names) if name not in known]
        uncertain = [sight.names[k] for k in rows]
        represented = self._scenery.represented(uncertain)
        scenery = self._sensing.scenery(represented, sight.height)
        others = Others(uncertain, scenery, sight.entries[rows])
        walls = robot.walls(sight.height, len(surfaces.pieces))
        exposures = Exposures(sight, vantage, surfaces, known, others, walls, robot.carried)
        for model in self._models:
            pointed_at = [name for name in names if name in model]
            for name, seen in model.observe(pointed_at, self._believed, exposures).items():
                fits[name] = self._keep(seen)
        return fits

    def _keep(self, seen: Seen) -> float | None:
        """Keep a belief after a scan; return the share explained where beams reached the object."""
        belief, exposure = seen.belief, seen.exposure
        if seen.is_observed:
            belief = altered(belief, last_observed_ns=exposure.scan.stamp_ns)
        self._believed.keep([(exposure.name, belief)])
        return share_explained(belief, exposure, seen.beams) if seen.is_observed else None

    @property
    def hung_elsewhere(self) -> dict[str, FloatArray]:
        """Offsets (2,) m of hinges that are significantly off the model, by door."""
        beliefs = self._believed.marginals
        off = {
            name: self._doors.elsewhere(beliefs[name]) for name in beliefs if name in self._doors
        }
        return {name: each for name, each in off.items() if each is not None}

    @property
    def histories(self) -> dict[str, History]:
        """The history of each object that was seen and whose steps were kept."""
        return {
            name: self._history(belief, belief.past.steps)
            for name, belief in self._believed.marginals.items()
            if belief.past is not None
        }

    def _history(self, belief: ObjectBelief, steps: Sequence[Step]) -> History:
        of_door = [step for step in steps if isinstance(step, DoorStep)]
        if of_door:
            door = of_door[-1].door
            cases, paces = self._doors.cases(door), self._doors.paces(belief)
            return DoorHistory(belief, of_door, cases, paces)
        return FurnitureHistory(belief, [step for step in steps if isinstance(step, FurnitureStep)])
