"""A service from its start to its end."""

from __future__ import annotations

import base64
import multiprocessing
import os
import pickle
import signal
import socket
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from uvicorn.supervisors import Multiprocess

from objstate.errors import SettingsError
from objstate.service.app import service_app
from objstate.service.options import ServiceOptions
from objstate.service.parts import Parts
from objstate.service.tokens import Role, Tokens

FIRST = "first"  # the name of the token that is made at the first start
WAITING = 2048  # connections that may wait to be accepted
OPTIONS = "OBJSTATE_SERVICE_OPTIONS"  # variable of the environment, for worker processes
PATIENCE_S = 3  # for listeners to leave at the end


def run_service(options: ServiceOptions, on_ready: Callable[[str, str | None], None]) -> None:
    """Serve until interrupted; ``on_ready`` is told the address, and the first token if it is new.

    Raises SettingsError where it can't listen or a file can't be written, BuildingError, WorldError.
    """
    if options.foxglove_port:
        _listening(replace(options, host="127.0.0.1", port=options.foxglove_port)).close()
    parts = Parts(options)
    secret = _first_token(parts.tokens, options.token_file)
    listening = _listening(options)
    with listening:
        scheme = "http" if options.tls_certificate is None else "https"
        host = f"[{options.host}]" if ":" in options.host else options.host
        on_ready(f"{scheme}://{host}:{listening.getsockname()[1]}/", secret)
        app = service_app(parts) if options.workers == 1 else f"{__name__}:app_of_worker"
        config = uvicorn.Config(
            app,
            factory=options.workers > 1,
            workers=options.workers,
            log_level="warning",
            access_log=False,
            server_header=False,
            proxy_headers=options.behind_proxy,
            timeout_graceful_shutdown=PATIENCE_S,
            ssl_certfile=options.tls_certificate,
            ssl_keyfile=options.tls_key,
        )
        if options.workers == 1:
            uvicorn.Server(config).run(sockets=[listening])
            return
        os.environ[OPTIONS] = base64.b64encode(pickle.dumps(options)).decode()
        Multiprocess(config, sockets=[listening]).run()


def app_of_worker() -> Starlette:
    """The app of one of several processes, which its parent told by the environment."""
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    return service_app(Parts(pickle.loads(base64.b64decode(os.environ[OPTIONS]))))


def _end_with_parent() -> None:
    """Wait for the parent's end, however it comes, and end this process as the parent would."""
    parent = multiprocessing.parent_process()
    assert parent is not None  # a worker has one
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)


def _listening(options: ServiceOptions) -> socket.socket:
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((options.host, options.port))
        listening.listen(WAITING)
    except (OSError, OverflowError) as error:
        listening.close()
        where = f"{options.host}, port {options.port}"
        raise SettingsError(f"Can't listen on {where} ({error}); give another.") from error
    return listening


def _first_token(tokens: Tokens, file: Path | None) -> str | None:
    """The secret of a token for everything, made at the first start; None at later ones.

    Where a file was given that is missing, a new one is made, so that who deletes the file can start again.
    """
    known = [token for token in tokens.all() if token.revoked_ns is None]
    if known and (file is None or file.exists()):
        return None
    token, secret = tokens.make(FIRST, Role.ADMIN)
    if file is None:
        return secret
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as writing:
            os.fchmod(writing.fileno(), 0o600)
            writing.write(secret + "\n")
    except OSError as error:
        tokens.revoke(token.id)
        raise SettingsError(f"Can't write the token to {file} ({error}); give another.") from error
    return secret
