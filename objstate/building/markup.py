"""XML elements that know the file and line they stand in, so that errors can say where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from objstate.errors import BuildingError
from objstate.kinds import BUILDING, IMAGE, MAP, instead, kind_of

LARGEST = 1e8  # m, rad, or scale; coordinates of a country are smaller


@dataclass(frozen=True, eq=False)
class Element:
    """One XML element."""

    tag: str
    attributes: Mapping[str, str]
    where: str  # "office.urdf, line 12"
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)  # of the text between its tags

    @property
    def content(self) -> str:
        """The text between the element's tags, but not that of its children."""
        return "".join(self.pieces).strip()

    def all(self, tag: str) -> list[Element]:
        """The direct children of this tag, in order."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """The first direct child of this tag, if any."""
        return next((child for child in self.children if child.tag == tag), None)

    def need(self, tag: str) -> Element:
        """The first direct child of this tag; BuildingError if there is none."""
        child = self.first(tag)
        if child is None:
            raise BuildingError(f"<{self.tag}> holds no <{tag}> in {self.where}; add one.")
        return child

    def text(self, name: str) -> str:
        """A non-empty attribute; BuildingError if it is missing."""
        value = self.attributes.get(name, "").strip()
        if not value:
            raise BuildingError(f'<{self.tag}> has no {name} in {self.where}; add {name}="...".')
        return value

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Numbers in a building's range, as many as ``default`` has; ``default`` if absent."""
        if name not in self.attributes:
            return default
        values = numbers_in(self.attributes[name])
        if len(values) != len(default):
            raise BuildingError(
                f'<{self.tag} {name}="{self.attributes[name]}"> in {self.where} must hold '
                f"{len(default)} finite number(s) of at most {LARGEST:.0f}, e.g. "
                f'{name}="{" ".join(map(str, default))}".'
            )
        return values

    def positive(self, name: str, count: int = 1) -> tuple[float, ...]:
        """A required attribute of ``count`` numbers, each above zero."""
        self.text(name)
        values = self.numbers(name, (1.0,) * count)
        if min(values) <= 0:
            raise BuildingError(
                f'<{self.tag} {name}="{self.attributes[name]}"> in {self.where} has no extent; '
                "give metres above zero."
            )
        return values


def numbers_in(text: str) -> tuple[float, ...]:
    """The numbers that blanks part; none where one of them is no number in a building's range."""
    try:
        values = tuple(float(word) for word in text.split())
    except ValueError:
        return ()
    return values if all(abs(value) <= LARGEST for value in values) else ()


def read_xml(path: Path) -> Element:
    """The root element of an XML file. Raises BuildingError if it can't be read or parsed."""
    kind = kind_of(path)
    if kind in (MAP, IMAGE):
        raise BuildingError(
            f"{path} is a map, not a URDF; `objstate building from-map` makes a building of it."
        )
    if told := instead(path, BUILDING):
        raise BuildingError(told)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BuildingError(
            f"{path} can't be read ({error.strerror or error}); check the path."
        ) from error
    parser = expat.ParserCreate()
    top: list[Element] = []
    opened: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        where = f"{path.name}, line {parser.CurrentLineNumber}"
        element = Element(tag, attributes, where)
        (opened[-1].children if opened else top).append(element)
        opened.append(element)

    def text(piece: str) -> None:
        opened[-1].pieces.append(piece)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: opened.pop()
    parser.CharacterDataHandler = text
    try:
        parser.Parse(content, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise BuildingError(
            f"{path} is not well-formed XML: {error} (line {parser.CurrentLineNumber}); mend it there."
        ) from error
    return top[0]
