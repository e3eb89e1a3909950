"""The filters behind the objects' beliefs: a prior, a prediction and an update each."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings, ObjectSettings, Settings
from objstate.geometry import FloatArray
from objstate.objects.belief import ObjectBelief
from objstate.objects.conditional import SAME, ConditionalBelief, Descent, Update
from objstate.objects.doors import LatticeFilter
from objstate.objects.evidence import ScanEvidence
from objstate.objects.furniture import SampleFilter


class ObjectFilter(Protocol):
    """The estimation of one object's state, as functions of a belief."""

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        """p(s) before any reading."""

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """Eq. (5): the belief ``seconds`` later, by the dynamics p(s | t, s')."""

    def drift_variance(self, seconds: float) -> FloatArray:
        """(d,) the variance that drift alone adds meanwhile, while nobody moves the object."""

    def predict_each(
        self,
        believed: ConditionalBelief,
        seconds: float,
        rng: np.random.Generator,
        descent: Descent = SAME,
        drift: float = 1.0,
    ) -> ConditionalBelief:
        """The same given each robot sample, which descends from one of those before.

        The variance that drift adds counts by a factor.
        """

    def update(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Bayes' rule for each robot sample; None where no beam bears on the object."""

    def widened(self, belief: ObjectBelief, factor: float, std_m: float) -> ObjectBelief:
        """The belief, its variance changed by a factor, of somebody who knows the building is off.

        ``std_m`` m is by how much. Where several states compete, the factor is left out.
        """


def filter_for(item: MovableObject, settings: Settings) -> ObjectFilter:
    """The filter of an object, with the settings whose rules match its name."""
    is_door = item.kind is not Kind.PLANAR
    chosen: ObjectSettings = settings.for_object(item.name, "door" if is_door else "furniture")
    if isinstance(chosen, DoorSettings):
        return LatticeFilter(item, chosen)
    return SampleFilter(item, chosen)
