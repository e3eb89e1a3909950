"""``python -m objstate`` is the command line."""

import sys

from objstate.cli import main

if __name__ == "__main__":
    sys.exit(main())
