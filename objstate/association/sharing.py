"""Readings of objects that look alike, shared out by k-means from where they are predicted.

Section IV-B.3 of Elfring et al. 2012: regions that overlap are merged, and their pixels clustered.
As predictions are good first centres, "the clustering converges in one or two iterations only".
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.errors import SettingsError
from objstate.geometry import FloatArray, IntArray

MOST_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Shares:
    """Which reading belongs to which object."""

    labels: IntArray = field(repr=False)  # (n,) 0 to k - 1
    centres: FloatArray  # (k, d); that of an empty cluster is where it began
    counts: IntArray  # (k,) readings; 0: nothing of that object was seen
    rounds: int  # in which a reading changed its cluster, and one more to see that none does


def shared_out(readings: FloatArray, centres: FloatArray, most_rounds: int = MOST_ROUNDS) -> Shares:
    """Lloyd's k-means of readings (n, d) from first centres (k, d).

    Raises SettingsError for readings and centres of unlike coordinates, and for no centres.
    """
    if centres.ndim != 2 or readings.ndim != 2 or centres.shape[1:] != readings.shape[1:]:
        raise SettingsError(
            "Readings (n, d) are shared out to centres (k, d) of the same d, "
            f"not {readings.shape} to {centres.shape}."
        )
    if not len(centres):
        raise SettingsError("Readings can't be shared out to no objects; give a centre of each.")
    centres, labels, rounds = centres.astype(float), np.full(len(readings), -1), 0
    for rounds in range(1, most_rounds + 1):  # noqa: B007
        squared = ((readings[:, None] - centres) ** 2).sum(axis=-1)
        nearest = squared.argmin(axis=1)
        if (nearest == labels).all():
            break
        labels = nearest
        for k in np.unique(labels).tolist():
            centres[k] = readings[labels == k].mean(axis=0)
    return Shares(labels, centres, np.bincount(labels, minlength=len(centres)), rounds)
