"""Starts objstate from a checkout: ``python cli.py estimate ...``."""

import sys

from objstate.cli import main

if __name__ == "__main__":
    sys.exit(main())
