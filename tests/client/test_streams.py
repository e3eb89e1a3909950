"""Server-Sent Events come out as they were sent, however the connection was cut."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.client import Event
from objstate.client.streams import Assembly

data = st.one_of(st.text(max_size=5), st.lists(st.integers(), max_size=2))


def written(number: int, value: Any, parts: int) -> list[str]:
    """The lines of one event; the value over several lines, as JSON may be."""
    text = json.dumps(value, indent=1 if parts > 1 else None)
    return [f"id: {number}", "event: belief", *(f"data: {line}" for line in text.splitlines()), ""]


@settings(max_examples=40)
@given(
    st.lists(st.tuples(data, st.integers(1, 2)), max_size=4),
    st.lists(st.integers(0, 40), max_size=8),
)
def test_resumed_streams_lose_and_repeat_nothing(
    sent: list[tuple[Any, int]], cuts: list[int]
) -> None:
    """Connections are cut after so many lines, but for the last."""
    heard: list[Event] = []
    assembly = Assembly()
    for cut in (*cuts, None):
        assembly.begin()
        after = int(assembly.last or 0)
        lines = [
            line
            for number, (value, parts) in enumerate(sent, 1)
            if number > after
            for line in [": still here", "", *written(number, value, parts)]
        ]
        heard += [event for line in lines[:cut] if (event := assembly.feed(line)) is not None]
    assert [event.data for event in heard] == [value for value, _ in sent]
    assert [int(event.id) for event in heard] == list(range(1, len(sent) + 1))


def test_an_identity_without_an_event_is_where_to_resume() -> None:
    assembly = Assembly()
    assert [assembly.feed(line) for line in ("id: 41", "")] == [None, None]
    assembly.begin()
    assert assembly.last == "41"
