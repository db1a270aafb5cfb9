"""``heat-igl`` and ``python -m heat_igl``."""

from __future__ import annotations

import sys

from heat_igl.errors import MissingExtraError

__all__ = ["main"]


def main() -> int:
    """Run the command line on ``sys.argv`` and return the exit status."""
    try:
        from heat_igl import cli
    except ImportError as error:
        # Any other import error is a fault of the installation; the traceback identifies it.
        if (error.name or "").split(".")[0] not in ("typer", "rich", "click"):
            raise
        print(f"heat-igl: {MissingExtraError.of('the command line', 'typer and rich', 'cli')}", file=sys.stderr)
        return 1
    return cli.run(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
