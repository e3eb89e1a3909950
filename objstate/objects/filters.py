"""The filters behind the objects' beliefs: a prior, a prediction and an update each."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings, ObjectSettings, Settings
from objstate.objects.belief import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.objects.evidence import ScanEvidence, Update
from objstate.objects.furniture import SampleFilter


class ObjectFilter(Protocol):
    """The estimation of one object's state, as functions of a belief."""

    @property
    def item(self) -> MovableObject:
        """What is estimated."""

    @property
    def settings(self) -> ObjectSettings:
        """By which it is estimated."""

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        """p(s) before any reading."""

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """Eq. (5): the belief ``seconds`` later, by the dynamics p(s | t, s')."""

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Bayes' rule, eqs. (8) and (9); None where no beam reaches the object."""


def filter_for(item: MovableObject, settings: Settings) -> ObjectFilter:
    """The filter of an object, with the settings whose rules match its name."""
    is_door = item.kind is not Kind.PLANAR
    chosen: ObjectSettings = settings.for_object(item.name, "door" if is_door else "furniture")
    if isinstance(chosen, DoorSettings):
        return LatticeFilter(item, chosen)
    return SampleFilter(item, chosen)
