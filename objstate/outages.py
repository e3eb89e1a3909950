"""Failures independent of the input: which errors are such, and what cures them."""

from __future__ import annotations

import errno
import os
import re
import sqlite3
from collections.abc import Iterator

from objstate.errors import ObjstateError, OutageError

FREE, ELSEWHERE, LATER = "free some space", "choose another place", "try again later"
CURES = {
    errno.ENOSPC: FREE,
    errno.EDQUOT: FREE,
    errno.EROFS: ELSEWHERE,
    errno.EFBIG: "raise `ulimit -f`, or choose another file system",
    errno.EMFILE: "raise `ulimit -n`",
    errno.ENFILE: "close other programs",
    errno.ESTALE: LATER,
    errno.ETIMEDOUT: LATER,
    errno.ENOTCONN: LATER,
    errno.ENOLINK: LATER,
    errno.ECONNREFUSED: LATER,
    errno.ECONNRESET: LATER,
    errno.ECONNABORTED: LATER,
    errno.EHOSTDOWN: LATER,
    errno.EHOSTUNREACH: LATER,
    errno.ENETDOWN: LATER,
    errno.ENETUNREACH: LATER,
    errno.ENETRESET: LATER,
}
TRANSIENT = frozenset(code for code, cure in CURES.items() if cure == LATER)

OF_SQLITE = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_IOERR_WRITE: errno.EIO,
    sqlite3.SQLITE_IOERR_FSYNC: errno.EIO,
    sqlite3.SQLITE_IOERR_TRUNCATE: errno.EIO,
}

NUMBER = re.compile(r"\(os error (\d+)\)")  # as polars, which is written in Rust, reports it


def outage_of(error: BaseException) -> OutageError | None:
    """The outage that an error or one of its causes reports; None if there is none."""
    for each in causes(error):
        if isinstance(each, OutageError):
            return each
        code = code_of(each)
        if code in CURES:
            return OutageError(_told(error, each, code), code in TRANSIENT)
    return None


def _told(error: BaseException, origin: BaseException, code: int) -> str:
    """An outage in words, with the place if it is known."""
    if isinstance(error, ObjstateError):
        return f"{str(error).rstrip('.')}; {CURES[code]}."
    name = getattr(origin, "filename", None)
    place = "" if name is None else f"{name}: "
    return f"{place}{os.strerror(code)}; {CURES[code]}."


def code_of(error: BaseException) -> int | None:
    """The system's error number; None where there is none."""
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno
    if isinstance(error, sqlite3.Error):
        return OF_SQLITE.get(getattr(error, "sqlite_errorcode", 0))
    told = NUMBER.search(str(error))
    return None if told is None else int(told.group(1))


def causes(error: BaseException) -> Iterator[BaseException]:
    """An error, and those that it was raised from."""
    cause: BaseException | None = error
    while cause is not None:
        yield cause
        cause = cause.__cause__
