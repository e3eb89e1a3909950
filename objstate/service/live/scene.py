"""What is believed, live, for Foxglove: its SDK serves the topics of recorded scenes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from objstate.errors import SettingsError
from objstate.recording.ros import ros2_types, to_cdr

if TYPE_CHECKING:
    from foxglove import Channel
    from foxglove.websocket import WebSocketServer

MISSING = "Serving Foxglove needs its SDK ({error}); pip install 'objstate[service]'."


class FoxgloveServer:
    """A Foxglove WebSocket server. It has no tokens of its own, so it stays on this machine."""

    def __init__(self, port: int) -> None:
        try:
            from foxglove import start_server
        except ImportError as error:
            raise SettingsError(MISSING.format(error=error)) from error
        try:
            self._server: WebSocketServer = start_server(
                name="objstate", host="127.0.0.1", port=port
            )
        except (OSError, RuntimeError) as error:
            raise SettingsError(
                f"Foxglove can't be served at port {port} ({error}); give another."
            ) from error
        self.port = self._server.port
        self._channels: dict[str, Channel] = {}

    def show(
        self, topic: str, kind: str, stamp_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        """Publish a message."""
        if topic not in self._channels:
            self._channels[topic] = _channel(topic, kind, definition)
        self._channels[topic].log(cdr, log_time=stamp_ns)

    def end(self) -> None:
        self._server.stop()


class SceneSender:
    """Takes the place of a log's writer: what a scene recorder writes is handed on."""

    def __init__(self, prefix: str, send: Any) -> None:
        self._prefix, self._send = prefix, send

    def write(
        self,
        topic: str,
        type_name: str,
        recorded_ns: int,
        message: Any,
        definition: str | None = None,
    ) -> None:
        """Hand a message on, on a topic of this robot's own."""
        cdr = bytes(message) if isinstance(message, bytes) else to_cdr(type_name, message)
        self._send("scene", (self._prefix + topic, type_name, recorded_ns, cdr, definition))


def _channel(topic: str, kind: str, definition: str | None) -> Channel:
    from foxglove import Channel, Schema

    text, _ = ros2_types(kind, definition).generate_msgdef(kind, ros_version=2)
    schema = Schema(name=kind, encoding="ros2msg", data=text.encode())
    return Channel(topic, schema=schema, message_encoding="cdr")
