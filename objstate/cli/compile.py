"""``objstate compile``"""

from __future__ import annotations

import time

from objstate.cli.console import print_text

EXAMPLES = """\b
Examples:
  pip install . && objstate compile
  RUN objstate compile    # in a Dockerfile
"""


def compile_() -> None:
    """Compile the inner loops now, so that no estimate has to wait for it.

    Otherwise the first run after an install does, which takes it a quarter to half a minute. They
    are kept beside the package, or in the user's cache folder; set NUMBA_CACHE_DIR to keep them
    elsewhere.
    """
    from objstate.cli.loops import GROUPS, compile_groups
    from objstate.cli.sharing import compile_shared
    from objstate.errors import ResultError
    from objstate.sensing.sweeps import take

    if take.stats.cache_path is None:  # type: ignore[attr-defined]
        raise ResultError(
            "There is no place to keep compiled loops; set NUMBA_CACHE_DIR to a folder that can be "
            "written, here and for every run."
        )
    begin = time.monotonic()
    compile_shared(len(GROUPS))
    compile_groups(GROUPS)  # loaded, where others have compiled them
    print_text(f"The inner loops are compiled ({time.monotonic() - begin:.0f} s).")
