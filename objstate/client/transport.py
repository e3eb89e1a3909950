"""What both clients do alike: addresses, headers, answers, errors, and logs to send."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from objstate.archives import zip_folder
from objstate.client.questions import Answered, Question
from objstate.errors import LogError, OutageError, ServiceError, SettingsError

TIMEOUT_S = 30.0  # for an answer
SILENCE_S = 60.0  # after which a stream counts as broken; a service says something every 15 s
PAUSE_S = 1.0  # before a broken stream, or a service that is gone, is tried again
CHUNK = 2**20  # bytes of a log that are sent at once
PASSING = (429, 503)  # statuses after which a stream is asked for again
DIGEST = "X-SHA256"  # header: of the log
RESUME = "Last-Event-ID"


def options(url: str, token: str | Path, timeout_s: float) -> dict[str, Any]:
    """Arguments of an ``httpx`` client. Raises SettingsError."""
    if not url.startswith(("http://", "https://")):
        raise SettingsError(f"'{url}' is no address of a service; give http://HOST:PORT.")
    secret = _read_token(token) if isinstance(token, Path) else token
    return {
        "base_url": url,
        "headers": {"Authorization": f"Bearer {secret}"},
        "timeout": timeout_s,
    }


def arguments(question: Question[Any]) -> dict[str, Any]:
    """Arguments of a request."""
    told = {"method": question.method, "url": question.path, "params": dict(question.params)}
    return told if question.body is None else told | {"json": question.body}


def answer_of(response: httpx.Response, question: Question[Answered]) -> Answered:
    """What a service answered. Raises ServiceError."""
    check(response)
    return question.read(response.json() if response.content else None)


def check(response: httpx.Response) -> None:
    """Raises ServiceError where a service refused."""
    if response.is_success:
        return
    problem = _problem(response)
    detail = str(problem.get("detail", response.reason_phrase))
    cure = str(problem.get("cure", ""))
    asked = f"{response.request.method} {response.request.url.path}"
    raise ServiceError(f"{asked}: {detail} {cure}".strip(), response.status_code, detail, cure)


def unreachable(error: httpx.TransportError, url: httpx.URL) -> OutageError:
    """A service that doesn't answer, in words."""
    reason = str(error) or type(error).__name__
    return OutageError(f"The service at {url} doesn't answer ({reason}); is it running?", True)


@contextmanager
def one_file(log: str | Path) -> Iterator[tuple[Path, str]]:
    """A log as one file, a bag's folder zipped, and its SHA-256. Raises LogError."""
    path = Path(log)
    if not path.exists():
        raise LogError(f"There is no log at {path}; check the path.")
    with tempfile.TemporaryDirectory() as folder:
        file = path
        if path.is_dir():
            file = Path(folder) / "bag.zip"
            zip_folder(path, file)
        with file.open("rb") as content:
            digest = hashlib.file_digest(content, "sha256").hexdigest()
        yield file, digest


def _read_token(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError as error:
        raise SettingsError(
            f"The token can't be read from {file}: {error.strerror}; give the --token-file of the service."
        ) from error


def _problem(response: httpx.Response) -> Mapping[str, Any]:
    try:
        told = response.json()
    except ValueError:
        return {}
    return told if isinstance(told, dict) else {}
