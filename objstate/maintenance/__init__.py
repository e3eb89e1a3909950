"""What to look at next: gain against cost, what plans ask for, and what came of it (Elfring et al. 2014)."""

from objstate.maintenance.choice import ChoiceSettings
from objstate.maintenance.coordinator import Action, Coordinator, CoordinatorSettings, GainWeight
from objstate.maintenance.tasks import (
    Expectation,
    Outcome,
    VerificationTask,
    next_tasks,
    outcome,
    scattered,
)
from objstate.maintenance.triggers import (
    TABLE_1,
    Plan,
    Situation,
    Trigger,
    all_of,
    any_of,
    before,
    entropy_above,
    named,
    older_than,
    unless,
)

__all__ = [
    "TABLE_1",
    "Action",
    "ChoiceSettings",
    "Coordinator",
    "CoordinatorSettings",
    "Expectation",
    "GainWeight",
    "Outcome",
    "Plan",
    "Situation",
    "Trigger",
    "VerificationTask",
    "all_of",
    "any_of",
    "before",
    "entropy_above",
    "named",
    "next_tasks",
    "older_than",
    "outcome",
    "scattered",
    "unless",
]
