"""Outputs are written whole or not at all, and durably.

Every output is made in a hidden workshop beside its target, flushed to the disk, and moved into
place in one step at the very end. So a crash, a full disk or Ctrl-C leaves neither half an output
nor a damaged old one. Nothing else in objstate renames, replaces or removes users' files.

A workshop is locked as long as its process lives. One left behind by a killed process is removed by
the next output beside it.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import re
import secrets
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from objstate.errors import ObjstateError, ResultError, StorageError
from objstate.outages import CURES, ELSEWHERE, TRANSIENT, causes, code_of, outage_of

WORKSHOP = ".objstate-"  # prefix of workshops' names
# in a workshop: what is being made, and what is being replaced
LOCK, NEW, OLD = "lock", "new", "old"

SWEEPING_S = 0.2  # s for which a sweep may hold a workshop
PROBE, PROBE_SIZE = "probe", 2**20  # bytes; a disk without this much space counts as full

URL = re.compile(r"[a-z][a-z0-9+.-]+:/", re.IGNORECASE)  # also one from which Path removed a slash

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # constants of Linux
# errors of file systems that don't support it
NO_EXCHANGE = {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EPERM, errno.EXDEV}
WRITING = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG}  # only writers meet these
NO_FSYNC = {errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES}  # of folders, on some storages


def is_url(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a URL, such as ``s3://bucket/drive.mcap``."""
    return URL.match(str(path)) is not None


def as_url(path: str | os.PathLike[str]) -> str:
    """A URL with both slashes, of which ``Path`` removes one."""
    return re.sub(r"^([^/:]+):/+", r"\1://", str(path))


def check_free(
    path: str | Path, *, overwrite: bool = False, replaceable: Callable[[Path], bool] = Path.is_file
) -> Path:
    """The absolute path, if ``whole`` may write it; to ask before long work. Raises ResultError."""
    refuse_url(path)
    target = Path(path).absolute()
    _refuse_what_exists(target, overwrite, replaceable)
    return target


@contextmanager
def whole(
    path: str | Path, *, overwrite: bool = False, replaceable: Callable[[Path], bool] = Path.is_file
) -> Iterator[Path]:
    """A path of the same name in a workshop; its content becomes ``path`` at the end.

    For a file or a folder. ``replaceable`` says whether an existing target may be replaced when
    ``overwrite`` is set; it stays until the new one is complete. Raises ResultError, and
    StorageError for a full disk and the like.
    """
    target = check_free(path, overwrite=overwrite, replaceable=replaceable)
    with _open_workshop(target.parent) as workshop:
        try:
            yield workshop / NEW / target.name
            _refuse_what_exists(target, overwrite, replaceable)  # it may have appeared meanwhile
            _flush(workshop / NEW)
            _replace(workshop / NEW / target.name, target, aside=workshop / OLD)
            flush_folder(target.parent)
        except Exception as error:
            trouble = _trouble(error, workshop, target)
            if trouble is error:
                raise
            raise trouble from error


@contextmanager
def claimed(path: str | Path) -> Iterator[None]:
    """Hold an output from before the long work that makes it, also what it already holds.

    Raises ResultError where another process holds it, and StorageError.
    """
    refuse_url(path)
    target = Path(path).absolute()
    make_folder(target.parent)
    sweep(target.parent)
    workshop = target.parent / f"{WORKSHOP}{target.name}"
    try:
        descriptor = _claim(workshop)
    except BlockingIOError as error:
        raise ResultError(
            f"Another process is writing {target} now; wait until it is done, or choose another "
            "name."
        ) from error
    except OSError as error:
        raise _unwritable(target.parent, error.errno or 0) from error
    try:
        yield
    finally:
        _clear(workshop)
        os.close(descriptor)


