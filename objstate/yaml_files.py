"""YAML as objstate reads it: plain values of bounded size, and one error for all faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

# bytes; a robot's YAML files have thousands, a bag's list of a thousand parts half a million
LONGEST = 4 * 2**20
# values, counting aliases wherever they are used: a few lines can mean billions
MOST_VALUES = 200_000
MERGE = "tag:yaml.org,2002:merge"  # of the key <<
# depth of groups; more than any reader of the content needs
DEEPEST = 50


class YamlError(Exception):
    """A text is no usable YAML; the message says why, in one line."""


def read_yaml(path: Path) -> Any:
    """The plain value in a YAML file in UTF-8; None for an empty one.

    Raises OSError and YamlError.
    """
    with path.open("rb") as file:
        content = file.read(LONGEST + 1)
    if len(content) > LONGEST:
        raise YamlError(f"it is longer than {LONGEST // 2**20} MB")
    try:
        return yaml.load(content.decode("utf-8"), Loader=_Loader)
    except UnicodeDecodeError as error:
        raise YamlError(f"it is no text in UTF-8 (byte {error.start})") from error
    except yaml.MarkedYAMLError as error:
        raise YamlError(_told(error)) from error
    except yaml.YAMLError as error:
        raise YamlError(" ".join(str(error).split())) from error
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        # what PyYAML raises for invalid dates, too long numbers, and tags on wrong values
        raise YamlError(f"a value can't be read: {error}") from error


class _Loader(yaml.SafeLoader):
    """Refuses a text that expands far beyond its size, before any value is made of it."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0
        self._count = 0
        self._counts: dict[yaml.Node, int] = {}  # number of values in a node

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
        is_alias = self.check_event(yaml.AliasEvent)
        before = self._count
        self._depth += 1
        if self._depth > DEEPEST:
            raise yaml.MarkedYAMLError(problem="groups are nested too deeply", problem_mark=mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is None:
            return None
        if is_alias and node not in self._counts:
            raise yaml.MarkedYAMLError(problem="a group holds itself", problem_mark=mark)
        self._count = before + self._counts[node] if is_alias else self._count + 1
        if self._count > MOST_VALUES:
            raise yaml.MarkedYAMLError(problem="it holds too many values", problem_mark=mark)
        self._counts[node] = self._count - before
        return node

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        keys = [key for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        seen = set[str]()
        for key in keys:
            if key.value in seen and key.tag != MERGE:
                raise yaml.MarkedYAMLError(
                    problem=f"'{key.value}' is given twice", problem_mark=key.start_mark
                )
            seen.add(key.value)
        return node


def _told(error: yaml.MarkedYAMLError) -> str:
    problem = " ".join((error.problem or error.context or "it can't be parsed").split())
    mark = error.problem_mark or error.context_mark
    return (
        problem if mark is None else f"{problem} (line {mark.line + 1}, column {mark.column + 1})"
    )
