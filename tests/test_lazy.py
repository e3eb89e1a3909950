"""A value works out what is asked for once."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace

from objstate.lazy import altered, lazy


@dataclass(frozen=True)
class Square:
    side: float

    @lazy
    def area(self) -> list[float]:
        """In a list, so that each that is computed is another."""
        return [self.side**2]


def test_it_is_computed_once_and_of_each_value_by_itself() -> None:
    small, large = Square(2.0), Square(3.0)
    assert small.area is small.area
    assert (small.area, large.area) == ([4.0], [9.0])


def test_a_changed_value_computes_anew() -> None:
    small = Square(2.0)
    assert (small.area, replace(small, side=4.0).area) == ([4.0], [16.0])


def test_the_class_shows_what_it_says() -> None:
    assert (Square.area.__doc__ or "").startswith("In a list")


def test_what_is_altered_forgets_what_it_worked_out_and_leaves_the_first_as_it_was() -> None:
    @dataclass(frozen=True)
    class Side:
        length: float
        name: str = "a"

        @lazy
        def area(self) -> float:
            return self.length**2

    first = Side(2.0, "b")
    assert first.area == 4.0
    other = altered(first, length=3.0)
    assert (other.length, other.name, other.area) == (3.0, "b", 9.0)
    assert other == replace(first, length=3.0)
    assert (first.length, first.area) == (2.0, 4.0)


def test_a_module_is_loaded_when_something_of_it_is_asked_for() -> None:
    script = (
        "import sys\nfrom objstate.lazy import Later\ncolours = Later('colorsys')\n"
        "before = 'colorsys' in sys.modules\nprint(before, colours.ONE_THIRD > 0.3, 'colorsys' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False True True\n"
