"""What is saved, and whether a page shows it: changes of one that doesn't are refused."""

from __future__ import annotations

import hashlib
from pathlib import Path

from objstate.editing.rows import Edits
from objstate.editing.saving import save
from objstate.editing.subject import Subject
from objstate.errors import BuildingError


class StaleError(BuildingError):
    """A change was made of a state that is no longer the saved one."""


class Session:
    """A subject as it was saved last, by this process or another.

    A state is known by its revision, a digest of the folder that it is saved to.
    """

    def __init__(self, subject: Subject) -> None:
        self._subject, self._revision = subject, _revision(subject.out)

    def current(self) -> tuple[Subject, str]:
        """What is saved, and its revision; read again if another process has written it.

        Raises BuildingError where it can't be read.
        """
        revision = _revision(self._subject.out)
        if revision != self._revision:
            self._subject = self._subject.read_again()
            self._revision = revision
        return self._subject, revision

    def save(self, edits: Edits, revision: str) -> tuple[Subject, str]:
        """Save what was edited of a revision; what is saved then, and its revision.

        Raises StaleError where that isn't the saved one, and whatever ``save`` raises.
        """
        subject, saved = self.current()
        if revision != saved:
            raise StaleError(
                "Not saved: the doors were changed elsewhere since this page was loaded; reload it "
                "to see them."
            )
        self._subject = save(subject, edits)
        self._revision = _revision(subject.out)
        return self._subject, self._revision


def _revision(folder: Path) -> str:
    """SHA-256 of the names and contents of a folder's files; of nothing where there is none."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*")):
        if path.is_file():
            digest.update(f"{path.name}\0{path.stat().st_size}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()
