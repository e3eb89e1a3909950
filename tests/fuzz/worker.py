"""One process that runs mutants and writes down what is wrong with them; also the engine of the tests."""

from __future__ import annotations

import faulthandler
import json
import os
import random
import resource
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.mutation import mutant
from tests.fuzz.targets import TARGETS, Target, run

LONGEST = 10.0  # s
MOST_MEMORY = 500  # MB more than before
HANGING = 60.0  # s, after which the process ends itself
MOST_ADDRESSES = 6 * 2**30  # bytes


def mutants(name: str, seed: int, start: int, stop: int) -> Iterator[tuple[int, bytes]]:
    """Mutants by number: always the same ones for the same seed."""
    target = TARGETS[name]
    seeds = target.seeds()
    for index in range(start, stop):
        rng = random.Random(f"{name} {seed} {index}")
        yield index, mutant(seeds, target.is_text, rng)


def fault(target: Target, content: bytes, folder: Path) -> str | None:
    """What is wrong with how a file is read: the end of a traceback, a time, an amount of memory."""
    began, before = time.monotonic(), _memory()
    try:
        with redirect_stdout(StringIO()):
            run(target, content, folder)
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:300]} {_place(error)}"
    elapsed, grown = time.monotonic() - began, _memory() - before
    if elapsed > LONGEST:
        return f"takes {elapsed:.0f} s"
    return f"takes {grown} MB" if grown > MOST_MEMORY else None


def _place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/objstate/" in f.filename] or frames
    return f"({Path(ours[-1].filename).name}:{ours[-1].lineno}, {frames[-1].name})"


def _memory() -> int:
    """MB that the process has had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def main(name: str, seed: int, start: int, stop: int, note: Path) -> None:
    """Run mutants; each fault is a line of JSON on stdout. ``note`` tells which one is under way."""
    warnings.simplefilter("error", RuntimeWarning)
    warnings.simplefilter("error", SyntaxWarning)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_ADDRESSES, MOST_ADDRESSES))
    target = TARGETS[name]
    with TemporaryDirectory() as folder:
        home = Path(folder) / "of_fuzz"
        home.mkdir()
        target.prepare(home)
        at = os.open(note, os.O_CREAT | os.O_WRONLY)
        for index, content in mutants(name, seed, start, stop):
            os.pwrite(at, f"{index:12d}".encode(), 0)
            faulthandler.dump_traceback_later(HANGING, exit=True)
            found = fault(target, content, home)
            if found is not None:
                print(json.dumps({"index": index, "fault": found}), flush=True)
                if found.startswith("takes"):
                    break  # memory is counted at its most, so count anew
        faulthandler.cancel_dump_traceback_later()
        os.close(at)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]), Path(sys.argv[5]))
