"""Who may ask what: tokens with a role, of which only hashes are kept."""

from __future__ import annotations

import hashlib
import secrets
import time
from dataclasses import dataclass
from enum import Enum

from sqlalchemy import insert, select, update

from objstate.errors import SettingsError
from objstate.service.tables import TOKENS
from objstate.world.database import Database

PREFIX = "objstate_"
BYTES = 32  # of chance in a token: too many to guess, so that a plain hash keeps it safe
REMEMBERED_S = 1.0  # for which a token isn't looked up again


class Role(Enum):
    """What a token allows; each role allows what the ones before it do."""

    READ = "read"
    TEACH = "teach"  # send drives and evidence
    ADMIN = "admin"  # delete

    def allows(self, other: Role) -> bool:
        """Whether it may do what another role may."""
        order = list(Role)
        return order.index(self) >= order.index(other)


@dataclass(frozen=True)
class Token:
    """What is known of a token."""

    id: str
    name: str
    role: Role
    made_ns: int
    revoked_ns: int | None


class Tokens:
    """The tokens of a service."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._remembered: dict[str, tuple[float, Token | None]] = {}

    def make(self, name: str, role: Role) -> tuple[Token, str]:
        """A new token, and its secret, which can't be had again. Raises WorldError."""
        secret = PREFIX + secrets.token_urlsafe(BYTES)
        token = Token(secrets.token_hex(4), name, role, time.time_ns(), None)
        row = {"digest": _digest(secret), "name": name, "role": role.value}
        with self._database.writing() as connection:
            connection.execute(insert(TOKENS).values(id=token.id, made_ns=token.made_ns, **row))
        return token, secret

    def all(self) -> list[Token]:
        """All tokens, the oldest first. Raises WorldError."""
        c = TOKENS.c
        query = select(c.id, c.name, c.role, c.made_ns, c.revoked_ns).order_by(c.made_ns, c.id)
        with self._database.reading() as connection:
            rows = connection.execute(query).all()
        return [Token(row[0], row[1], Role(row[2]), row[3], row[4]) for row in rows]

    def revoke(self, identity: str) -> None:
        """Let a token open nothing any more. Raises SettingsError for an unknown one, WorldError."""
        change = update(TOKENS).where(TOKENS.c.id == identity, TOKENS.c.revoked_ns.is_(None))
        with self._database.writing() as connection:
            changed = connection.execute(change.values(revoked_ns=time.time_ns())).rowcount
        self._remembered.clear()
        if not changed:
            raise SettingsError(
                f"No token in use is '{identity}'; see `objstate serve token list`."
            )

    def of(self, secret: str) -> Token | None:
        """The token of a secret, None for one that opens nothing. Raises WorldError."""
        known = self.remembered(secret)
        if known is None:
            digest = _digest(secret)
            known = self._remembered[digest] = time.monotonic(), self._looked_up(digest)
        return known[1]

    def remembered(self, secret: str) -> tuple[float, Token | None] | None:
        """When a secret was looked up, and its token, if that was a moment ago."""
        known = self._remembered.get(_digest(secret))
        is_fresh = known is not None and time.monotonic() - known[0] <= REMEMBERED_S
        return known if is_fresh else None

    def _looked_up(self, digest: str) -> Token | None:
        if len(self._remembered) > 10_000:
            self._remembered.clear()
        c = TOKENS.c
        query = select(c.id, c.name, c.role, c.made_ns, c.revoked_ns)
        with self._database.reading() as connection:
            row = connection.execute(
                query.where(c.digest == digest, c.revoked_ns.is_(None))
            ).one_or_none()
        return None if row is None else Token(row[0], row[1], Role(row[2]), row[3], None)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
