"""What a name that isn't known was meant to be."""

import pytest

from objstate.spelling import nearest


@pytest.mark.parametrize(
    ("name", "near"), [("bulding", "building"), ("door7", "door_07"), ("xyz", None), ("", None)]
)
def test_the_nearest_name_is_found_unless_none_is_near(name: str, near: str | None) -> None:
    assert nearest(name, ["building", "door_07", "door_11"]) == near
    assert nearest(name, []) is None
