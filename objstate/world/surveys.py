"""What drives told of walls and lasers, as a world keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from objstate.calibration import Survey
from objstate.geometry import FloatArray
from objstate.packing import pack, unpack

MOST = 20  # drives of which a world keeps this: in 200 m of corridor, each may take 15 MB
SAME_M = 1e-6  # elements of mountings that differ by less are the same
DIGITS = 4  # of a mounting's elements, in m, by which other lasers are told apart


@dataclass(frozen=True, eq=False)
class KeptSurvey:
    """One drive's survey, beside the world's building and its log's own mountings."""

    survey: Survey
    mounts: Mapping[str, FloatArray]  # (4, 4) in base_link, of its lasers by frame

    def packed(self) -> bytes:
        """As bytes, in single precision."""
        survey = self.survey
        words = {"lasers": survey.lasers, "spread": survey.spread, "height": survey.height}
        upper = survey.information[np.triu_indices(len(survey.pull))]
        mounts = [self.mounts[frame] for frame in survey.lasers]
        return pack(
            words,
            {
                "columns": survey.columns.astype("<i4"),
                "information": upper.astype("<f4"),
                "pull": survey.pull.astype("<f4"),
                "mounts": np.array(mounts, dtype="<f8"),
            },
        )

    @staticmethod
    def unpacked(content: bytes) -> KeptSurvey:
        """What was packed. Raises WorldError for damage."""
        words, arrays = unpack(content, "What is known of walls")
        lasers = tuple(words["lasers"])
        survey = Survey.of_upper(
            lasers,
            arrays["columns"].astype(np.int64),
            arrays["information"].astype(float),
            arrays["pull"].astype(float),
            words["spread"],
            words["height"],
        )
        return KeptSurvey(survey, dict(zip(lasers, arrays["mounts"], strict=True)))

    def beside(self, mounts: Mapping[str, FloatArray]) -> Survey:
        """The survey, its lasers named as another log has them where they are mounted as there.

        Any other laser is another one: of another robot, or one that was mounted anew.
        """
        lasers = [
            frame if frame in mounts and is_same(mounts[frame], own) else _other(frame, own)
            for frame, own in self.mounts.items()
        ]
        return replace(self.survey, lasers=tuple(lasers))


def is_same(one: FloatArray, other: FloatArray) -> bool:
    """Whether two mountings (4, 4) are the same."""
    return bool(np.abs(one - other).max() <= SAME_M)


def _other(frame: str, mount: FloatArray) -> str:
    return f"{frame} at {(mount[:3].round(DIGITS) + 0.0).tolist()}"
