"""Where is the robot? Monte Carlo localization (section 2.2 of Schulz and Burgard 2001)."""

from objstate.localization.anywhere import Anywhere
from objstate.localization.belief import PoseBelief
from objstate.localization.carried import Carried, Decorrelation
from objstate.localization.localizer import Localizer
from objstate.localization.motion import motion_variances
from objstate.localization.odometry_error import OdometryError
from objstate.localization.pose_filter import (
    NOTHING,
    Learnt,
    PoseFilter,
    RangeNoise,
    Vantage,
    WallErrors,
)
from objstate.localization.search import Hypotheses, Keyframe, LogLikelihood, Odds, Search, apart

__all__ = [
    "NOTHING",
    "Anywhere",
    "Carried",
    "Decorrelation",
    "Hypotheses",
    "Keyframe",
    "Learnt",
    "Localizer",
    "LogLikelihood",
    "Odds",
    "OdometryError",
    "PoseBelief",
    "PoseFilter",
    "RangeNoise",
    "Search",
    "Vantage",
    "WallErrors",
    "apart",
    "motion_variances",
]
