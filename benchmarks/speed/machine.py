"""On what, and with what, figures were measured."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

LIBRARIES = ("numpy", "numba", "embreex")


def circumstances() -> str:
    """Date, commit, machine, load and versions, as a paragraph."""
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    return (
        f"Measured on {datetime.now(UTC):%Y-%m-%d} at commit {_commit()} on {os.cpu_count()} cores of "
        f"{_processor()}, no GPU, {_memory()} GB of memory, {platform.system()}, Python "
        f"{platform.python_version()}, {libraries}. The load at the start was "
        f"{os.getloadavg()[0]:.1f} processes."
    )


def _commit() -> str:
    asked = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    return asked.stdout.strip() or "unknown"


def _processor() -> str:
    names = _field(Path("/proc/cpuinfo"), "model name")
    return f"an {names}" if names else platform.machine()


def _memory() -> str:
    kilobytes = _field(Path("/proc/meminfo"), "MemTotal").split(" ")[0]
    return f"{int(kilobytes) / 1024**2:.0f}" if kilobytes else "an unknown number of"


def _field(file: Path, name: str) -> str:
    """The first value of a name in one of Linux's tables; empty where there is none."""
    if not file.is_file():
        return ""
    for line in file.read_text(encoding="utf-8").splitlines():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return ""
