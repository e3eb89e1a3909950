"""Compiling shared out over processes, as after an install."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

from objstate.compiling import when_compiling

MOST_PROCESSES = 4  # parts of about equal work
PATIENCE = 120.0  # s that are waited for them


@cache
def share_out_compiling() -> None:
    """Once a loop has to be compiled, compile all of a run, by a process for each core.

    Loops that other processes don't bring about, whatever the reason, are compiled where they are
    needed.
    """
    when_compiling(_compile_for_a_run)


def _compile_for_a_run() -> None:
    from objstate.experiments.processes import default_workers
    from objstate.sensing import sweeps

    stats = sweeps.take.stats  # type: ignore[attr-defined]
    if default_workers() == 1 or stats.cache_path is None or stats.cache_hits:
        return  # nothing could be handed over, or the loops of every run were compiled before
    from objstate.cli.loops import EVERY_RUN

    compile_shared(EVERY_RUN)


def compile_shared(parts: int) -> None:
    """Compile the first ``parts`` of the loops that aren't yet, by a process for each core."""
    from objstate.cli.loops import compile_part
    from objstate.experiments.processes import default_workers

    processes = min(default_workers(), MOST_PROCESSES)
    command = [sys.executable, "-P", "-m", "objstate.cli.loops"]
    others: list[subprocess.Popen[bytes]] = []
    try:
        for part in range(1, processes):
            others.append(
                subprocess.Popen(
                    [*command, str(part), str(processes), str(parts)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,  # Ctrl-C is for the parent
                )
            )
        compile_part(0, processes, parts)
        for other in others:
            other.wait(PATIENCE)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        for other in others:
            other.kill()
            other.communicate()
