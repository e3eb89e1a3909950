"""Where the lasers really sit and how their clocks run, from the log itself."""

from objstate.building.writing import CALIBRATION
from objstate.calibration.calibration import (
    QUANTITIES,
    Calibration,
    LaserCorrection,
    calibrate,
)
from objstate.calibration.files import (
    calibration_text,
    read_calibration,
    write_calibration,
)
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.surveying import Survey, Surveyor
from objstate.calibration.surveys import Surveyed, Surveys

__all__ = [
    "CALIBRATION",
    "QUANTITIES",
    "Calibration",
    "CalibrationOptions",
    "LaserCorrection",
    "Survey",
    "Surveyed",
    "Surveyor",
    "Surveys",
    "calibrate",
    "calibration_text",
    "read_calibration",
    "write_calibration",
]
