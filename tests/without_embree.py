"""The command line where embreex is not installed: ``python without_embree.py estimate ...``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from types import ModuleType


class Hidden(MetaPathFinder):
    """Finds embreex nowhere, however it was installed."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> None:
        if name.split(".", maxsplit=1)[0] == "embreex":
            raise ModuleNotFoundError("No module named 'embreex'", name=name)


if __name__ == "__main__":
    sys.meta_path.insert(0, Hidden())
    from objstate.cli import main

    sys.exit(main())
