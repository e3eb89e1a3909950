"""Server-Sent Events, line by line (HTML standard, section 9.2.6)."""

from __future__ import annotations

import json

from objstate.client.answers import Event


class Assembly:
    """Puts events together from the lines of a stream."""

    def __init__(self) -> None:
        self._kind, self._data = "message", list[str]()
        self._id = ""

    def feed(self, line: str) -> Event | None:
        """The event that a line ends; None where it ends none."""
        if not line:
            return self._ended()
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "data":
            self._data.append(value)
        elif name == "event":
            self._kind = value
        elif name == "id":
            self._id = value
        return None

    def _ended(self) -> Event | None:
        kind, data = self._kind, self._data
        self._kind, self._data = "message", []
        return Event(id=self._id, kind=kind, data=json.loads("\n".join(data))) if data else None
