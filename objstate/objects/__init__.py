"""The belief about each object, with one filter each (section 2.1 of Schulz and Burgard 2001)."""

from objstate.objects.belief import Distribution, ObjectBelief
from objstate.objects.evidence import ScanEvidence, Update
from objstate.objects.filters import ObjectFilter, filter_for

__all__ = [
    "Distribution",
    "ObjectBelief",
    "ObjectFilter",
    "ScanEvidence",
    "Update",
    "filter_for",
]
