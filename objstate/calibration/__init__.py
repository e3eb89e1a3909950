"""Where the lasers really sit and how their clocks run, from the log itself."""

from objstate.building.writing import CALIBRATION
from objstate.calibration.calibration import (
    QUANTITIES,
    Calibration,
    LaserCorrection,
    calibrate,
    calibrate_log,
)
from objstate.calibration.files import (
    calibration_text,
    read_calibration,
    write_calibration,
)
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.surveying import Survey, survey_log
from objstate.calibration.surveys import Surveyed, Surveys

__all__ = [
    "CALIBRATION",
    "QUANTITIES",
    "Calibration",
    "CalibrationOptions",
    "LaserCorrection",
    "Survey",
    "Surveyed",
    "Surveys",
    "calibrate",
    "calibrate_log",
    "calibration_text",
    "read_calibration",
    "survey_log",
    "write_calibration",
]
