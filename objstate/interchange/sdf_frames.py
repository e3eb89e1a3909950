"""The frames of the links, joints and frames of an SDF model.

Source: the SDFormat proposal on pose frame semantics. A pose is relative to the frame that
``relative_to`` names; without it, a link's and a model's to the model that holds it, a joint's to
its child, a frame's to what it is attached to.
"""

from __future__ import annotations

import numpy as np

from objstate.building.markup import Element
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, invert
from objstate.interchange.sdf_file import Model, matrix_of

SELF, WORLD = "__model__", "world"
INTO = "::"  # between the names of a model and of what is in it


def plain_name(name: str) -> str:
    """A name without what parts names in SDF, or in paths."""
    return name.replace(INTO, "_").replace("/", "_")


class Frames:
    """The frames of one model, each found when it is asked for."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.inner = {name: Frames(each) for name, each in model.models.items()}
        self._links, self._joints = model.all("link"), model.all("joint")
        self._frames = model.all("frame")
        self._found: dict[str, FloatArray] = {SELF: np.eye(4), WORLD: np.eye(4)}
        self._open: list[str] = []  # being found

    def at(self, name: str, where: str) -> FloatArray:
        """Frame ``name`` in the model, (4, 4). Raises BuildingError, with the place of its use."""
        if name not in self._found:
            if name in self._open:
                raise BuildingError(
                    f"Frame '{name}' in {where} is defined relative to itself; correct its "
                    "relative_to."
                )
            self._open.append(name)
            self._found[name] = self._find(name, where)
            self._open.remove(name)
        return self._found[name]

    def link_of(self, name: str, where: str) -> str:
        """The link, with the names of the models that hold it, to which a frame is attached."""
        if name in self._links or name == WORLD:
            return name
        if name == SELF or (name in self.inner):
            inside = self if name == SELF else self.inner[name]
            prefix = "" if name == SELF else name + INTO
            return prefix + inside.first_link(where)
        if name in self._frames:
            attached = self._frames[name].attributes.get("attached_to") or SELF
            return self.link_of(attached, self._frames[name].where)
        if name in self._joints:
            return self.link_of(self._joints[name].need("child").content, where)
        model, _, rest = name.partition(INTO)
        if rest and model in self.inner:
            return model + INTO + self.inner[model].link_of(rest, where)
        raise self._unknown(name, where)

    def first_link(self, where: str) -> str:
        """The link that a model's own frame is attached to."""
        canonical = self.model.element.attributes.get("canonical_link")
        if canonical:
            return self.link_of(canonical, where)
        if self._links:
            return next(iter(self._links))
        for name, inside in self.inner.items():
            return name + INTO + inside.first_link(where)
        raise BuildingError(f"Model '{self.model.name}' of {where} has no link; give it one.")

    def _find(self, name: str, where: str) -> FloatArray:
        if name in self._links:
            return self._posed(self._links[name], SELF)
        if name in self._joints:
            joint = self._joints[name]
            return self._posed(joint, joint.need("child").content)
        if name in self._frames:
            frame = self._frames[name]
            return self._posed(frame, frame.attributes.get("attached_to") or SELF)
        if name in self.inner:
            inside = self.inner[name]
            pose = inside.model.pose
            placed = self._relative(pose, SELF)
            if inside.model.placed_by:
                return placed @ invert(inside.at(inside.model.placed_by, where))
            return placed
        model, _, rest = name.partition(INTO)
        if rest and model in self.inner:
            return self.at(model, where) @ self.inner[model].at(rest, where)
        raise self._unknown(name, where)

    def _posed(self, element: Element, default: str) -> FloatArray:
        return self._relative(element.first("pose"), default)

    def _relative(self, pose: Element | None, default: str) -> FloatArray:
        given = {} if pose is None else pose.attributes
        to = given.get("relative_to") or given.get("frame") or default
        where = self.model.path.name if pose is None else pose.where
        return np.asarray(self.at(to, where) @ matrix_of(pose))

    def _unknown(self, name: str, where: str) -> BuildingError:
        known = [*self._links, *self._joints, *self._frames, *self.inner]
        return BuildingError(
            f"Frame '{name}' in {where} is not in model '{self.model.name}'; it has "
            f"{', '.join(known[:8]) or 'none'}."
        )
