"""Where is each object? One sample-based filter per object (section 2.1 of Schulz and Burgard 2001)."""

from objstate.objects.belief import Distribution, ObjectBelief
from objstate.objects.conditional import SAME, ConditionalBelief, Descent, Update
from objstate.objects.evidence import ScanEvidence
from objstate.objects.filters import ObjectFilter, filter_for

__all__ = [
    "SAME",
    "ConditionalBelief",
    "Descent",
    "Distribution",
    "ObjectBelief",
    "ObjectFilter",
    "ScanEvidence",
    "Update",
    "filter_for",
]
