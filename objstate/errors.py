"""The exception tree: every error that a user can cause, in one place.

A message says what is wrong, where, and what cures it. Only the command line turns an error into an
exit code.
"""

from __future__ import annotations


class ObjstateError(Exception):
    """Any error caused by the input or the settings, described in full by its message."""


class LogError(ObjstateError):
    """A recorded log can't be used: unreadable, empty, or without what is needed."""


class BuildingError(ObjstateError):
    """A building, a map or a door table is missing, malformed or contradicts itself."""


class SettingsError(ObjstateError):
    """A setting, a scene or a command-line value is unknown, mistyped or out of range."""


class TruthError(ObjstateError):
    """A table of true states or a true path can't be used."""


class ResultError(ObjstateError):
    """A result folder exists already, can't be written, or isn't one."""


class OutageError(ObjstateError):
    """A failure independent of the input, such as a full disk; the same may work later."""

    def __init__(self, message: str, transient: bool = False) -> None:
        super().__init__(message)
        self.transient = transient  # it may pass within seconds, so that retrying is worthwhile

    def __reduce__(self) -> tuple[type[OutageError], tuple[str, bool]]:
        return type(self), (str(self), self.transient)


class StorageError(ResultError, OutageError):
    """A result can't be written to its place."""


class PlatformError(ObjstateError):
    """The machine lacks something that is needed."""


class WorldError(ObjstateError):
    """A world can't be opened or written, is of another building, or has no such object."""


class QueryError(WorldError):
    """A question about a world has no answer, as of an unknown object or a width below zero."""


class GridError(ObjstateError):
    """An occupancy grid can't be laid out, drawn into or merged as asked."""


class ServiceError(ObjstateError):
    """A service refused a request: what, and the cure, as its problem document says."""

    def __init__(self, message: str, status: int, detail: str = "", cure: str = "") -> None:
        super().__init__(message)
        self.status = status  # of HTTP
        self.detail = detail
        self.cure = cure

    def __reduce__(self) -> tuple[type[ServiceError], tuple[str, int, str, str]]:
        return type(self), (str(self), self.status, self.detail, self.cure)
