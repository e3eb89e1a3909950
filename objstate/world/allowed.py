"""Tasks, and how much uncertainty each allows (section III-C of Elfring et al. 2012)."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from objstate.config import NonNegative, Positive, Strict, load_yaml, parse_strict
from objstate.errors import SettingsError

PRESENT = "present"  # whether furniture is there at all: an attribute that is true or false


class Allowed(Strict):
    """The largest variance of each coordinate; None: any. Of what is true or false, p (1 - p)."""

    angle: NonNegative | None = None  # rad^2, of a hinged door
    offset: NonNegative | None = None  # m^2, of a sliding door
    x: NonNegative | None = None  # m^2, of furniture
    y: NonNegative | None = None  # m^2
    yaw: NonNegative | None = None  # rad^2
    present: Annotated[float, Field(ge=0, le=0.25)] | None = None


class AllowedOf(Allowed):
    """What is allowed of the objects whose names match."""

    match: str  # shell-style: * ? [..]


class Task(Strict):
    """What a robot is about, and how well it has to know the objects for that."""

    name: str
    default: Allowed = Allowed()  # of objects that nothing below matches
    objects: tuple[AllowedOf, ...] = ()  # later ones win, coordinate by coordinate
    most_per_second: Positive = 30.0  # verifications of one object

    def allowed(self, name: str) -> dict[str, float]:
        """The largest allowed variances of an object, by coordinate; none where any is allowed."""
        found: dict[str, float | None] = self.default.model_dump()
        for rule in self.objects:
            if fnmatchcase(name, rule.match):
                found |= rule.model_dump(exclude={"match"}, exclude_unset=True)
        return {coordinate: most for coordinate, most in found.items() if most is not None}


class Tasks(Strict):
    """Tasks by name, as a file lists them."""

    tasks: Annotated[tuple[Task, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _check(self) -> Tasks:
        names = [task.name for task in self.tasks]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise ValueError(f"two tasks are called '{twice[0]}'; give each its own name")
        return self

    def named(self, name: str | None) -> Task:
        """A task, by default the first. Raises SettingsError."""
        found = [task for task in self.tasks if name in (None, task.name)]
        if not found:
            known = ", ".join(task.name for task in self.tasks)
            raise SettingsError(f"There is no task '{name}'; there are {known}.")
        return found[0]


def load_tasks(path: str | Path) -> Tasks:
    """The tasks of a YAML file. Raises SettingsError."""
    return parse_strict(Tasks, load_yaml(Path(path)), str(path), "tasks")
