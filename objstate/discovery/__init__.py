"""Finding the doors of a building in its map and in drives."""

from objstate.discovery.candidates import Candidate
from objstate.discovery.learning import Learnt, learn_doors

__all__ = ["Candidate", "Learnt", "learn_doors"]
