"""Association of readings to objects that look alike (Elfring et al. 2012)."""

from objstate.association.assignments import assignments, marginals
from objstate.association.joint import Joint, Readings
from objstate.association.motion import Motion, Tracks
from objstate.association.round_shapes import Located, located
from objstate.association.sharing import Shares, shared_out

__all__ = [
    "Joint",
    "Located",
    "Motion",
    "Readings",
    "Shares",
    "Tracks",
    "assignments",
    "located",
    "marginals",
    "shared_out",
]
