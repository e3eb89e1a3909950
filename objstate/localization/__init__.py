"""Where is the robot? Monte Carlo localization (section 2.2 of Schulz and Burgard 2001)."""

from objstate.localization.belief import PoseBelief
from objstate.localization.localizer import LEVER, Localizer

__all__ = ["LEVER", "Localizer", "PoseBelief"]
