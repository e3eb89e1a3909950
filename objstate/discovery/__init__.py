"""A building from drives: its doors found in a map, and where they hang learnt."""

from objstate.discovery.at_once import LearntAtOnce, learn_at_once
from objstate.discovery.candidates import Candidate
from objstate.discovery.learning import Learnt, learn_doors
from objstate.discovery.refining import Refined, refine_building

__all__ = [
    "Candidate",
    "Learnt",
    "LearntAtOnce",
    "Refined",
    "learn_at_once",
    "learn_doors",
    "refine_building",
]
