"""Of several processes of one service, the one that estimates and follows robots.

All of them answer. The first that locks a file in the data folder leads; when it ends, however it
does, the system frees the lock, and another one takes over.
"""

from __future__ import annotations

import fcntl
import hashlib
import tempfile
from pathlib import Path
from typing import BinaryIO

LOCK, SOCKET = "leader.lock", "objstate-{}.sock"


class Leadership:
    """Whether this process leads."""

    def __init__(self, folder: Path) -> None:
        # at which the leader is asked by the others; the paths of sockets must be short
        name = hashlib.sha256(str(folder.absolute()).encode()).hexdigest()[:16]
        self.socket = Path(tempfile.gettempdir()) / SOCKET.format(name)
        self._path = folder / LOCK
        self._file: BinaryIO | None = None

    @property
    def is_ours(self) -> bool:
        return self._file is not None

    def taken(self) -> bool:
        """Try to lead; whether this process does now."""
        if self._file is None:
            file = self._path.open("ab")
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                file.close()
                return False
            self._file = file
        return True

    def end(self) -> None:
        """Let another process lead."""
        if self._file is not None:
            self.socket.unlink(missing_ok=True)
            self._file.close()
            self._file = None
