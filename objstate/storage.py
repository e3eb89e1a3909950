"""Files at addresses: paths of this machine, or URLs of any storage that fsspec knows.

What a storage drops for a moment is asked for again; what is read of it is copied to this machine,
once for each process.
"""

from __future__ import annotations

import atexit
import hashlib
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from objstate.errors import LogError, ObjstateError, OutageError
from objstate.outages import causes, outage_of

T = TypeVar("T")

ATTEMPTS = 4  # at a storage that drops a request
PAUSE = 0.5  # s before the second; each later one waits twice as long
MESH = re.compile(r'filename\s*=\s*"([^":]+)"')  # relative, in a URDF
SIDECARS = (".building.yaml",)  # beside a URDF, which need not be there

# Exceptions of the packages that fsspec may use, which objstate doesn't import; by their names.
TRANSIENT = {
    "ClientConnectionError",
    "ClientPayloadError",
    "ConnectTimeoutError",
    "EndpointConnectionError",
    "HTTPClientError",
    "HttpError",
    "ServiceRequestError",
}
NO_CREDENTIALS = {"NoCredentialsError", "PartialCredentialsError", "DefaultCredentialsError"}
SERVER_ERRORS = range(500, 600)  # statuses of HTTP


def is_remote(address: str) -> bool:
    """Whether an address is a URL rather than a path."""
    return "://" in address


def joined(base: str, name: str) -> str:
    """The address of ``name``, which may be relative to the folder ``base``."""
    if is_remote(name):
        return name
    return f"{base.rstrip('/')}/{name}" if is_remote(base) else str(Path(base) / name)


def parent(address: str) -> str:
    """The address of the folder that a file lies in."""
    return address.rpartition("/")[0] if is_remote(address) else str(Path(address).parent)


def here(address: str) -> Path:
    """A file as one of this machine: itself, or a copy that lasts as long as the process.

    Raises LogError where there is none, and OutageError where its storage is out of reach.
    """
    return _copied(address) if is_remote(address) else Path(address)


def building_here(address: str) -> Path:
    """A URDF as one of this machine, with its sidecar and the meshes that lie below its folder."""
    path = here(address)
    if is_remote(address):
        text = path.read_text(encoding="utf-8", errors="replace")
        stem = address.rsplit("/", 1)[-1].rpartition(".")[0]
        for name in MESH.findall(text):
            _copied_beside(path, address, name, needed=True)
        for ending in SIDECARS:
            _copied_beside(path, address, stem + ending, needed=False)
    return path


@cache
def _copied(address: str) -> Path:
    folder = _copies() / hashlib.sha256(address.encode()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / address.rstrip("/").rsplit("/", 1)[-1]
    get(address, target)
    return target


def _copied_beside(path: Path, address: str, name: str, *, needed: bool) -> None:
    target = path.parent / name
    if not target.resolve().is_relative_to(path.parent.resolve()) or target.exists():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        get(joined(parent(address), name), target)
    except LogError:
        if needed:
            raise


@cache
def _copies() -> Path:
    folder = tempfile.mkdtemp(prefix="objstate-copies-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def get(address: str, target: Path) -> None:
    """Copy a remote file, or a folder of them, to ``target``. Raises LogError and OutageError."""

    def fetch() -> None:
        files, path = opened(address)
        files.get(path, str(target), recursive=files.isdir(path))

    retried(fetch, f"Can't fetch {address}")


def put(source: Path, address: str) -> None:
    """Copy a file of this machine to a URL, in the place of an older one. Raises OutageError."""

    def send() -> None:
        files, path = opened(address)
        files.put_file(str(source), path)

    retried(send, f"Can't write {address}")


def remove(address: str) -> None:
    """Remove a remote file, if it is there. Raises OutageError."""

    def drop() -> None:
        files, path = opened(address)
        if files.exists(path):
            files.rm_file(path)

    retried(drop, f"Can't remove {address}")


def listed(address: str) -> list[str]:
    """Names of the files right in a remote folder; none where there is no such folder."""

    def look() -> list[str]:
        files, path = opened(address)
        files.invalidate_cache()
        try:
            found = files.ls(path, detail=False)
        except FileNotFoundError:
            return []
        return sorted(str(each).rstrip("/").rsplit("/", 1)[-1] for each in found)

    return retried(look, f"Can't reach {address}")


@cache
def listed_sizes(address: str) -> dict[str, int]:
    """Bytes of the files right in a remote folder, by name, as listed; none where it can't be listed."""
    try:
        files, path = opened(address)
        found = files.ls(path, detail=True)
    except Exception:  # a server may have files, and no list of them
        return {}
    return {str(each["name"]).rsplit("/", 1)[-1]: int(each.get("size") or 0) for each in found}


def exists(address: str) -> bool:
    """Whether there is a remote file. Raises OutageError."""

    def look() -> bool:
        files, path = opened(address)
        files.invalidate_cache()
        return bool(files.isfile(path))

    return retried(look, f"Can't reach {address}")


def retried(do: Callable[[], T], what: str) -> T:
    """Do it, again where a storage drops it. Raises LogError, and OutageError after the last attempt."""
    for attempt in range(1, ATTEMPTS):
        try:
            with told(what):
                return do()
        except OutageError as error:
            if not error.transient:
                raise
        time.sleep(PAUSE * 2 ** (attempt - 1))
    with told(what):
        return do()


@contextmanager
def told(what: str) -> Iterator[None]:
    """Turn what a storage raises, each in its own way, into LogError or OutageError."""
    try:
        yield
    except ObjstateError:
        raise
    except Exception as error:
        chain = list(causes(error))
        names = {kind.__name__ for each in chain for kind in type(each).__mro__}
        outage = outage_of(error)
        transient = (
            bool(names & TRANSIENT)
            or any(isinstance(each, TimeoutError | ConnectionError) for each in chain)
            or getattr(error, "status", None) in SERVER_ERRORS
            or (outage is not None and outage.transient)
        )
        is_missing = isinstance(error, FileNotFoundError) and len(chain) == 1
        reason = "there is nothing" if is_missing else f"{type(chain[-1]).__name__}: {chain[-1]}"
        if transient or outage is not None or names & NO_CREDENTIALS:
            raise OutageError(f"{what}: {reason}.", transient) from error
        raise LogError(f"{what}: {reason}.") from error


def opened(address: str) -> tuple[Any, str]:
    """The file system of a URL, and the path in it. Raises LogError and OutageError."""
    try:
        from fsspec.core import url_to_fs

        files, path = url_to_fs(address)
    except ImportError as error:
        raise OutageError(
            f"{address} can't be reached without a package: {error}. For fsspec itself, "
            "pip install 'objstate[cluster]'."
        ) from error
    except ValueError as error:
        raise LogError(f"{address} can't be reached: {error}.") from error
    return files, path
