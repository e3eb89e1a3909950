"""Where is the robot? Monte Carlo localization (section 2.2 of Schulz and Burgard 2001)."""

from objstate.localization.belief import PoseBelief
from objstate.localization.localizer import LEVER, Localizer
from objstate.localization.motion import motion_variances
from objstate.localization.odometry_error import OdometryError
from objstate.localization.pose_filter import NOTHING, PoseFilter, Vantage
from objstate.localization.search import APART, Hypotheses, LogLikelihood, Search, apart

__all__ = [
    "APART",
    "LEVER",
    "NOTHING",
    "Hypotheses",
    "Localizer",
    "LogLikelihood",
    "OdometryError",
    "PoseBelief",
    "PoseFilter",
    "Search",
    "Vantage",
    "apart",
    "motion_variances",
]
