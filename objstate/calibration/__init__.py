"""Where the lasers really sit and how their clocks run, from the log itself."""

from objstate.calibration.calibration import (
    QUANTITIES,
    Calibration,
    LaserCorrection,
    calibrate,
    calibrate_log,
)
from objstate.calibration.files import CALIBRATION, read_calibration, write_calibration
from objstate.calibration.options import CalibrationOptions

__all__ = [
    "CALIBRATION",
    "QUANTITIES",
    "Calibration",
    "CalibrationOptions",
    "LaserCorrection",
    "calibrate",
    "calibrate_log",
    "read_calibration",
    "write_calibration",
]
