"""What an operator may say of a service."""

from __future__ import annotations

from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path

from objstate.errors import SettingsError
from objstate.run.options import RunOptions
from objstate.service.live.options import LiveLimits, RobotAddress
from objstate.world.location import parse_location

GIGABYTE = 10**9


@dataclass(frozen=True)
class ServiceOptions:
    """Where a service listens, what it keeps and how much it takes."""

    building: Path  # URDF
    world: str  # a file, or a PostgreSQL URL
    data: Path  # folder of logs and results
    new_data: bool = False  # whether that takes the place of one that is lost
    host: str = "127.0.0.1"
    port: int = 8000  # 0 takes a free one
    token_file: Path | None = None  # where the first token is written
    tls_certificate: Path | None = None
    tls_key: Path | None = None
    behind_proxy: bool = False  # something in front of it does TLS
    largest_log: int = 4 * GIGABYTE  # bytes of one upload
    time_limit_s: float = 3600.0  # for the estimation of one drive
    memory_limit: int = 4 * GIGABYTE  # bytes of the process that reads a log
    requests_per_s: float = 1000.0  # of one token
    scenes: bool = False  # whether drives are recorded as scenes for Foxglove
    robots: tuple[RobotAddress, ...] = ()  # that are connected to
    watched: tuple[str, ...] = ()  # folders and URLs where logs are dropped
    foxglove_port: int | None = None  # of a server that shows live drives; 0 takes a free one
    live: LiveLimits = field(default_factory=LiveLimits)
    workers: int = 1  # processes that answer
    run: RunOptions = field(default_factory=RunOptions)

    def check(self) -> None:
        """Raises SettingsError where others could listen in, or half of a pair is missing."""
        if (self.tls_certificate is None) != (self.tls_key is None):
            raise SettingsError("Give --tls-cert and --tls-key both.")
        if self.is_open and self.tls_certificate is None and not self.behind_proxy:
            raise SettingsError(
                f"On {self.host} others could read the tokens: give --tls-cert and --tls-key, or "
                "--behind-proxy if a proxy in front does TLS, or listen on 127.0.0.1."
            )

    @property
    def is_open(self) -> bool:
        """Whether other machines can reach it."""
        if self.host == "localhost":
            return False
        try:
            return not ip_address(self.host).is_loopback
        except ValueError:
            return True


def data_folder(world: str) -> Path:
    """The folder beside a world's file; in the working folder for a world on a server."""
    location = parse_location(world)
    if location.file is not None:
        return Path(f"{world}.data")
    parts = [str(location.url.database), *([location.schema] if location.schema else []), "data"]
    return Path(".".join(parts))
