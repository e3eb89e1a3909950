"""Jobs that behave as their names say: what a worker process may meet."""

import errno
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from objstate.batch.process import Report
from objstate.errors import LogError


@dataclass(frozen=True)
class Antic:
    name: str


def play(folder: Path, job: Antic, report: Report) -> None:
    """Do the job; ``folder`` remembers how often each was begun."""
    begun = folder / f"{job.name}.begun"
    before = begun.stat().st_size if begun.exists() else 0
    begun.write_bytes(b"x" * (before + 1))
    report(0.5, 1.0)
    match job.name.rstrip("0123456789"):
        case "fails":
            raise LogError("the log is no log")
        case "hangs":
            time.sleep(600)
        case "straggles" if before < 1:
            time.sleep(600)
        case "stumbles" if before < 2:
            os.kill(os.getpid(), signal.SIGKILL)
        case "crashes":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "meets a full disk":
            raise RuntimeError("as of some library") from OSError(errno.ENOSPC, "No space left")
        case "loses the network" if before < 2:
            raise OSError(errno.ESTALE, "Stale file handle")
        case "never has a network":
            raise OSError(errno.ESTALE, "Stale file handle")
        case "errs":
            raise ZeroDivisionError("by zero")
        case "tells threads":
            (folder / "threads").write_text(os.environ["POLARS_MAX_THREADS"])
    (folder / f"{job.name}.done").touch()
