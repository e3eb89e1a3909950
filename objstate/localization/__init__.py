"""Where is the robot? Monte Carlo localization (section 2.2 of Schulz and Burgard 2001)."""

from objstate.localization.belief import PoseBelief
from objstate.localization.localizer import LEVER, Localizer
from objstate.localization.odometry_error import OdometryError
from objstate.localization.search import APART, Hypotheses, LogLikelihood, Search, apart

__all__ = [
    "APART",
    "LEVER",
    "Hypotheses",
    "Localizer",
    "LogLikelihood",
    "OdometryError",
    "PoseBelief",
    "Search",
    "apart",
]
