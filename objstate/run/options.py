"""The options of a run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from objstate.config import Settings, check_settings
from objstate.geometry import FloatArray
from objstate.logs.log import check_by_frame


@dataclass(frozen=True, eq=False)
class RunOptions:
    """Everything that determines a result besides the log and the building.

    Raises TypeError for settings that aren't loaded, and for mounts and clock offsets that aren't
    given by frame.
    """

    settings: Settings = field(default_factory=Settings)
    seed: int = 0
    belief: Literal["own", "recorded"] = "own"  # localize, or take the belief that the log holds
    initial_pose: FloatArray | None = None  # (3,) instead of the log's own
    global_start: bool = False  # the robot may be anywhere at first
    start: float | None = None  # s from the log's start, or since 1970
    end: float | None = None
    topics: Collection[str] | None = None  # read only these
    mounts: Mapping[str, FloatArray] = field(default_factory=dict)  # (4, 4) laser in base_link
    clock_offsets: Mapping[str, float] = field(
        default_factory=dict
    )  # s by which a laser's stamps are ahead of the odometry's

    def __post_init__(self) -> None:
        check_settings(self.settings)
        check_by_frame(mounts=self.mounts, clock_offsets=self.clock_offsets)

    def to_dict(self) -> dict[str, Any]:
        """The same as JSON values."""
        pose = None if self.initial_pose is None else np.asarray(self.initial_pose).tolist()
        return {
            "settings": self.settings.model_dump(mode="json", by_alias=True),
            "seed": self.seed,
            "belief": self.belief,
            "initial_pose": pose,
            "global_start": self.global_start,
            "start": self.start,
            "end": self.end,
            "topics": None if self.topics is None else sorted(self.topics),
            "mounts": {frame: mount.tolist() for frame, mount in self.mounts.items()},
            "clock_offsets": dict(self.clock_offsets),
        }


def check_options(given: object) -> None:
    """Raise TypeError for what is no RunOptions, such as the path of settings."""
    if not isinstance(given, RunOptions):
        raise TypeError(
            f"A {type(given).__name__} is no RunOptions; give objstate.RunOptions(...), in which "
            "settings=objstate.load_settings(PATH) stands for a file of settings."
        )
