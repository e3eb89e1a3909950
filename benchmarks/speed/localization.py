"""One localization update, in the setting that Beluga publishes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from benchmarks.speed.places import laser, office, scan_from, segments
from benchmarks.speed.rays import ROOMS
from benchmarks.speed.table import Table, milliseconds
from benchmarks.speed.timing import Effort, in_turns
from objstate.config import BeamModelSettings, LocalizationSettings
from objstate.geometry import FloatArray
from objstate.localization import Localizer, PoseBelief
from objstate.particles import Weights
from objstate.sensing import BeamModel, Sensing

SAMPLES, BEAMS = 2000, 100
POSE = np.array([10.0, 0.2, 0.3])
STEP = np.array([0.05, 0.0, 0.01])  # of the odometry


@dataclass(frozen=True, eq=False)
class Wide:
    """A robot belief, and how wide it is."""

    told: str
    std: FloatArray  # (3,) m, m, rad

    @property
    def belief(self) -> PoseBelief:
        rng = np.random.default_rng(8)
        poses = POSE + self.std * rng.standard_normal((SAMPLES, 3))
        return PoseBelief(poses, Weights.uniform(SAMPLES))


BELIEFS = (
    Wide("3 cm, 1.5°", np.array([0.03, 0.03, np.radians(1.5)])),
    Wide("30 cm, 10°", np.array([0.3, 0.3, np.radians(10.0)])),
)


class EveryTime(LocalizationSettings):
    """Settings with which each correction resamples."""

    resample_below: ClassVar[float] = 1.0


def updates(effort: Effort) -> list[Table]:
    """Prediction, correction and resampling of 2,000 samples by 100 beams."""
    building, rng = office(1, ROOMS), np.random.default_rng(9)
    settings = EveryTime(min_particles=SAMPLES, max_particles=SAMPLES)
    localizer, model = Localizer(settings), BeamModel(BeamModelSettings())
    sensing = Sensing(building, model)
    scan = scan_from(building, {}, POSE, laser(BEAMS, 2.0 * np.pi), rng)

    def update(belief: PoseBelief) -> PoseBelief:
        moved = localizer.predict(belief, STEP, rng)
        evidence = sensing.view(scan).pose_log_likelihood(moved.poses, 0.0, [])
        corrected = localizer.correct(moved, settings.tempering * evidence)
        return localizer.renew(corrected, rng)[0]

    calls = {wide.told: (lambda belief=wide.belief: update(belief)) for wide in BELIEFS}
    taken = in_turns(calls, effort)
    assert all(len(update(wide.belief).weights) == SAMPLES for wide in BELIEFS)
    return [
        Table(
            "One localization update",
            ("robot belief", "update"),
            [(name, milliseconds(seconds)) for name, seconds in taken.items()],
            (
                f"Monte Carlo localization with {SAMPLES:,} samples and {BEAMS} beams in an office of "
                f"{segments(building.walls):,} segments: prediction, beam model and resampling. Beluga publishes "
                "about 47 ms for these numbers (sequential, i9-9900, occupancy grid).",
            ),
        )
    ]
