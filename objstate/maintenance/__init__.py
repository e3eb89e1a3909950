"""Choosing what to look at next: gain, cost, plans and outcomes (Elfring et al. 2014)."""

from objstate.maintenance.alike import Together, seen_together
from objstate.maintenance.answers import (
    Association,
    Detection,
    Falsification,
    Verification,
    as_object,
    associated,
    falsified,
    verified,
)
from objstate.maintenance.choice import ChoiceSettings
from objstate.maintenance.coordinator import Action, Coordinator, CoordinatorSettings, GainWeight
from objstate.maintenance.light_check import Checked, LightCheck, Region, Verdict
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
    passage_in_doubt,
    unless,
)
from objstate.maintenance.waiting import seconds_until_worthwhile
from objstate.maintenance.words import age, next_words

__all__ = [
    "TABLE_1",
    "Action",
    "Association",
    "Checked",
    "ChoiceSettings",
    "Coordinator",
    "CoordinatorSettings",
    "Detection",
    "Expectation",
    "Falsification",
    "GainWeight",
    "LightCheck",
    "Outcome",
    "Plan",
    "Region",
    "Situation",
    "Together",
    "Trigger",
    "Verdict",
    "Verification",
    "VerificationTask",
    "age",
    "all_of",
    "any_of",
    "as_object",
    "associated",
    "before",
    "entropy_above",
    "falsified",
    "named",
    "next_tasks",
    "next_words",
    "older_than",
    "outcome",
    "passage_in_doubt",
    "scattered",
    "seconds_until_worthwhile",
    "seen_together",
    "unless",
    "verified",
]
