"""Server-Sent Events, line by line (HTML standard, section 9.2.6)."""

from __future__ import annotations

import json

from objstate.client.answers import Event


class Assembly:
    """Puts events together from the lines of a stream, over several connections."""

    def __init__(self, last: str | None = None) -> None:
        self.last = last  # identity to resume after; also of a block that holds no event
        self.begin()

    def begin(self) -> None:
        """A new connection: what an earlier one left unfinished will be sent again."""
        self._identity = self.last
        self._kind, self._data = "message", list[str]()

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
            self._identity = value
        return None

    def _ended(self) -> Event | None:
        self.last = self._identity
        kind, text = self._kind, "\n".join(self._data)
        self.begin()
        return Event(id=self.last or "", kind=kind, data=json.loads(text)) if text else None
