"""Learning from a run's own estimates how often objects are moved, and where they come to rest."""

from objstate.learning.dynamics import LearntDynamics, ObjectDynamics, learn_dynamics
from objstate.learning.files import DYNAMICS, summary_lines, write_dynamics
from objstate.learning.rates import Rate, Waits, posterior_rate
from objstate.learning.rests import Rest, rests_of
from objstate.learning.shares import RestShares, learn_shares

__all__ = [
    "DYNAMICS",
    "LearntDynamics",
    "ObjectDynamics",
    "Rate",
    "Rest",
    "RestShares",
    "Waits",
    "learn_dynamics",
    "learn_shares",
    "posterior_rate",
    "rests_of",
    "summary_lines",
    "write_dynamics",
]
