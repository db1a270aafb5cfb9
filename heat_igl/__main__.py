"""``heat-igl`` and ``python -m heat_igl``."""

from __future__ import annotations

import sys

from heat_igl.cli import run


def main() -> int:
    """Run the command line on ``sys.argv`` and return the exit status."""
    return run(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
