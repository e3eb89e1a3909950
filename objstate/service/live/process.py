"""The process of a live drive, seen from the service: it can die without harm to anybody else."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from multiprocessing import Pipe
from typing import Any

from objstate.batch.process import SINGLE_THREADED
from objstate.logs import Message
from objstate.logs.definitions import MessageType
from objstate.service.live.options import LiveContext

logger = logging.getLogger(__name__)

Said = Callable[[str, Any], None]  # kind, what


class LiveProcess:
    """Takes messages, and says what follows from them, from a thread of its own."""

    def __init__(
        self, context: LiveContext, types: Mapping[str, MessageType], name: str, said: Said
    ) -> None:
        ours, theirs = Pipe()
        command = [sys.executable, "-P", "-m", "objstate.service.live.worker"]
        self._process = subprocess.Popen(
            [*command, str(theirs.fileno())],
            env=os.environ | SINGLE_THREADED,
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the service
        )
        theirs.close()
        self._connection, self._said, self._types = ours, said, dict(types)
        self._connection.send((context, self._types, name))
        self._listener = threading.Thread(target=self._listen, name=f"live {name}", daemon=True)
        self._listener.start()

    def put(self, message: Message) -> None:
        """Hand a message on; it is lost where the process has died, which is said."""
        known, kind = self._types.get(message.topic), message.message_type
        if known is not None and (known.name, known.wire) == (kind.name, kind.wire):
            self._send((message.topic, message.recorded_ns, message.data))

    def finish(self) -> None:
        """No more messages will come."""
        self._send(None)

    def end(self) -> None:
        """Stop it, whatever it is doing."""
        self._said = lambda *_: None
        self._process.kill()
        self._process.wait()
        self._listener.join()

    def _send(self, what: Any) -> None:
        try:
            self._connection.send(what)
        except OSError:
            logger.debug("the process of a live drive has ended")

    def _listen(self) -> None:
        is_said = False
        try:
            while True:
                kind, what = self._connection.recv()
                is_said = kind in ("ended", "failed", "over")
                self._said(kind, what)
        except (EOFError, OSError):
            if not is_said:
                self._said("failed", f"Its process ended with exit code {self._process.wait()}.")
