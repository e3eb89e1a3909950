"""Compiling shared out over processes, as after an install."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

from objstate.compiling import when_compiling

MOST_PROCESSES = 4  # one group takes 0.3 of the time of a run's loops, so that more gain little
PATIENCE = 120.0  # s that are waited for them


@cache
def share_out_compiling() -> None:
    """Once a loop has to be compiled, compile all of a run, by a process for each core.

    Loops that other processes don't bring about, whatever the reason, are compiled where they are
    needed.
    """
    when_compiling(_compile_for_a_run)


def _compile_for_a_run() -> None:
    from objstate.processes import default_workers
    from objstate.sensing import sweeps

    stats = sweeps.take.stats  # type: ignore[attr-defined]
    if default_workers() == 1 or stats.cache_path is None or stats.cache_hits:
        return  # nothing could be handed over, or the loops of every run were compiled before
    from objstate.cli.loops import EVERY_RUN

    compile_shared(EVERY_RUN)


def compile_shared(groups: int) -> None:
    """Compile the first ``groups`` of loops that aren't yet, by a process for each core."""
    from objstate.cli.loops import compile_groups, handed_out
    from objstate.processes import default_workers

    command = [sys.executable, "-P", "-m", "objstate.cli.loops", str(os.getpid())]
    others: list[subprocess.Popen[bytes]] = []
    queue, end = os.pipe()
    os.write(end, bytes(range(groups)))
    os.close(end)
    try:
        for _ in range(1, min(default_workers(), MOST_PROCESSES)):
            others.append(
                subprocess.Popen(
                    command,
                    stdin=queue,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,  # Ctrl-C is for the parent
                )
            )
        compile_groups(handed_out(queue))
        for other in others:
            other.wait(PATIENCE)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        os.close(queue)
        for other in others:
            other.kill()
            other.wait()
