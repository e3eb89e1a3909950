"""Calibration of each laser's mounting and clock from a recorded drive, with deviations.

Hand-eye calibration with the building as the target: the laser's motion past known walls is
compared with the odometry's (Censi, Franchi, Marchionni and Oriolo 2013, "Simultaneous calibration
of odometry and sensor parameters for mobile robots").
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from objstate.building.model import Building
from objstate.calibration.adjustment import Adjusted, Adjustment, prior_deviations
from objstate.calibration.consistency import birge_ratios
from objstate.calibration.gathering import Gathered, gather
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.walls import WallReader
from objstate.estimator import Estimator
from objstate.geometry import BoolArray, FloatArray, rotation_about, transform
from objstate.records import Record

FAR_OFF = 3.0  # deviations of what is assumed before any reading
LEAST_USED = 0.5  # share of readings of walls, below which building and log hardly belong together

QUANTITIES = ("x", "y", "yaw", "clock")  # m, m, rad, s: the order of corrections


@dataclass(frozen=True, eq=False)
class LaserCorrection:
    """The corrections of one laser, relative to the mounting and the clock of the log."""

    frame: str
    mount: FloatArray  # (4, 4) in base_link, that it was read with
    clock_offset: float  # s that it was read with
    correction: FloatArray  # (4,) m, m in base_link; rad about the laser; s its stamps run ahead
    std: FloatArray  # (4,)
    told: BoolArray  # (4,) which corrections the drive determines; the others are not to be used

    @property
    def told_correction(self) -> FloatArray:
        """(4,) zero where the drive doesn't determine it."""
        return np.where(self.told, self.correction, 0.0)

    @property
    def corrected_mount(self) -> FloatArray:
        """(4, 4) with the determined corrections."""
        x, y, yaw, _ = self.told_correction
        rotation = rotation_about((0.0, 0.0, 1.0), yaw) @ self.mount[:3, :3]
        return transform(rotation, self.mount[:3, 3] + np.array([x, y, 0.0]))

    @property
    def corrected_clock_offset(self) -> float:
        """s by which the laser's stamps are ahead of the odometry's, as far as determined."""
        return self.clock_offset + float(self.told_correction[3])


@dataclass(frozen=True, eq=False)
class Calibration:
    """The calibration of a robot by one drive."""

    lasers: tuple[LaserCorrection, ...]
    way_share: float  # share by which the odometry counts ways too long
    way_share_std: float
    drift: float  # rad/m of its heading
    drift_std: float
    scans: int  # used
    spread: float  # m, deviation of readings from the walls
    wall_spread: float  # m, deviation of walls from the model
    used: float  # share of the readings that lie near walls
    warnings: tuple[str, ...] = ()

    @property
    def mounts(self) -> dict[str, FloatArray]:
        """Corrected mountings (4, 4) of all lasers by frame, for ``RunOptions.mounts``."""
        return {laser.frame: laser.corrected_mount for laser in self.lasers}

    @property
    def clock_offsets(self) -> dict[str, float]:
        """Of all lasers, as ``RunOptions.clock_offsets`` takes them; s."""
        return {laser.frame: laser.corrected_clock_offset for laser in self.lasers}


def calibrate(
    records: Iterable[Record],
    building: Building,
    mounts: Mapping[str, FloatArray],
    estimator: Estimator | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Each laser's mounting and clock from one drive's records.

    ``mounts`` (4, 4) by frame are those that the records were made with. Raises LogError where the
    robot was localized nowhere.
    """
    estimator, options = estimator or Estimator(building), options or CalibrationOptions()
    gathered = gather(records, estimator, options)
    return calibration_of(gathered, WallReader.of(estimator, options), mounts, {}, options)


def calibration_of(
    gathered: Gathered,
    reader: WallReader,
    mounts: Mapping[str, FloatArray],
    clock_offsets: Mapping[str, float],
    options: CalibrationOptions,
) -> Calibration:
    """The same of a drive that was gathered, which was read with ``clock_offsets``, s, by frame."""
    whole = Adjustment(gathered, reader, options).solve()
    parts = [Adjustment(part, reader, options).solve() for part in gathered.parts(options.parts)]
    ratios = birge_ratios(whole, parts)
    widened = replace(whole, covariance=whole.covariance * np.outer(ratios, ratios))
    return _calibration(widened, len(gathered.scans), mounts, clock_offsets, options)


def _calibration(
    adjusted: Adjusted,
    scans: int,
    mounts: Mapping[str, FloatArray],
    clock_offsets: Mapping[str, float],
    options: CalibrationOptions,
) -> Calibration:
    std = np.sqrt(np.diag(adjusted.covariance))
    prior = prior_deviations(options, len(adjusted.frames))
    told = std < options.told_below * prior
    by_laser = [values[2:].reshape(-1, 4) for values in (std, told)]
    lasers = tuple(
        LaserCorrection(
            frame=frame,
            mount=mounts[frame],
            clock_offset=clock_offsets.get(frame, 0.0),
            correction=adjusted.unknowns.lasers[k],
            std=by_laser[0][k],
            told=by_laser[1][k],
        )
        for k, frame in enumerate(adjusted.frames)
    )
    way_share, drift = adjusted.unknowns.errors.tolist()
    return Calibration(
        lasers=lasers,
        way_share=way_share,
        way_share_std=float(std[0]),
        drift=drift,
        drift_std=float(std[1]),
        scans=scans,
        spread=adjusted.spread,
        wall_spread=adjusted.wall_spread,
        used=adjusted.used,
        warnings=(*_doubts(adjusted), *_far_off(lasers, prior[2:6])),
    )


def _far_off(lasers: Sequence[LaserCorrection], prior: FloatArray) -> Iterator[str]:
    """Corrections larger than a calibration is meant for."""
    for laser in lasers:
        far = np.abs(laser.correction) > FAR_OFF * prior
        if far.any():
            names = ", ".join(name for name, is_far in zip(QUANTITIES, far, strict=True) if is_far)
            yield (
                f"The laser '{laser.frame}' seems to be off by far more than is assumed before "
                f"({names}): is its mounting in the log that of this robot, and are its stamps "
                "those of the scans?"
            )


def _doubts(adjusted: Adjusted) -> Iterator[str]:
    """Reasons to distrust the result."""
    if adjusted.used < LEAST_USED:
        yield (
            f"Only {100 * adjusted.used:.0f} % of the readings are of walls of the building; is it "
            "the building of the log, and the start right?"
        )
