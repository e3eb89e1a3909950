"""``dynamics.yaml``: the settings of a run with what was learnt, for ``--config``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from objstate.config import Settings
from objstate.learning.dynamics import LearntDynamics, ObjectDynamics
from objstate.learning.rates import Rate

DYNAMICS = "dynamics.yaml"  # in a result folder
SPECIAL = "*?["  # what name patterns give a meaning

HEADER = """\
# How often this run's objects were moved, learnt by objstate estimate --learn-dynamics.
# Apply with: objstate estimate LOG --building URDF --out DIR --config THIS_FILE
"""


def write_dynamics(path: str | Path, learnt: LearntDynamics, settings: Settings) -> None:
    """Write ``settings`` with a rule for each object; comments give what it is based on."""
    import yaml

    content = settings.model_dump(mode="json", by_alias=True, exclude_unset=True)
    rules = [_rule(each, learnt) for each in learnt.objects]
    content["objects"] = [*content.get("objects", []), *rules]
    text = HEADER + "".join(f"# {line}\n" for line in summary_lines(learnt))
    Path(path).write_text(text + yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def summary_lines(learnt: LearntDynamics) -> Iterator[str]:
    """What was learnt, in sentences."""
    for kind, rate in learnt.classes.items():
        yield f"{kind}: {_told(rate)}"
    if learnt.rest is not None:
        shares = ", ".join(f"{name} {share:g}" for name, share in learnt.rest.to_dict().items())
        yield f"doors come to rest: {shares} ({learnt.rest.rests} rests)"


def _told(rate: Rate) -> str:
    return (
        f"{rate.mean:.3g} moves an hour (90 %: {rate.lower:.3g} to {rate.upper:.3g}), from "
        f"{rate.moves:.1f} moves in {rate.hours:.2f} h"
    )


def _rule(learnt: ObjectDynamics, all_learnt: LearntDynamics) -> dict[str, Any]:
    dynamics = {"moves_per_hour": float(f"{learnt.rate.mean:.4g}")}
    rule: dict[str, Any] = {"match": _literally(learnt.name), "dynamics": dynamics}
    if learnt.is_door and all_learnt.rest is not None:
        rule["rest"] = all_learnt.rest.to_dict()
    return rule


def _literally(name: str) -> str:
    """A pattern that matches a name and nothing else."""
    return "".join(f"[{sign}]" if sign in SPECIAL else sign for sign in name)
