"""``python -m tickwise`` is the command ``tickwise``."""

import sys

from tickwise.cli import main

if __name__ == "__main__":
    sys.exit(main())
