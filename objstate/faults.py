"""Faults of data from a file, in words of YAML instead of pydantic's words of Python."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from objstate.spelling import nearest

SHAPES = {  # YAML's names of the shapes that pydantic names by Python's types
    "model_type": "must be a group of keys, as in 'key: value'",
    "model_attributes_type": "must be a group of keys, as in 'key: value'",
    "dict_type": "must be a group of keys, as in 'key: value'",
    "tuple_type": "must be a list, as in '[first, second]'",
    "list_type": "must be a list, as in '[first, second]'",
    "missing": "is required",
}
NAMES_ABSENT_KEYS = ("missing", "extra_forbidden")
LONGEST_VALUE = 40  # characters of a value that a message repeats


@dataclass(frozen=True)
class Fault:
    """One fault: its place in the data, the kinds of value that were tried, and what it is."""

    path: tuple[str | int, ...]  # keys and numbers of entries, as the data has them
    # where several kinds of value are possible: depth, and the kind tried
    kinds: tuple[tuple[int, str], ...]
    item: Mapping[str, Any]  # as pydantic describes it


def faults(model: type[BaseModel], error: ValidationError, data: Any) -> list[str]:
    """A sentence for each fault of ``data`` as a ``model``, with its place.

    Where a value may be of several kinds, faults of those with its shape are named; if no kind has
    its shape, the possible kinds are named once.
    """
    found = [_located(dict(item), data) for item in error.errors()]
    return [_told(model, fault, others) for fault, others in _chosen(found)]


def _located(item: dict[str, Any], data: Any) -> Fault:
    """A fault by its place in the data, without the names of kinds that pydantic inserts."""
    path: list[str | int] = []
    kinds: list[tuple[int, str]] = []
    here, last = data, len(item["loc"]) - 1
    for number, part in enumerate(item["loc"]):
        names_absent = number == last and item["type"] in NAMES_ABSENT_KEYS
        if isinstance(here, Mapping) and (part in here or names_absent):
            path.append(part)
            here = here.get(part)
        elif isinstance(part, int) and isinstance(here, Sequence) and part < len(here):
            path.append(part)
            here = here[part]
        elif names_absent:
            path.append(part)
        else:
            kinds.append((len(path), str(part)))
    return Fault(tuple(path), tuple(kinds), item)


def _chosen(found: Sequence[Fault]) -> Iterator[tuple[Fault, list[Fault]]]:
    """Each fault to name, with faults of the same value tried as other kinds."""
    groups: dict[tuple[str | int, ...], list[Fault]] = defaultdict(list)
    for fault in found:
        depth = fault.kinds[0][0] if fault.kinds else len(fault.path)
        groups[fault.path[:depth] if fault.kinds else (*fault.path, id(fault))].append(fault)
    for place, tried in groups.items():
        if not tried[0].kinds:
            yield tried[0], []
            continue
        fitting = [fault for fault in tried if len(fault.path) > len(place)]
        if fitting:  # of the right shape, with faults inside
            yield from ((fault, []) for fault in fitting)
        else:
            yield tried[0], list(tried[1:])


def _told(model: type[BaseModel], fault: Fault, others: Sequence[Fault]) -> str:
    place = _place(fault.path)
    if fault.item["type"] == "extra_forbidden":
        known = _keys_at(model, fault.path[:-1])
        near = nearest(str(fault.path[-1]), known)
        cure = f"did you mean '{near}'?" if near else f"known are {', '.join(sorted(known))}"
        return f"unknown key '{place}'; {cure}"
    messages = [_message(each.item, repeat=not others) for each in (fault, *others)]
    if others:
        wanted = [
            message.removeprefix("must be ").partition(", as in")[0]
            for message in dict.fromkeys(messages)
        ]
        messages = [f"must be {' or '.join(wanted)}{_not_this(fault.item)}"]
    return f"{place}: {messages[0]}" if place else messages[0]


def _message(item: Mapping[str, Any], repeat: bool) -> str:
    if item["type"] in SHAPES:
        return SHAPES[item["type"]]
    text = str(item["msg"]).removeprefix("Value error, ")
    if not text.startswith("Input should"):
        return text
    text = re.sub(r"^Input should (be )?", r"must \1", text.partition(", ")[0])
    text = text.replace("a valid integer", "a whole number").replace("a valid ", "a ")
    if item["type"] == "literal_error":
        text = f"must be {item['ctx']['expected']}"
    return text + (_not_this(item) if repeat else "")


def _not_this(item: Mapping[str, Any]) -> str:
    """The given value, where it is short."""
    value = item.get("input")
    text = repr(value)
    return (
        f", not {text}"
        if not isinstance(value, Mapping | list) and len(text) <= LONGEST_VALUE
        else ""
    )


def _place(path: Sequence[str | int]) -> str:
    """A path as ``objects[0].initial``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def _keys_at(model: type[BaseModel], path: Sequence[str | int]) -> list[str]:
    """The known keys of the group at ``path`` inside ``model``."""
    groups = [model]
    for part in path:
        fields = [
            field
            for group in groups
            for name, field in group.model_fields.items()
            if part in (name, field.alias)
        ]
        groups = [g for field in fields for g in _models_in(field.annotation)] or groups
    return [f.alias or name for group in groups for name, f in group.model_fields.items()]


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """Every settings group that an annotation mentions, e.g. in ``list[Group] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models_in(part)]
