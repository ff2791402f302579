"""Runs the command line: ``python -m fdi``."""

import sys

from fdi.cli import main

if __name__ == "__main__":
    sys.exit(main())
