"""A service from its start to its end."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import uvicorn

from objstate.errors import SettingsError
from objstate.service.app import service_app
from objstate.service.options import ServiceOptions
from objstate.service.parts import Parts
from objstate.service.tokens import Role

FIRST = "first"  # the name of the token that is made at the first start
WAITING = 2048  # connections that may wait to be accepted
PATIENCE_S = 3  # for listeners to leave at the end


def run_service(options: ServiceOptions, on_ready: Callable[[str, str | None], None]) -> None:
    """Serve until interrupted; ``on_ready`` is told the address, and the first token if it is new.

    Raises SettingsError where it can't listen or a file can't be written, BuildingError, WorldError.
    """
    parts = Parts(options)
    secret = _first_token(parts, options.token_file)
    listening = _listening(options)
    with listening:
        scheme = "http" if options.tls_certificate is None else "https"
        host = f"[{options.host}]" if ":" in options.host else options.host
        on_ready(f"{scheme}://{host}:{listening.getsockname()[1]}/", secret)
        config = uvicorn.Config(
            service_app(parts),
            log_level="warning",
            access_log=False,
            server_header=False,
            proxy_headers=options.behind_proxy,
            timeout_graceful_shutdown=PATIENCE_S,
            ssl_certfile=options.tls_certificate,
            ssl_keyfile=options.tls_key,
        )
        uvicorn.Server(config).run(sockets=[listening])


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


def _first_token(parts: Parts, file: Path | None) -> str | None:
    """The secret of a token for everything, made at the first start; None at later ones.

    Where a file was given that is missing, a new one is made, so that who deletes the file can start again.
    """
    known = [token for token in parts.tokens.all() if token.revoked_ns is None]
    if known and (file is None or file.exists()):
        return None
    token, secret = parts.tokens.make(FIRST, Role.ADMIN)
    if file is None:
        return secret
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as writing:
            os.fchmod(writing.fileno(), 0o600)
            writing.write(secret + "\n")
    except OSError as error:
        parts.tokens.revoke(token.id)
        raise SettingsError(f"Can't write the token to {file} ({error}); give another.") from error
    return secret