def write_text(path: str | Path, text: str) -> None:
    """Write a file whole, replacing an older one. Raises ResultError.

    A link, a pipe or a device, such as ``/dev/stdout``, is written to directly.
    """
    target = Path(path)
    if target.is_symlink() or (target.exists() and not target.is_file()):
        try:
            target.write_text(text, encoding="utf-8")
        except OSError as error:
            raise _unwritable(target, error.errno or 0) from error
        return
    with whole(target, overwrite=True) as file:
        file.write_text(text, encoding="utf-8")


def make_folder(path: Path) -> None:
    """Make a folder and its parents durably. Raises StorageError."""
    refuse_url(path)
    missing = [each for each in (path, *path.parents) if not each.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        for each in missing:
            flush_folder(each.parent)
    except OSError as error:
        raise _unwritable(path, error.errno or 0) from error


def remove_file(path: Path) -> None:
    """Remove a file, if it is there. Raises StorageError."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise _unwritable(path, error.errno or 0) from error


def remove_folder(path: Path) -> None:
    """Remove a folder with all in it, if it is there. Raises StorageError."""
    try:
        if path.exists():
            shutil.rmtree(path)
    except OSError as error:
        raise _unwritable(path, error.errno or 0) from error


def sweep(folder: Path) -> None:
    """Remove the workshops in a folder whose processes are gone; restore what they replaced."""
    for workshop in folder.glob(f"{WORKSHOP}*"):
        with suppress(OSError):  # it is in use, or this file system has no locks
            descriptor = _locked(workshop, os.O_RDWR)
            try:
                for old in (workshop / OLD).glob("*"):
                    if not (folder / old.name).exists():
                        old.rename(folder / old.name)
                _clear(workshop)
            finally:
                os.close(descriptor)


def refuse_url(path: str | Path) -> None:
    """Raise ResultError for an output at a URL."""
    if is_url(path):
        raise ResultError(
            f"{as_url(path)} is a URL, and results are written to folders of this machine only; "
            "give a folder, and copy it there afterwards, or mount the storage."
        )


def flush_folder(folder: Path) -> None:
    """Flush a folder's list of files to the disk."""
    try:
        _flush_one(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        if error.errno not in NO_FSYNC:
            raise


def _refuse_what_exists(target: Path, overwrite: bool, replaceable: Callable[[Path], bool]) -> None:
    if not (target.exists() or target.is_symlink()):
        return
    if not overwrite:
        raise ResultError(
            f"{target} exists already; choose another name, or overwrite it (--overwrite)."
        )
    if target.is_symlink() or not replaceable(target):
        raise ResultError(
            f"{target} is not a result of objstate, so it won't be overwritten; "
            "choose another name, or move it away."
        )


@contextmanager
def _open_workshop(parent: Path) -> Iterator[Path]:
    """A new workshop in a folder, which is created if missing. Raises StorageError."""
    make_folder(parent)
    sweep(parent)
    try:
        workshop, descriptor = _new_workshop(parent)
    except OSError as error:
        raise _unwritable(parent, error.errno or 0) from error
    try:
        yield workshop
    finally:
        _clear(workshop)
        os.close(descriptor)


def _new_workshop(parent: Path) -> tuple[Path, int]:
    """A workshop and the descriptor that holds its lock. Raises OSError."""
    while True:
        workshop = parent / f"{WORKSHOP}{secrets.token_hex(4)}"
        workshop.mkdir()
        try:
            descriptor = _locked(workshop, os.O_RDWR | os.O_CREAT)
            (workshop / NEW).mkdir()
        except (BlockingIOError, FileNotFoundError):
            continue  # removed by another process before it was locked
        except BaseException:
            _clear(workshop)
            raise
        else:
            return workshop, descriptor


def _claim(workshop: Path) -> int:
    """Hold the lock of a workshop that may be there already. Raises OSError."""
    until = time.monotonic() + SWEEPING_S
    while True:
        workshop.mkdir(exist_ok=True)
        try:
            return _locked(workshop, os.O_RDWR | os.O_CREAT)
        except FileNotFoundError:
            continue  # its last holder removed it just now
        except BlockingIOError:
            if time.monotonic() > until:
                raise
            time.sleep(SWEEPING_S / 10)


def _clear(workshop: Path) -> None:
    """Remove a workshop as far as possible; its lock goes last, so that the rest can be swept."""
    for part in (NEW, OLD):
        shutil.rmtree(workshop / part, ignore_errors=True)
    with suppress(OSError):
        if not any((workshop / part).exists() for part in (NEW, OLD)):
            (workshop / LOCK).unlink(missing_ok=True)
            workshop.rmdir()


def _locked(workshop: Path, flags: int) -> int:
    """Hold the lock of a workshop; its descriptor. Raises OSError where another process does."""
    try:
        descriptor = os.open(workshop / LOCK, flags, 0o644)
    except FileNotFoundError:
        if not flags & os.O_CREAT:
            workshop.rmdir()  # killed before there was a lock
        raise
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.stat(workshop / LOCK).st_ino != os.fstat(descriptor).st_ino:
            raise FileNotFoundError(errno.ENOENT, "removed meanwhile", str(workshop))
    except OSError as error:
        # where there are no locks, a workshop is made but never swept
        if isinstance(error, BlockingIOError | FileNotFoundError) or not flags & os.O_CREAT:
            os.close(descriptor)
            raise
    return descriptor


def _flush(path: Path) -> None:
    """Flush a file, or a folder with its content, to the disk."""
    for folder, _, names in os.walk(path):
        for name in names:
            _flush_one(Path(folder, name), os.O_RDONLY)
        flush_folder(Path(folder))


def _flush_one(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        os.close(descriptor)


def _replace(made: Path, target: Path, aside: Path) -> None:
    """Put ``made`` in the place of ``target``, in one step wherever the file system can."""
    if not (target.is_dir() or (made.is_dir() and target.exists())):
        os.replace(made, target)
    elif not _exchange(made, target):
        aside.mkdir()
        target.rename(aside / target.name)  # if killed after this, the next sweep restores it
        try:
            made.rename(target)
        except OSError:
            (aside / target.name).rename(target)
            raise


def _exchange(one: Path, other: Path) -> bool:
    """Swap two folders in one step; False where the system or the file system can't."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError):
        return False
    names = (os.fsencode(one), os.fsencode(other))
    if rename(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in NO_EXCHANGE:
        return False
    raise OSError(code, os.strerror(code), str(other))


def _trouble(error: Exception, workshop: Path, target: Path) -> Exception:
    """The exception to raise: the outage that prevented ``target``, if it was one."""
    outage = outage_of(error)
    if isinstance(error, ObjstateError) and str(workshop) not in str(error):
        return outage or error
    for each in causes(error):
        code = code_of(each)
        if code is not None and (str(workshop) in str(each) or _is_writing(each, code)):
            return _unwritable(target, code)
    told = None if outage is not None else _refusal(error, workshop)
    return outage or (error if told is None else _unwritable(target, told))


def _refusal(error: Exception, workshop: Path) -> int | None:
    """The system's error where polars doesn't report it, as when a footer can't be written."""
    if not type(error).__module__.startswith("polars"):
        return None
    try:
        (workshop / NEW / PROBE).write_bytes(bytes(PROBE_SIZE))
        _flush_one(workshop / NEW / PROBE, os.O_RDONLY)
    except OSError as refusal:
        return refusal.errno
    return None


def _is_writing(error: BaseException, code: int) -> bool:
    """Whether an error without a place is one of writing, which must have happened here."""
    is_unplaced = getattr(error, "filename", None) is None
    return is_unplaced and (code in WRITING or isinstance(error, sqlite3.Error))


def _unwritable(place: Path, code: int) -> StorageError:
    cure = CURES.get(code, ELSEWHERE)
    transient = code in TRANSIENT or code == errno.EIO
    return StorageError(f"Can't write {place}: {os.strerror(code)}; {cure}.", transient)
