"""Names in the order that people expect."""

from __future__ import annotations

import random

import pytest

from objstate.order import natural_key


@pytest.mark.parametrize(
    "ordered",
    [
        ["door_2", "door_10"],
        ["door", "door_1", "door_1a", "door_1b", "door_02", "door_2", "doorway"],
        ["1", "a", "b2c9", "b2c10"],
        ["7" * 4999, "7" * 5000],
        ["", "x"],
    ],
)
def test_numbers_count_as_numbers(ordered: list[str]) -> None:
    shuffled = random.Random(1).sample(ordered, len(ordered))
    assert sorted(shuffled, key=natural_key) == ordered


def test_only_equal_names_have_equal_keys() -> None:
    names = ["door_2", "Door_2", "door_02", "door_٢"]
    assert len({natural_key(name) for name in names}) == len(names)
